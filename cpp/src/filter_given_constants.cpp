#include "dynakin/filter_given_constants.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "given_transition.hpp"
#include "mirror.hpp"

namespace dynakin {

FilterGivenConstants::FilterGivenConstants(const Model& model, const FilterSettings& settings,
                                           const GivenConstants& apart, int max_rows)
    : model_(model), settings_(settings), apart_(apart), how_(model) {
  const int d = apart.d(), c = apart.c(), chunk = chunk_rows(max_rows);
  c_ = c_now_ = Eigen::VectorXd::Zero(c);
  Ct_.setZero(c, c);
  S_.setZero(d, d);
  Vt_.setZero(c, d);
  shift_ = Eigen::VectorXd::Zero(d);
  R_.setZero(6, max_rows);
  Zt_.setZero(chunk, d);
  Z_panels_ = Panels(d, chunk);
  D_panels_ = Panels(c, chunk);
  S_rows_.setZero(Z_panels_.max_columns(), chunk);
}

void FilterGivenConstants::end(const Belief& last) {
  c_ = last.x(apart_.constant);
  Eigen::MatrixXd C = last.P(apart_.constant, apart_.constant);
  factor_covariance(C);
  Ct_ = C.transpose();
}

void FilterGivenConstants::start(const Belief& before, const Eigen::VectorXd& moved) {
  c_ -= moved(apart_.constant);
  c_now_ = c_;
  Eigen::MatrixXd L = before.P(apart_.constant, apart_.constant);
  Vt_ = before.P(apart_.constant, apart_.moving);
  // Combinations that an equality has made sure have rounding for a variance; with some of their own they say nothing.
  for (Eigen::Index e = 0; e < settings_.equality.rows(); ++e) {
    if (!settings_.equality.row(e)(apart_.moving).isZero(0.0)) continue;
    const Eigen::VectorXd a = settings_.equality.row(e)(apart_.constant).transpose();
    const double most = (a.array().square() * L.diagonal().array()).sum();
    if (a.dot(L * a) > 1e-9 * most) continue;  // not yet
    L += (most > 0.0 ? most : 1.0) / (a.squaredNorm() * a.squaredNorm()) * a * a.transpose();
  }
  factor_covariance(L);
  for (int k = 0; k < apart_.c(); ++k)
    if (L(k, k) == 0.0) {  // no variance is left: d does not hang on it
      L(k, k) = 1.0;
      Vt_.row(k).setZero();
    }
  S_ = before.P(apart_.moving, apart_.moving);
  shift_.setZero();
  if (apart_.c() == 0) return;
  L.triangularView<Eigen::Lower>().solveInPlace(Vt_);
  S_.selfadjointView<Eigen::Lower>().rankUpdate(Vt_.transpose(), -1.0);
  mirror_lower(S_);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(Vt_);
  shift_.noalias() = Vt_.transpose() * (c_now_ - before.x(apart_.constant));
  Vt_ = (Ct_.triangularView<Eigen::Upper>() * Vt_).eval();
}

void FilterGivenConstants::step(const std::vector<RowBlock>& blocks, const Frame* last, Frame& frame) {
  const Decision& decided = *frame.decided;
  if (last) shift_ = last->mean - last->after(apart_.moving);
  predict(last ? last->S : S_, last ? last->Vt : Vt_, frame);
  gather(blocks, frame);
  int from = 0;
  for (const int end : frame.chunk_ends) {
    correct(from, end, frame);
    from = end;
  }
  keep_equalities(frame);
  for (const auto& [column, u] : decided.pull)
    if (const int i = apart_.place[column]; i >= 0) shift_ += u * frame.S.col(i);
  if (decided.moved.size() > 0) {
    shift_ += decided.moved(apart_.moving);
    c_now_ += decided.moved(apart_.constant);
  }
  frame.constants = c_now_;
  frame.mean = frame.before(apart_.moving) + shift_;
}

void FilterGivenConstants::predict(const Eigen::MatrixXd& S, const Eigen::MatrixXd& Vt, Frame& frame) {
  const Decision& decided = *frame.decided;
  const int n = model_.n_free(), d = apart_.d();
  if (frame.first)
    how_ = Transition(model_);
  else
    transition(model_, settings_, decided.carried, frame.dt, how_);
  frame.how.step = how_.step;
  frame.how.kept = how_.kept(apart_.moving);
  frame.how.variance = how_.variance(apart_.moving);
  frame.how.shared = how_.shared;
  frame.S = S;
  by_transition(frame.how, frame.S);
  for (int j = 0; j < d; ++j) transition_of(frame.how, frame.S.col(j));
  mirror_lower(frame.S);
  frame.Vt = Vt;
  by_transition(frame.how, frame.Vt);
  transition_of(frame.how, shift_);
  const auto add_noise = [&](const Transition& noise) {
    for (int i = 0; i < d; ++i) frame.S(i, i) += noise.variance(apart_.moving[i]);
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
  add_noise(how_);
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
    frame.how.variance += noise.variance(apart_.moving);
    frame.how.shared += noise.shared;
  }
}

// Rows that nothing moving has a part in add nothing to what the constants hold already.
void FilterGivenConstants::gather(const std::vector<RowBlock>& blocks, Frame& frame) {
  for (auto* of : {&frame.row_ends, &frame.columns, &frame.chunk_ends, &frame.block_first, &c_ends_, &c_columns_})
    of->clear();
  for (auto* of : {&frame.values, &c_values_, &innovation_}) of->clear();
  const bool elsewhere = frame.decided->linearised.size() > 0;
  int chunk_first = 0;
  for (const RowBlock& block : blocks) {
    const std::vector<int>& columns = *block.columns;
    if (block.rows == 0 || std::none_of(columns.begin(), columns.end(), [&](int c) { return apart_.place[c] >= 0; }))
      continue;
    const int first = frame.rows();
    if (first > chunk_first && first + block.rows - chunk_first > Zt_.rows()) {
      frame.chunk_ends.push_back(first);
      chunk_first = first;
    }
    for (int r = 0; r < block.rows; ++r) {
      double v = block.v(r);
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const double h = block.H(r, k);
        const int column = columns[k], place = apart_.place[column];
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
    frame.Z.resize(apart_.d(), most);
    frame.Dt.resize(apart_.c(), most);
    frame.L.resize(S_rows_.rows(), most);
    frame.w.resize(most);
  }
}

void FilterGivenConstants::correct(int from, int end, Frame& frame) {
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
  if (apart_.c() > 0) {
    D_panels_.divide(L, rows);
    D_panels_.get(0, Dt);
  }
  L.triangularView<Eigen::Lower>().solveInPlace(w);
  Z_panels_.take_square(rows, frame.S);
  frame.Vt.noalias() -= Dt * Z.transpose();
  shift_.noalias() += Z * w;
}

// Each a row without noise, after the others, where it leaves something open.
void FilterGivenConstants::keep_equalities(Frame& frame) {
  for (Eigen::Index e = 0; e < settings_.equality.rows(); ++e) {
    const auto a = settings_.equality.row(e);
    const int row = frame.rows(), first = static_cast<int>(frame.columns.size());
    const auto c_first = c_columns_.size();
    double v = settings_.equality_value(e), open = 0.0, most = 0.0;
    for (int i = 0; i < a.size(); ++i) {
      if (a(i) == 0.0) continue;
      const int place = apart_.place[i];
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

}  // namespace dynakin
