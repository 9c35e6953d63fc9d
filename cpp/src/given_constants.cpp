#include "dynakin/given_constants.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mirror.hpp"

namespace dynakin {
namespace {

constexpr int k_chunk_rows = 256;    // all rows of a frame, of all but a hundred markers
constexpr double k_nothing = 1e-13;  // of a variance: what rounding leaves of one that is zero

// A = C C' in place, of a covariance that may leave some combinations no variance: their columns of C are zero.
void factor(Eigen::MatrixXd& A) {
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

// Columns of M, those of the coordinates, speeds and accelerations first: M F'.
void by_transition(const Transition& how, const std::vector<int>& moving, int n, Eigen::MatrixXd& M) {
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(0, n) += dt * M.middleCols(n, n) + half * M.middleCols(2 * n, n);
  M.middleCols(n, n) += dt * M.middleCols(2 * n, n);
  for (std::size_t j = 3 * n; j < moving.size(); ++j)
    if (const double kept = how.kept(moving[j]); kept != 1.0) M.col(j) *= kept;
}

// M F^-T
void by_transition_back(const Transition& how, const std::vector<int>& moving, int n, Eigen::MatrixXd& M) {
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(0, n) += half * M.middleCols(2 * n, n) - dt * M.middleCols(n, n);
  M.middleCols(n, n) -= dt * M.middleCols(2 * n, n);
  for (std::size_t j = 3 * n; j < moving.size(); ++j)
    if (const double kept = how.kept(moving[j]); kept != 1.0) M.col(j) /= kept;
}

// M F
void by_transposed_transition(const Transition& how, const std::vector<int>& moving, int n, Eigen::MatrixXd& M) {
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(2 * n, n) += dt * M.middleCols(n, n) + half * M.middleCols(0, n);
  M.middleCols(n, n) += dt * M.middleCols(0, n);
  for (std::size_t j = 3 * n; j < moving.size(); ++j)
    if (const double kept = how.kept(moving[j]); kept != 1.0) M.col(j) *= kept;
}

// M <- M F, F' M, F M or F^-1 M by rows: a column at a time, which stays in the cache.
template <class Column>
void rows_by_transition(double dt, int n, Column&& x) {
  x.segment(0, n) += dt * x.segment(n, n) + (0.5 * dt * dt) * x.segment(2 * n, n);
  x.segment(n, n) += dt * x.segment(2 * n, n);
}
template <class Column>
void rows_by_transposed(double dt, int n, Column&& x) {
  x.segment(2 * n, n) += dt * x.segment(n, n) + (0.5 * dt * dt) * x.segment(0, n);
  x.segment(n, n) += dt * x.segment(0, n);
}

}  // namespace

GivenConstants::GivenConstants(const Model& model, const FilterSettings& settings, int max_rows)
    : model_(model), settings_(settings) {
  sort_columns();
  const int d = moving(), c = constants(), n = model.state_size();
  c_ = c_now_ = Eigen::VectorXd::Zero(c);
  Ct_.setZero(c, c);
  S_.setZero(d, d);
  Vt_.setZero(c, d);
  shift_ = lambda_ = Eigen::VectorXd::Zero(d);
  R_.setZero(6, max_rows);
  const int chunk = std::min(std::max(k_chunk_rows, 6), std::max(max_rows, 1));
  Zt_.setZero(chunk, d);
  Z_panels_ = Panels(d, chunk);
  D_panels_ = Panels(c, chunk);
  S_rows_.setZero(Z_panels_.max_columns(), chunk);
  Lambda_ = P_ = X_ = S_;
  Wt_ = Yt_ = Vt_;
  G_.setZero(d, chunk);
  M_.setZero(std::max(c, d), std::max(chunk, d));
  T_.setZero(chunk, chunk);
  Yw_.setZero(c, static_cast<Eigen::Index>(wide_.size()));
  covariance_.setZero(n, n);
}

void GivenConstants::sort_columns() {
  const int n = model_.state_size();
  std::vector<std::uint8_t> is_own(n, 0);
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    own_.emplace_back();
    for (const auto& columns : {model_.markers()[m].column, model_.markers()[m].soft_tissue})
      for (const int c : columns)
        if (c != k_none) {
          is_own[c] = 1;
          own_.back().push_back(c);
        }
  }
  place_.assign(n, 0);
  std::vector<int> of_markers;
  for (int i = 0; i < n; ++i) {
    const bool moves = i < 3 * model_.n_free() || settings_.process_variance(i) != 0.0 ||
                       settings_.process_density(i) != 0.0 || settings_.decay_rate(i) != 0.0;
    if (moves) {
      if (!is_own[i]) wide_.push_back(moving());
      place_[i] = moving();
      moving_.push_back(i);
    } else {
      (is_own[i] ? of_markers : constant_).push_back(i);
    }
  }
  wide_constants_ = constants();
  constant_.insert(constant_.end(), of_markers.begin(), of_markers.end());
  for (int k = 0; k < constants(); ++k) place_[constant_[k]] = -1 - k;
}

void GivenConstants::end(const Belief& last) {
  c_ = last.x(constant_);
  Eigen::MatrixXd C = last.P(constant_, constant_);
  covariance_ = last.P;
  factor(C);
  Ct_ = C.transpose();
  lambda_.setZero();
  Lambda_.setZero();
  Wt_.setZero();
  there_ = false;
  ended_ = true;
}

void GivenConstants::start(const Belief& before, const Eigen::VectorXd& moved) {
  c_now_ = c_ - moved(constant_);
  Eigen::MatrixXd L = before.P(constant_, constant_);
  Vt_ = before.P(constant_, moving_);
  // Combinations that an equality has made sure have rounding for a variance; with some of their own they say nothing.
  for (Eigen::Index e = 0; e < settings_.equality.rows(); ++e) {
    if (!settings_.equality.row(e)(moving_).isZero(0.0)) continue;
    const Eigen::VectorXd a = settings_.equality.row(e)(constant_).transpose();
    const double most = (a.array().square() * L.diagonal().array()).sum();
    if (a.dot(L * a) > 1e-9 * most) continue;  // not yet
    L += (most > 0.0 ? most : 1.0) / (a.squaredNorm() * a.squaredNorm()) * a * a.transpose();
  }
  factor(L);
  for (int k = 0; k < constants(); ++k)
    if (L(k, k) == 0.0) {  // no variance is left: d does not hang on it
      L(k, k) = 1.0;
      Vt_.row(k).setZero();
    }
  S_ = before.P(moving_, moving_);
  there_ = false;
  shift_.setZero();
  if (constants() == 0) return;
  L.triangularView<Eigen::Lower>().solveInPlace(Vt_);
  S_.selfadjointView<Eigen::Lower>().rankUpdate(Vt_.transpose(), -1.0);
  mirror_lower(S_);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(Vt_);
  shift_.noalias() = Vt_.transpose() * (c_now_ - before.x(constant_));
  Vt_ = (Ct_.triangularView<Eigen::Upper>() * Vt_).eval();
}

void GivenConstants::step(const std::vector<RowBlock>& blocks, const Frame* last, Frame& frame) {
  const Decision& decided = *frame.decided;
  if (last) shift_ = last->mean - last->after(moving_);
  predict(last ? last->S : S_, last ? last->Vt : Vt_, frame);
  gather(blocks, frame);
  int from = 0;
  for (const int end : frame.chunk_ends) {
    correct(from, end, frame);
    from = end;
  }
  keep_equalities(frame);
  for (const auto& [column, u] : decided.pull)
    if (const int i = place_[column]; i >= 0) shift_ += u * frame.S.col(i);
  if (decided.moved.size() > 0) {
    shift_ += decided.moved(moving_);
    c_now_ += decided.moved(constant_);
  }
  frame.mean = frame.before(moving_) + shift_;
}

void GivenConstants::predict(const Eigen::MatrixXd& S, const Eigen::MatrixXd& Vt, Frame& frame) {
  const Decision& decided = *frame.decided;
  const int n = model_.n_free(), d = moving();
  if (frame.first)
    frame.how = Transition(model_);
  else
    transition(model_, settings_, decided.carried, frame.dt, frame.how);
  const Transition& how = frame.how;
  frame.S = S;
  by_transition(how, moving_, n, frame.S);
  for (int j = 0; j < d; ++j) {
    auto column = frame.S.col(j);
    rows_by_transition(how.step, n, column);
    for (int i = 3 * n; i < d; ++i) column(i) *= how.kept(moving_[i]);
  }
  mirror_lower(frame.S);
  frame.Vt = Vt;
  by_transition(how, moving_, n, frame.Vt);
  rows_by_transition(how.step, n, shift_);
  for (int i = 3 * n; i < d; ++i) shift_(i) *= how.kept(moving_[i]);
  const auto add_noise = [&](const Transition& noise) {
    for (int i = 0; i < d; ++i) frame.S(i, i) += noise.variance(moving_[i]);
    for (int i = 0; i < n; ++i) {
      const double q_qd = noise.shared(i, 0), q_qdd = noise.shared(i, 1), qd_qdd = noise.shared(i, 2);
      frame.S(n + i, i) += q_qd;
      frame.S(i, n + i) += q_qd;
      frame.S(2 * n + i, i) += q_qdd;
      frame.S(i, 2 * n + i) += q_qdd;
      frame.S(2 * n + i, n + i) += qd_qdd;
      frame.S(n + i, 2 * n + i) += qd_qdd;
    }
  };
  add_noise(how);
  const RecoverySettings& sought = settings_.recovery;
  for (const int i : decided.forgotten) {
    const double sd = i < n ? sought.coordinate_sd : i < 2 * n ? sought.speed_sd : sought.acceleration_sd;
    frame.S.row(i).setZero();
    frame.S.col(i).setZero();
    frame.S(i, i) = sd * sd;
    frame.Vt.col(i).setZero();
    shift_(i) = 0.0;
  }
  if (decided.stirred > 0.0) {
    Transition noise(model_);
    stir(model_, settings_, decided.stirred, decided.stirred_s, noise);
    add_noise(noise);
    frame.how.variance += noise.variance;
    frame.how.shared += noise.shared;
  }
}

// Rows that nothing moving has a part in tell nothing that the constants do not hold already.
void GivenConstants::gather(const std::vector<RowBlock>& blocks, Frame& frame) {
  for (auto* of : {&frame.row_ends, &frame.columns, &frame.chunk_ends, &frame.block_first, &c_ends_, &c_columns_})
    of->clear();
  for (auto* of : {&frame.values, &c_values_, &innovation_}) of->clear();
  const bool elsewhere = frame.decided->linearised.size() > 0;
  int chunk_first = 0;
  for (const RowBlock& block : blocks) {
    const std::vector<int>& columns = *block.columns;
    if (block.rows == 0 || std::none_of(columns.begin(), columns.end(), [&](int c) { return place_[c] >= 0; }))
      continue;
    const int first = frame.rows();
    if (first > chunk_first && first + block.rows - chunk_first > k_chunk_rows) {
      frame.chunk_ends.push_back(first);
      chunk_first = first;
    }
    for (int r = 0; r < block.rows; ++r) {
      double v = block.v(r);
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const double h = block.H(r, k);
        const int column = columns[k], place = place_[column];
        if (elsewhere) v += h * (frame.decided->linearised(column) - frame.before(column));
        if (place >= 0) {
          frame.columns.push_back(place);
          frame.values.push_back(h);
        } else {
          v -= h * (c_now_(-1 - place) - frame.before(column));
          c_columns_.push_back(-1 - place);
          c_values_.push_back(h);
        }
      }
      for (int s = 0; s < block.rows; ++s) R_(s, frame.rows()) = block.R(s, r);
      innovation_.push_back(v);
      frame.block_first.push_back(first);
      frame.row_ends.push_back(static_cast<int>(frame.columns.size()));
      c_ends_.push_back(static_cast<int>(c_columns_.size()));
    }
  }
  if (frame.rows() > chunk_first) frame.chunk_ends.push_back(frame.rows());
  const Eigen::Index most = R_.cols();
  if (frame.Z.cols() < most) {
    frame.Z.resize(moving(), most);
    frame.Dt.resize(constants(), most);
    frame.L.resize(S_rows_.rows(), most);
    frame.w.resize(most);
  }
}

