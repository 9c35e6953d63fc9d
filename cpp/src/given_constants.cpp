#include "dynakin/given_constants.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace dynakin {
namespace {

constexpr int k_chunk_rows = 256;    // all rows of a frame, of all but a hundred markers
constexpr double k_nothing = 1e-13;  // of a variance: what rounding leaves of one that is zero

}  // namespace

GivenConstants::GivenConstants(const Model& model, const FilterSettings& settings) {
  const int n = model.state_size();
  std::vector<std::uint8_t> is_own(n, 0);
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    own.emplace_back();
    for (const auto& columns : {model.markers()[m].column, model.markers()[m].soft_tissue})
      for (const int c : columns)
        if (c != k_none) {
          is_own[c] = 1;
          own.back().push_back(c);
        }
  }
  place.assign(n, 0);
  std::vector<int> of_markers;
  for (int i = 0; i < n; ++i) {
    const bool moves = i < 3 * model.n_free() || settings.process_variance(i) != 0.0 ||
                       settings.process_density(i) != 0.0 || settings.decay_rate(i) != 0.0;
    if (moves) {
      if (!is_own[i]) wide.push_back(d());
      place[i] = d();
      moving.push_back(i);
    } else {
      (is_own[i] ? of_markers : constant).push_back(i);
    }
  }
  wide_constants = c();
  constant.insert(constant.end(), of_markers.begin(), of_markers.end());
  for (int k = 0; k < c(); ++k) place[constant[k]] = -1 - k;
}

int chunk_rows(int max_rows) { return std::min(std::max(k_chunk_rows, 6), std::max(max_rows, 1)); }

void factor_covariance(Eigen::MatrixXd& A) {
  if (A.rows() == 0) return;
  const Eigen::VectorXd variance = A.diagonal();
  const Eigen::MatrixXd given = A;
  if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(A).info() != Eigen::Success ||
      !(A.diagonal().array().square() > k_nothing * variance.array()).all()) {
    A = given;
    const Eigen::Index n = A.rows();
    for (Eigen::Index j = 0; j < n; ++j) {
      auto column = A.col(j).tail(n - j);
      column.noalias() -= A.block(j, 0, n - j, j) * A.row(j).head(j).transpose();
      const double pivot = column(0);
      if (pivot > k_nothing * variance(j))
        column /= std::sqrt(pivot);
      else
        column.setZero();
    }
  }
  A.triangularView<Eigen::StrictlyUpper>().setZero();
}

}  // namespace dynakin
