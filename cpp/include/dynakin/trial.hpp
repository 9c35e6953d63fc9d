// What was measured in a whole trial, as a filter takes it frame by frame.
#pragma once

#include <cstddef>

#include "dynakin/filter.hpp"

namespace dynakin {

// Row-major arrays, a row a frame, which must outlive it.
struct Trial {
  const double* time;     // s
  const double* markers;  // (frames, M, 3) m
  const double* wrench;   // (frames, 6) N, N m about the ground origin
  std::size_t frames;
  // WrenchModel of each frame: (frames, 6, 6), symmetric, and (frames, 6, 6 C); nullptr: the settings' covariance.
  const double* wrench_covariance = nullptr;
  const double* wrench_effects = nullptr;

  double dt(std::size_t k) const { return k == 0 ? 0.0 : time[k] - time[k - 1]; }
  Eigen::Map<const MarkerMatrix> markers_at(std::size_t k, std::size_t n_markers) const {
    return {markers + 3 * n_markers * k, 3, static_cast<Eigen::Index>(n_markers)};
  }
  // How the wrench of a frame is measured, nullptr where the settings say it. how: room for it.
  const WrenchModel* wrench_model(std::size_t k, int contacts, WrenchModel& how) const {
    if (!wrench_covariance) return nullptr;
    using Effects = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index columns = 6 * contacts;
    how.covariance = Eigen::Map<const Matrix6>(wrench_covariance + 36 * k);
    how.effects = Eigen::Map<const Effects>(wrench_effects + 6 * columns * k, 6, columns);
    return &how;
  }
  Eigen::Map<const Vector6> wrench_at(std::size_t k) const { return Eigen::Map<const Vector6>(wrench + 6 * k); }
  // One step of a filter; frame 0 is an update only. how: room for a WrenchModel.
  StepReport step(Filter& filter, std::size_t k, WrenchModel& how) const {
    if (k > 0) filter.predict(dt(k));
    return filter.update(markers_at(k, filter.model().markers().size()), wrench_at(k),
                         wrench_model(k, filter.model().contacts(), how));
  }
};

}  // namespace dynakin