void GivenConstants::correct(int from, int end, Frame& frame) {
  const int rows = end - from;
  auto Z = frame.Z.middleCols(from, rows);
  auto Dt = frame.Dt.middleCols(from, rows);
  auto w = frame.w.segment(from, rows);
  for (int r = 0; r < rows; ++r) {
    double v = innovation_[from + r];
    for (int k = frame.begin(from + r); k < frame.row_ends[from + r]; ++k)
      v -= frame.values[k] * shift_(frame.columns[k]);
    w(r) = v;
  }
  // Rows of a block have the same columns.
  for (int row = from; row < end;) {
    const int first = frame.block_first[row], at = row - from;
    int count = 1;
    while (row + count < end && frame.block_first[row + count] == first) ++count;
    const auto rows_of = [&](const std::vector<int>& ends, const std::vector<int>& columns,
                             const std::vector<double>& values) {
      const int begin = row == 0 ? 0 : ends[row - 1], size = ends[row] - begin;
      return Panels::Rows{
          {columns.data() + begin, static_cast<std::size_t>(size)}, values.data() + begin, count, size, 1};
    };
    const Panels::Rows H = rows_of(frame.row_ends, frame.columns, frame.values);
    const Panels::Rows Hc = rows_of(c_ends_, c_columns_, c_values_);
    for (Eigen::Index p = 0; p < Z_panels_.count(); ++p) Z_panels_.combine(p, at, H, frame.S);
    for (Eigen::Index p = 0; p < D_panels_.count(); ++p) {
      D_panels_.combine(p, at, H, frame.Vt);
      D_panels_.combine(p, at, Hc, Ct_, true);
    }
    row += count;
  }
  auto Zt = Zt_.topRows(rows);
  Z_panels_.get_transposed(Zt);
  auto L = frame.L.block(0, from, rows, rows);
  auto S = S_rows_.topLeftCorner(rows, rows);
  for (int r = 0; r < rows; ++r) {
    const int row = from + r, first = frame.block_first[row];
    auto below = S.col(r).tail(rows - r);
    below.setZero();
    for (int k = frame.begin(row); k < frame.row_ends[row]; ++k)
      below += frame.values[k] * Zt.col(frame.columns[k]).tail(rows - r);
    for (int other = row; other < end && frame.block_first[other] == first; ++other)
      S(other - from, r) += R_(other - first, row);
  }
  L = S.triangularView<Eigen::Lower>();
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(L);
  Z_panels_.divide(L, rows);
  Z_panels_.get(0, Z);
  if (constants() > 0) {
    D_panels_.divide(L, rows);
    D_panels_.get(0, Dt);
  }
  L.triangularView<Eigen::Lower>().solveInPlace(w);
  Z_panels_.take_square(rows, frame.S);
  frame.Vt.noalias() -= Dt * Z.transpose();
  shift_.noalias() += Z * w;
}

