// A recording's arrays as a filter takes them, checked for their shapes.
#pragma once

#include <optional>

#include "arrays.hpp"
#include "dynakin/trial.hpp"

inline dynakin::Trial trial_of(const dynakin::Filter& filter, const Array1& time, const Array3& markers,
                               const Array2& wrench, const std::optional<Array3>& wrench_covariance = {}) {
  const std::size_t n_markers = filter.model().markers().size(), frames = time.shape(0);
  if (markers.shape(0) != frames || markers.shape(1) != n_markers || markers.shape(2) != 3)
    throw std::invalid_argument("markers: expected (" + std::to_string(frames) + ", " + std::to_string(n_markers) +
                                ", 3)");
  if (wrench.shape(0) != frames || wrench.shape(1) != 6)
    throw std::invalid_argument("wrench: expected (" + std::to_string(frames) + ", 6)");
  if (wrench_covariance && (wrench_covariance->shape(0) != frames || wrench_covariance->shape(1) != 6 ||
                            wrench_covariance->shape(2) != 6))
    throw std::invalid_argument("wrench_covariance: expected (" + std::to_string(frames) + ", 6, 6)");
  return {time.data(), markers.data(), wrench.data(), frames,
          wrench_covariance ? wrench_covariance->data() : nullptr};
}
