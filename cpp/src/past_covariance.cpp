#include "dynakin/past_covariance.hpp"

#include <algorithm>
#include <set>

#include "given_transition.hpp"

namespace dynakin {

using Eigen::Index;

PastCovariance::PastCovariance(const Model& model, const FilterSettings& settings, int max_rows)
    : model_(model),
      settings_(settings),
      apart_(model, settings),
      how_(model),
      M_(apart_.d(), model.state_size()),
      P_(apart_.d(), apart_.d()),
      U_(apart_.d(), max_rows),
      covariance_(Eigen::MatrixXd::Zero(model.state_size(), model.state_size())) {
  std::vector<std::set<Index>> past(static_cast<std::size_t>(M_.count())), present(past);
  const auto need = [&](int one, int other) {
    const int i = apart_.place[one], j = apart_.place[other];
    if (i < 0) return;
    const auto panel = static_cast<std::size_t>(i / Panels::height);
    if (j < 0)
      present[panel].insert(other / Panels::width);
    else if (j <= i)
      past[panel].insert(j / Panels::width);
  };
  for (int k = 0; k < apart_.wide; ++k) {
    for (int l = 0; l <= k; ++l) need(apart_.moving[k], apart_.moving[l]);
    for (int l = 0; l < apart_.wide_constants; ++l) need(apart_.moving[k], apart_.constant[l]);
  }
  for (std::size_t m = 0; m < apart_.own.size(); ++m)
    for (const int own : apart_.own[m])
      for (const int other : model.marker_columns(static_cast<int>(m))) {
        need(own, other);
        need(other, own);
      }
  for (const auto& groups : past) past_.emplace_back(groups.begin(), groups.end());
  for (const auto& groups : present) present_.emplace_back(groups.begin(), groups.end());
}

void PastCovariance::start(const Eigen::MatrixXd& P) {
  const double* columns[Panels::height];
  for (Index p = 0; p < M_.count(); ++p) {
    const Index first = p * Panels::height, rows = std::min(Panels::height, apart_.d() - first);
    for (Index r = 0; r < rows; ++r) columns[r] = P.col(apart_.moving[first + r]).data();
    double* to = M_.panel(p);
    for (Index j = 0; j < P.rows(); ++j, to += Panels::height)
      for (Index r = 0; r < rows; ++r) to[r] = columns[r][j];
    for (Index j = 0; j < first + rows; ++j)
      std::copy_n(M_.panel(p) + apart_.moving[j] * Panels::height, Panels::height, P_.panel(p) + j * Panels::height);
  }
}

void PastCovariance::add_frame(const FrameTape& tape, double dt, bool last) {
  how_.step = dt;
  how_.kept = (-dt * settings_.decay_rate.array()).exp();
  const Index n = model_.state_size();
  for (Index p = 0; p < M_.count(); ++p) {
    Eigen::Map<Eigen::Matrix<double, Panels::height, Eigen::Dynamic>> M(M_.panel(p), Panels::height, n);
    by_transition(how_, M);
    if (!tape.any_forgotten) continue;
    for (Index i = 0; i < n; ++i)
      if (tape.forgotten[i]) M.col(i).setZero();
  }
  for (const FrameTape::Chunk& chunk : tape.chunks) take(tape, chunk, last && &chunk == &tape.chunks.back());
}

// U = M H' L^-T, M - U Z' and P - U U'.
void PastCovariance::take(const FrameTape& tape, const FrameTape::Chunk& chunk, bool last) {
  const auto L = tape.L.block(chunk.from, chunk.from, tape.L.rows() - chunk.from, chunk.rows);
  for (Index p = 0; p < M_.count(); ++p) {
    Index at = 0;
    for (int b = chunk.first_block; b < chunk.end_block; ++b) {
      const Panels::Rows H = tape.rows_of(tape.blocks[b]);
      U_.combine(p, at, H, M_);
      at += H.rows;
    }
    U_.divide(p, L, chunk.rows);
    if (last)
      for (const Index group : present_[p]) M_.take_product(p, group, U_, tape.Z, chunk.from, chunk.rows);
    else
      for (Index group = 0; group < M_.max_columns() / Panels::width; ++group)
        M_.take_product(p, group, U_, tape.Z, chunk.from, chunk.rows);
    for (const Index group : past_[p]) P_.take_product(p, group, U_, U_, 0, chunk.rows);
  }
}

void PastCovariance::end(const Eigen::MatrixXd& P) {
  const auto both = [this](int i, int j, double value) { covariance_(i, j) = covariance_(j, i) = value; };
  for (int k = 0; k < apart_.wide; ++k) {
    for (int l = 0; l <= k; ++l) both(apart_.moving[k], apart_.moving[l], P_.at(k, l));
    for (int l = 0; l < apart_.wide_constants; ++l)
      both(apart_.moving[k], apart_.constant[l], M_.at(k, apart_.constant[l]));
  }
  for (int k = 0; k < apart_.wide_constants; ++k)
    for (int l = 0; l < apart_.wide_constants; ++l)
      covariance_(apart_.constant[l], apart_.constant[k]) = P(apart_.constant[l], apart_.constant[k]);
  for (std::size_t m = 0; m < apart_.own.size(); ++m)
    for (const int own : apart_.own[m])
      for (const int other : model_.marker_columns(static_cast<int>(m))) {
        const int i = apart_.place[own], j = apart_.place[other];
        if (i >= 0 && j >= 0)
          both(own, other, P_.at(std::max(i, j), std::min(i, j)));
        else if (i >= 0)
          both(own, other, M_.at(i, other));
        else if (j >= 0)
          both(own, other, M_.at(j, own));
        else
          both(own, other, P(own, other));
      }
}

}  // namespace dynakin