// Each a row without noise, after the others, where it leaves something open.
void GivenConstants::keep_equalities(Frame& frame) {
  for (Eigen::Index e = 0; e < settings_.equality.rows(); ++e) {
    const auto a = settings_.equality.row(e);
    const int row = frame.rows(), first = static_cast<int>(frame.columns.size());
    const auto c_first = c_columns_.size();
    double v = settings_.equality_value(e), open = 0.0, most = 0.0;
    for (int i = 0; i < a.size(); ++i) {
      if (a(i) == 0.0) continue;
      const int place = place_[i];
      if (place >= 0) {
        v -= a(i) * frame.before(i);  // the shift comes off in correct
        frame.columns.push_back(place);
        frame.values.push_back(a(i));
        most += a(i) * a(i) * frame.S(place, place);
      } else {
        v -= a(i) * c_now_(-1 - place);
        c_columns_.push_back(-1 - place);
        c_values_.push_back(a(i));
      }
    }
    for (std::size_t k = first; k < frame.columns.size(); ++k)
      for (std::size_t l = first; l < frame.columns.size(); ++l)
        open += frame.values[k] * frame.values[l] * frame.S(frame.columns[k], frame.columns[l]);
    if (!(open > 1e-12 * most)) {
      frame.columns.resize(first);
      frame.values.resize(first);
      c_columns_.resize(c_first);
      c_values_.resize(c_first);
      continue;
    }
    R_.col(row).setZero();
    innovation_.push_back(v);
    frame.block_first.push_back(row);
    frame.row_ends.push_back(static_cast<int>(frame.columns.size()));
    c_ends_.push_back(static_cast<int>(c_columns_.size()));
    frame.chunk_ends.push_back(row + 1);
    correct(row, row + 1, frame);
  }
}

