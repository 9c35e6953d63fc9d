#include "dynakin/given_constants.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

namespace dynakin {
namespace {

constexpr int k_chunk_rows = 256;    // all rows of a frame, of all but a hundred markers
constexpr double k_nothing = 1e-13;  // of a variance: what rounding leaves of one that is zero

}  // namespace

GivenConstants::GivenConstants(const Model& model, const FilterSettings& settings) {
  const int n = model.state_size(), free = model.n_free();
  std::vector<std::uint8_t> is_own(n, 0);
  for (const auto& marker : model.markers()) {
    own.emplace_back();
    for (const auto& columns : {marker.column, marker.soft_tissue})
      for (const int c : columns)
        if (c != k_none) {
          is_own[c] = 1;
          own.back().push_back(c);
        }
  }
  for (const bool of_markers : {false, true}) {
    for (int i = 0; i < n; ++i) {
      if ((is_own[i] != 0) != of_markers) continue;
      const bool moves = i < 3 * free || settings.process_variance(i) != 0.0 || settings.process_density(i) != 0.0 ||
                         settings.decay_rate(i) != 0.0;
      (moves ? moving : constant).push_back(i);
    }
    if (of_markers) break;
    wide = d();
    wide_constants = c();
  }
  place.assign(n, 0);
  for (int k = 0; k < d(); ++k) place[moving[k]] = k;
  for (int k = 0; k < c(); ++k) place[constant[k]] = -1 - k;
  for (std::size_t m = 0; m < own.size(); ++m) {
    own_moving.emplace_back();
    for (const int column : own[m])
      if (place[column] >= 0) own_moving.back().push_back(place[column]);
    std::set<int> places;
    for (const int column : model.marker_columns(static_cast<int>(m))) {
      const int at = place[column];
      if (at >= 3 * free)
        places.insert(at);
      else if (at >= 0)
        places.insert({at % free, free + at % free, 2 * free + at % free});
    }
    movers.emplace_back(places.begin(), places.end());
  }
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
