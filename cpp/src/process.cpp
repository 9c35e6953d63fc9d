#include "dynakin/process.hpp"

#include <cmath>

namespace dynakin {
namespace {

// What does not move is known ever better along some directions and no better along others, until the covariance is
// singular to rounding (7e-16 is the correlation's smallest eigenvalue after 2 10^5 steps of preset paper). This much
// more variance a step, 3e-8 in 10^6 of them, keeps it at 1e-10 (BENCHMARKS.md, A session that never ends).
constexpr double k_stirred = 1.0 + 0x1p-45;

// Noise of density w[0] on the rate of q, w[1] on that of qd, w[2] (the jerk) on that of qdd, integrated over dt.
struct ChainNoise {
  ChainNoise(const Eigen::VectorXd& density, int n, int i, double dt, double times) {
    const double d2 = dt * dt, d3 = d2 * dt;
    const double w0 = times * density(i), w1 = times * density(n + i), w2 = times * density(2 * n + i);
    q = w0 * dt + w1 * d3 / 3.0 + w2 * d3 * d2 / 20.0;
    qd = w1 * dt + w2 * d3 / 3.0;
    qdd = w2 * dt;
    q_qd = w1 * d2 / 2.0 + w2 * d2 * d2 / 8.0;
    q_qdd = w2 * d3 / 6.0;
    qd_qdd = w2 * d2 / 2.0;
  }
  double q, qd, qdd, q_qd, q_qdd, qd_qdd;
};

void add_chain_noise(const Eigen::VectorXd& density, int n, double dt, Eigen::MatrixXd& P, double times = 1.0) {
  for (int i = 0; i < n; ++i) {
    const ChainNoise w(density, n, i, dt, times);
    P(i, i) += w.q;
    P(n + i, n + i) += w.qd;
    P(2 * n + i, 2 * n + i) += w.qdd;
    P(n + i, i) += w.q_qd;
    P(i, n + i) += w.q_qd;
    P(2 * n + i, i) += w.q_qdd;
    P(i, 2 * n + i) += w.q_qdd;
    P(2 * n + i, n + i) += w.qd_qdd;
    P(n + i, 2 * n + i) += w.qd_qdd;
  }
}

// Variance that white noise of this density leaves after dt on a state that decays at this rate.
double decayed_noise(double density, double rate, double dt) {
  return rate == 0.0 ? density * dt : -density * std::expm1(-2.0 * rate * dt) / (2.0 * rate);
}

// The coordinates and speeds of x; what decays is not moved.
void move_chain(int n, double dt, Eigen::VectorXd& x) {
  x.segment(0, n) += dt * x.segment(n, n) + 0.5 * dt * dt * x.segment(2 * n, n);
  x.segment(n, n) += dt * x.segment(2 * n, n);
}

// Scales what decays, in mean and covariance; the corner of P above the diagonal is left to the caller.
void scale_decaying(const FilterSettings& settings, int first, double dt, Eigen::VectorXd& scratch, Eigen::VectorXd& x,
                    Eigen::MatrixXd& P) {
  const int size = static_cast<int>(x.size()), rest = size - first;
  if (!settings.decay_rate.tail(rest).any()) return;
  auto kept = scratch.tail(rest);
  for (int i = 0; i < rest; ++i) {
    const double rate = settings.decay_rate(first + i);
    kept(i) = rate == 0.0 ? 1.0 : std::exp(-rate * dt);
  }
  x.tail(rest).array() *= kept.array();
  const auto decays = [&](int i) { return i >= first && settings.decay_rate(i) != 0.0; };
  for (int i = first, end; i < size; i = end) {  // of columns that do not decay only the rows that do
    for (end = i + 1; end < size && decays(end) == decays(i);) ++end;
    if (!decays(i)) continue;
    const auto rows = kept.segment(i - first, end - i).array();
    for (int c = 0; c < size; ++c)
      if (!decays(c)) P.col(c).segment(i, end - i).array() *= rows;
  }
  for (int c = first; c < size; ++c)
    if (decays(c)) P.col(c).tail(rest).array() *= kept.array() * kept(c - first);
}

}  // namespace

void predict_mean(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& x) {
  const int n = model.n_free();
  move_chain(n, dt, x);
  for (int i = 3 * n; i < model.state_size(); ++i)
    if (settings.decay_rate(i) != 0.0) x(i) *= std::exp(-settings.decay_rate(i) * dt);
}

void predict(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& scratch,
             Eigen::VectorXd& x, Eigen::MatrixXd& P) {
  const int n = model.n_free(), size = model.state_size();
  const int rest = size - 3 * n;
  const double half = 0.5 * dt * dt;

  move_chain(n, dt, x);

  // P F', then F (P F') on the 3n rows that it changes; the lower triangle is the truth, mirrored.
  P.middleCols(0, n) += dt * P.middleCols(n, n) + half * P.middleCols(2 * n, n);
  P.middleCols(n, n) += dt * P.middleCols(2 * n, n);
  auto top = P.topLeftCorner(3 * n, 3 * n);
  top.middleRows(0, n) += dt * top.middleRows(n, n) + half * top.middleRows(2 * n, n);
  top.middleRows(n, n) += dt * top.middleRows(2 * n, n);
  for (int j = 1; j < 3 * n; ++j) top.col(j).head(j) = top.row(j).head(j).transpose();
  scale_decaying(settings, 3 * n, dt, scratch, x, P);
  P.topRightCorner(3 * n, rest) = P.bottomLeftCorner(rest, 3 * n).transpose();
  P.diagonal() += settings.process_variance;
  P.diagonal().tail(rest) *= k_stirred;
  add_chain_noise(settings.process_density, n, dt, P);
  for (int i = 3 * n; i < size; ++i)
    if (settings.process_density(i) > 0.0)
      P(i, i) += decayed_noise(settings.process_density(i), settings.decay_rate(i), dt);
}

Transition::Transition(const Model& model)
    : kept(Eigen::VectorXd::Ones(model.state_size())), variance(Eigen::VectorXd::Zero(model.state_size())) {
  shared.setZero(model.n_free(), 3);
}

void transition(const Model& model, const FilterSettings& settings, double carried, double dt, Transition& out) {
  const bool predicts = carried == dt || carried > 0.0;
  const double rest = dt - carried;
  out.step = carried;
  out.kept.setOnes();
  out.variance.setZero();
  out.shared.setZero();
  if (predicts) {
    out.variance = settings.process_variance;
    stir(model, settings, 1.0, carried, out);
  }
  for (int i = 3 * model.n_free(); i < model.state_size(); ++i) {
    const double rate = settings.decay_rate(i), density = settings.process_density(i);
    double& variance = out.variance(i);
    if (predicts && density > 0.0) variance += decayed_noise(density, rate, carried);
    if (rate == 0.0) continue;
    out.kept(i) = std::exp(-rate * carried);
    if (!(rest > 0.0)) continue;
    const double kept = std::exp(-rate * rest);
    out.kept(i) *= kept;
    variance = variance * kept * kept + decayed_noise(density, rate, rest);
  }
}

void stir(const Model& model, const FilterSettings& settings, double times, double dt, Transition& out) {
  const int n = model.n_free();
  for (int i = 0; i < n; ++i) {
    const ChainNoise w(settings.process_density, n, i, dt, times);
    out.variance(i) += w.q;
    out.variance(n + i) += w.qd;
    out.variance(2 * n + i) += w.qdd;
    out.shared.row(i) += Eigen::RowVector3d(w.q_qd, w.q_qdd, w.qd_qdd);
  }
}

void stir(const Model& model, const FilterSettings& settings, double times, double dt, Eigen::MatrixXd& P) {
  add_chain_noise(settings.process_density, model.n_free(), dt, P, times);
}

void decay(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& scratch, Eigen::VectorXd& x,
           Eigen::MatrixXd& P) {
  const int first = 3 * model.n_free(), size = model.state_size();
  scale_decaying(settings, first, dt, scratch, x, P);
  P.topRightCorner(first, size - first) = P.bottomLeftCorner(size - first, first).transpose();
  for (int i = first; i < size; ++i)
    if (settings.decay_rate(i) != 0.0)
      P(i, i) += decayed_noise(settings.process_density(i), settings.decay_rate(i), dt);
}

void transpose_transition(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& x) {
  const int n = model.n_free();
  x.segment(2 * n, n) += dt * x.segment(n, n) + 0.5 * dt * dt * x.segment(0, n);
  x.segment(n, n) += dt * x.segment(0, n);
  for (int i = 3 * n; i < model.state_size(); ++i)
    if (settings.decay_rate(i) != 0.0) x(i) *= std::exp(-settings.decay_rate(i) * dt);
}

}  // namespace dynakin