void GivenConstants::look(const Frame& frame, Eigen::VectorXd& x) {
  const int d = moving(), c = constants();
  if (!there_) {
    auto M = M_.topLeftCorner(d, d);
    M.noalias() = Lambda_ * frame.S;
    P_ = frame.S;
    P_.noalias() -= frame.S * M;
    mirror_lower(P_);
    Yt_ = frame.Vt;
    Yt_.noalias() -= Wt_ * frame.S;
    there_ = true;
    since_ = 0;
    decayed_ = 1.0;
  }
  x(constant_) = c_;
  if (ended_) {  // to the last bit; the covariance is the last one's
    x(moving_) = frame.after(moving_);
    return;
  }
  x(moving_) = frame.mean - frame.S * lambda_;
  const auto wide = static_cast<Eigen::Index>(wide_.size());
  for (Eigen::Index k = 0; k < wide; ++k) Yw_.col(k) = Yt_.col(wide_[k]);
  Pw_.setZero(wide, wide);
  if (c > 0) Pw_.selfadjointView<Eigen::Lower>().rankUpdate(Yw_.transpose());
  mirror_lower(Pw_);
  Pwc_.resize(wide, wide_constants_);
  Pwc_.noalias() = Yw_.topRows(wide_constants_).transpose() * Ct_.topLeftCorner(wide_constants_, wide_constants_);
  for (Eigen::Index k = 0; k < wide; ++k) {
    double* const column = covariance_.col(moving_[wide_[k]]).data();
    const double* const given = P_.col(wide_[k]).data();
    for (Eigen::Index l = 0; l < wide; ++l) column[moving_[wide_[l]]] = given[wide_[l]] + Pw_(l, k);
    for (int l = 0; l < wide_constants_; ++l) column[constant_[l]] = Pwc_(k, l);
  }
  for (int l = 0; l < wide_constants_; ++l) {
    double* const column = covariance_.col(constant_[l]).data();
    for (Eigen::Index k = 0; k < wide; ++k) column[moving_[wide_[k]]] = Pwc_(k, l);
  }
  const auto factor_of = [&](int i) {  // its row of V, or of C
    return i >= 0 ? Yt_.col(i) : Ct_.col(-1 - i);
  };
  for (std::size_t m = 0; m < own_.size(); ++m)
    for (const int own : own_[m]) {
      const int i = place_[own];
      for (const int other : model_.marker_columns(static_cast<int>(m))) {
        const int j = place_[other];
        if (i < 0 && j < 0) continue;
        const int length = i < 0 ? -i : j < 0 ? -j : c;  // C' is triangular
        double value = factor_of(i).head(length).dot(factor_of(j).head(length));
        if (i >= 0 && j >= 0) value += P_(i, j);
        covariance_(own, other) = covariance_(other, own) = value;
      }
    }
}

