// What was measured in a whole trial, as a filter takes it frame by frame.
#pragma once

#include <cstddef>

#include "dynakin/filter.hpp"

namespace dynakin {

// Row-major arrays, a row a frame, which must outlive it.
struct Trial {
  const double* time;                         // s
  const double* markers;                      // (frames, M, 3) m
  const double* wrench;                       // (frames, 6) N, N m about the ground origin
  std::size_t frames;
  const double* wrench_covariance = nullptr;  // (frames, 6, 6) about the ground origin; nullptr: the settings'

  double dt(std::size_t k) const { return k == 0 ? 0.0 : time[k] - time[k - 1]; }
  Eigen::Map<const MarkerMatrix> markers_at(std::size_t k, std::size_t n_markers) const {
    return {markers + 3 * n_markers * k, 3, static_cast<Eigen::Index>(n_markers)};
  }
  // One step of a filter; frame 0 is an update only.
  StepReport step(Filter& filter, std::size_t k) const {
    if (k > 0) filter.predict(dt(k));
    Matrix6 R;
    if (wrench_covariance) R = Eigen::Map<const Matrix6>(wrench_covariance + 36 * k);
    return filter.update(markers_at(k, filter.model().markers().size()), Eigen::Map<const Vector6>(wrench + 6 * k),
                         wrench_covariance ? &R : nullptr);
  }
};

}  // namespace dynakin
