#include "dynakin/output_sd.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {
namespace {

// sqrt of row J P J', with the row's columns of P. Rounding may leave a variance of 0 below it.
template <class Row>
double deviation(const Row& row, const std::vector<int>& columns, const Eigen::MatrixXd& P,
                 const std::vector<int>& slot) {
  double variance = 0.0;
  for (const int c : columns) {
    const double a = row(slot[c]);
    if (a == 0.0) continue;
    double sum = 0.0;
    const double* column = P.col(c).data();
    for (const int d : columns) sum += column[d] * row(slot[d]);
    variance += a * sum;
  }
  return std::sqrt(std::max(variance, 0.0));
}

}  // namespace

RowVariances::RowVariances(Eigen::Index rows, Eigen::Index states) : columns_(states) {
  J_.setZero(rows, states);
  JP_ = J_;
  P_.setZero(states, states);
}

void RowVariances::operator()(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::MatrixXd& P, double* out) {
  Eigen::Index used = 0;
  for (Eigen::Index c = 0; c < J.cols(); ++c)
    if (!J.col(c).isZero(0.0)) columns_[used++] = c;
  auto Ju = J_.leftCols(used);
  auto Pu = P_.topLeftCorner(used, used);
  for (Eigen::Index k = 0; k < used; ++k) {
    Ju.col(k) = J.col(columns_[k]);
    const double* column = P.col(columns_[k]).data();
    for (Eigen::Index r = 0; r < used; ++r) Pu(r, k) = column[columns_[r]];
  }
  auto JPu = JP_.leftCols(used);
  JPu.setZero();
  constexpr Eigen::Index depth = 32, width = 128;  // what Eigen packs of such a product stays on the stack
  for (Eigen::Index c = 0; c < used; c += width)
    for (Eigen::Index k = 0; k < used; k += depth) {
      const Eigen::Index nc = std::min(width, used - c), nk = std::min(depth, used - k);
      JPu.middleCols(c, nc).noalias() += Ju.middleCols(k, nk) * Pu.block(k, c, nk, nc);
    }
  for (Eigen::Index r = 0; r < J.rows(); ++r) out[r] = JPu.row(r).dot(Ju.row(r));
}

OutputDeviation::OutputDeviation(const Model& model)
    : model_(model),
      slot_(marker_column_slots(model)),
      work_(model),
      wrench_variances_(6, model.state_size()),
      moment_variances_(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size()) {
  std::size_t widest = 0;
  for (std::size_t m = 0; m < model.markers().size(); ++m)
    widest = std::max(widest, model.marker_columns(static_cast<int>(m)).size());
  marker_J_.setZero(3, static_cast<Eigen::Index>(widest));
  wrench_J_.setZero(6, model.state_size());
  moment_J_.setZero(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size());
}

void OutputDeviation::markers(const KinematicState& state, const Eigen::MatrixXd& P, double* out) {
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    const auto& columns = model_.marker_columns(static_cast<int>(m));
    auto J = marker_J_.leftCols(static_cast<Eigen::Index>(columns.size()));
    marker_jacobian(model_, state, static_cast<int>(m), slot_[m], J);
    for (int k = 0; k < 3; ++k) out[3 * m + k] = deviation(J.row(k), columns, P, slot_[m]);
  }
}

void OutputDeviation::wrench(const KinematicState& state, const DynamicState& dynamics, const Eigen::MatrixXd& P,
                             double* out) {
  wrench_jacobian(model_, state, dynamics, wrench_J_);
  wrench_variances_(wrench_J_, P, out);
  for (int k = 0; k < 6; ++k) out[k] = std::sqrt(std::max(out[k], 0.0));
}

void OutputDeviation::moments(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                              const Eigen::MatrixXd& P, double* out) {
  moment_jacobian(model_, x, state, dynamics, nullptr, work_, moment_J_);
  moment_variances_(moment_J_, P, out);
  for (Eigen::Index k = 0; k < moment_J_.rows(); ++k) out[k] = std::sqrt(std::max(out[k], 0.0));
}

}  // namespace dynakin