void GivenConstants::complete() {
  if (ended_) return;
  const Eigen::MatrixXd dd = P_ + Yt_.transpose() * Yt_, dc = Yt_.transpose() * Ct_;
  covariance_(moving_, moving_) = dd;
  covariance_(moving_, constant_) = dc;
  covariance_(constant_, moving_) = dc.transpose();
}

void GivenConstants::undo(const Frame& frame, const Frame* last) {
  ended_ = false;
  const Decision& decided = *frame.decided;
  for (const auto& [column, u] : decided.pull)
    if (const int i = place_[column]; i >= 0) lambda_(i) -= u;
  if (decided.moved.size() > 0) c_ -= decided.moved(constant_);
  for (std::size_t k = frame.chunk_ends.size(); k-- > 0;)
    undo_chunk(frame, k == 0 ? 0 : frame.chunk_ends[k - 1], frame.chunk_ends[k]);
  for (const int i : decided.forgotten) {
    lambda_(i) = 0.0;
    Lambda_.row(i).setZero();
    Lambda_.col(i).setZero();
    Wt_.col(i).setZero();
  }
  // Carried on from frame to frame, P and V from all frames gather rounding that the way back from what decayed
  // enlarges; so they start anew every so often.
  constexpr int most_frames = 16;
  constexpr double least_kept = 0.3;
  double kept = 1.0;
  for (const int i : moving_) kept = std::min(kept, frame.how.kept(i));
  decayed_ *= kept;
  there_ = last && decided.forgotten.empty() && ++since_ < most_frames && decayed_ > least_kept;
  undo_transition(frame.how, there_ ? last : nullptr);
}

