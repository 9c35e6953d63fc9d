// Measurements as a filter takes them, checked for their shapes.
#pragma once

#include <optional>

#include "arrays.hpp"
#include "dynakin/trial.hpp"

inline dynakin::Trial trial_of(const dynakin::Filter& filter, const Array1& time, const Array3& markers,
                               const Array2& wrench, const std::optional<Array3>& wrench_covariance = {},
                               const std::optional<Array3>& wrench_effects = {}) {
  const std::size_t n_markers = filter.model().markers().size(), frames = time.shape(0);
  if (markers.shape(0) != frames || markers.shape(1) != n_markers || markers.shape(2) != 3)
    throw std::invalid_argument("markers: expected (" + std::to_string(frames) + ", " + std::to_string(n_markers) +
                                ", 3)");
  if (wrench.shape(0) != frames || wrench.shape(1) != 6)
    throw std::invalid_argument("wrench: expected (" + std::to_string(frames) + ", 6)");
  if (wrench_covariance &&
      (wrench_covariance->shape(0) != frames || wrench_covariance->shape(1) != 6 || wrench_covariance->shape(2) != 6))
    throw std::invalid_argument("wrench_covariance: expected (" + std::to_string(frames) + ", 6, 6)");
  const auto columns = static_cast<std::size_t>(6 * filter.model().contacts());
  if (wrench_covariance && !wrench_effects && columns > 0)
    throw std::invalid_argument("wrench_effects: expected next to wrench_covariance");
  if (wrench_effects &&
      (wrench_effects->shape(0) != frames || wrench_effects->shape(1) != 6 || wrench_effects->shape(2) != columns))
    throw std::invalid_argument("wrench_effects: expected (" + std::to_string(frames) + ", 6, " +
                                std::to_string(columns) + ")");
  return {time.data(),
          markers.data(),
          wrench.data(),
          frames,
          wrench_covariance ? wrench_covariance->data() : nullptr,
          wrench_effects ? wrench_effects->data() : nullptr};
}

// How one frame's wrench is measured, where that is given.
class GivenWrenchModel {
 public:
  GivenWrenchModel(const dynakin::Model& model, const std::optional<dynakin::Matrix6>& covariance,
                   const std::optional<Eigen::MatrixXd>& effects) {
    if (!covariance) return;
    const Eigen::Index columns = 6 * model.contacts();
    if (effects && effects->rows() != 6) throw std::invalid_argument("wrench_effects: expected 6 rows");
    given_ = {*covariance, effects ? *effects : Eigen::MatrixXd::Zero(6, columns)};
  }
  operator const dynakin::WrenchModel*() const { return given_ ? &*given_ : nullptr; }

 private:
  std::optional<dynakin::WrenchModel> given_;
};
