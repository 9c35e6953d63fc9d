// A recording's arrays as a filter takes them, checked for their shapes.
#pragma once

#include "arrays.hpp"
#include "dynakin/filter.hpp"

struct Trial {
  Trial(const dynakin::Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench)
      : time(time.data()), markers(markers.data()), wrench(wrench.data()), frames(time.shape(0)) {
    const std::size_t n_markers = filter.model().markers().size();
    if (markers.shape(0) != frames || markers.shape(1) != n_markers || markers.shape(2) != 3)
      throw std::invalid_argument("markers: expected (" + std::to_string(frames) + ", " + std::to_string(n_markers) +
                                  ", 3)");
    if (wrench.shape(0) != frames || wrench.shape(1) != 6)
      throw std::invalid_argument("wrench: expected (" + std::to_string(frames) + ", 6)");
  }
  const double *time, *markers, *wrench;
  std::size_t frames;
};