// lambda - H' L^-T (w + Z' lambda), Lambda - H' B' - B H with B = (Lambda Z - H' L^-T T / 2) L^-1, T = 1 + Z' Lambda Z,
// and of W' W' - (W' Z - D') L^-1 H.
void GivenConstants::undo_chunk(const Frame& frame, int from, int end) {
  const int rows = end - from, c = constants();
  const auto Z = frame.Z.middleCols(from, rows);
  const auto L = frame.L.block(0, from, rows, rows).triangularView<Eigen::Lower>();
  auto y = T_.col(0).head(rows);
  y = frame.w.segment(from, rows);
  y.noalias() += Z.transpose() * lambda_;
  frame.L.block(0, from, rows, rows).transpose().triangularView<Eigen::Upper>().solveInPlace(y);
  for (int r = 0; r < rows; ++r)
    for (int k = frame.begin(from + r); k < frame.row_ends[from + r]; ++k)
      lambda_(frame.columns[k]) -= frame.values[k] * y(r);
  // out + sign * M H by columns; those of a block's rows are the same, so that three rows go in one pass.
  const auto spread = [&](double sign, const auto& M, auto&& out) {
    for (int row = from; row < end;) {
      const int r = row - from, begin = frame.begin(row), size = frame.row_ends[row] - begin;
      const bool three = row + 2 < end && frame.block_first[row + 2] == frame.block_first[row];
      for (int k = 0; k < size; ++k) {
        const double* const h = &frame.values[begin + k];
        auto to = out.col(frame.columns[begin + k]);
        if (three)
          to += sign * h[0] * M.col(r) + sign * h[size] * M.col(r + 1) + sign * h[2 * size] * M.col(r + 2);
        else
          to += sign * h[0] * M.col(r);
      }
      row += three ? 3 : 1;
    }
  };
  auto B = G_.leftCols(rows);
  auto T = T_.topLeftCorner(rows, rows);
  B.noalias() = Lambda_ * Z;
  T.noalias() = Z.transpose() * B;
  T.diagonal().array() += 1.0;
  auto U = S_rows_.topLeftCorner(rows, rows);
  U = frame.L.block(0, from, rows, rows).transpose();
  Z_panels_.set(B);
  Z_panels_.divide_back(U, rows);
  Z_panels_.get(0, B);
  L.solveInPlace<Eigen::OnTheRight>(T);
  frame.L.block(0, from, rows, rows).transpose().triangularView<Eigen::Upper>().solveInPlace(T);
  T *= 0.5;
  auto Bt = Zt_.topRows(rows);  // T is symmetric, and columns are read faster than rows
  Bt = B.transpose();
  spread(-1.0, T, Bt);
  B = Bt.transpose();
  X_.setZero();
  spread(1.0, B, X_);
  add_both(-1.0, X_, Lambda_);
  if (c == 0) return;
  auto M = M_.topLeftCorner(c, rows);
  M = -frame.Dt.middleCols(from, rows);
  M.noalias() += Wt_ * Z;
  D_panels_.set(M);
  D_panels_.divide_back(U, rows);
  D_panels_.get(0, M);
  spread(-1.0, M, Wt_);
}

// Lambda <- F' Lambda F, W <- F' W. With the frame before also P and V from all frames: F V = V + Q W and
// F P F' = P - Q + Q Lambda Q + F S F' Lambda Q + (the same transposed).
void GivenConstants::undo_transition(const Transition& how, const Frame* last) {
  const int n = model_.n_free(), d = moving();
  const double dt = how.step;
  const auto keep = [&](auto&& column, bool back) {
    for (int i = 3 * n; i < d; ++i) back ? column(i) /= how.kept(moving_[i]) : column(i) *= how.kept(moving_[i]);
  };
  if (last) {
    const auto q = how.variance(moving_);
    // M Q by columns.
    const auto by_noise = [&](const Eigen::MatrixXd& M, Eigen::MatrixXd& out) {
      for (int i = 0; i < n; ++i) {
        out.col(i) += q(i) * M.col(i) + how.shared(i, 0) * M.col(n + i) + how.shared(i, 1) * M.col(2 * n + i);
        out.col(n + i) += how.shared(i, 0) * M.col(i) + q(n + i) * M.col(n + i) + how.shared(i, 2) * M.col(2 * n + i);
        out.col(2 * n + i) +=
            how.shared(i, 1) * M.col(i) + how.shared(i, 2) * M.col(n + i) + q(2 * n + i) * M.col(2 * n + i);
      }
      for (int i = 3 * n; i < d; ++i) out.col(i) += q(i) * M.col(i);
    };
    by_noise(Wt_, Yt_);
    by_transition_back(how, moving_, n, Yt_);
    X_.setZero();
    by_noise(Lambda_, X_);
    const Eigen::VectorXd variance = q;
    const Eigen::ArrayXd s0 = how.shared.col(0), s1 = how.shared.col(1), s2 = how.shared.col(2);
    for (int j = 0; j < d; ++j) {
      auto to = P_.col(j);
      const auto x = X_.col(j);
      to.array() += variance.array() * x.array();
      to.segment(0, n).array() += s0 * x.segment(n, n).array() + s1 * x.segment(2 * n, n).array();
      to.segment(n, n).array() += s0 * x.segment(0, n).array() + s2 * x.segment(2 * n, n).array();
      to.segment(2 * n, n).array() += s1 * x.segment(0, n).array() + s2 * x.segment(n, n).array();
      to(j) -= variance(j);
    }
    for (int i = 0; i < n; ++i) {
      P_(i, n + i) -= s0(i);
      P_(n + i, i) -= s0(i);
      P_(i, 2 * n + i) -= s1(i);
      P_(2 * n + i, i) -= s1(i);
      P_(n + i, 2 * n + i) -= s2(i);
      P_(2 * n + i, n + i) -= s2(i);
    }
    by_transition_back(how, moving_, n, P_);
    for (int j = 0; j < d; ++j) {
      auto x = P_.col(j);
      x.segment(0, n) += (0.5 * dt * dt) * x.segment(2 * n, n) - dt * x.segment(n, n);
      x.segment(n, n) -= dt * x.segment(2 * n, n);
      keep(x, true);
    }
    by_transition_back(how, moving_, n, X_);
    for (int j = 0; j < d; ++j) {
      auto x = X_.col(j);
      rows_by_transposed(dt, n, x);
      keep(x, false);
    }
    auto M = M_.topLeftCorner(d, d);
    M.noalias() = last->S * X_;
    add_both(1.0, M, P_);
  }
  rows_by_transposed(dt, n, lambda_);
  keep(lambda_, false);
  by_transposed_transition(how, moving_, n, Wt_);
  by_transposed_transition(how, moving_, n, Lambda_);
  for (int j = 0; j < d; ++j) {
    auto x = Lambda_.col(j);
    rows_by_transposed(dt, n, x);
    keep(x, false);
  }
  mirror_lower(Lambda_);
}

}  // namespace dynakin
