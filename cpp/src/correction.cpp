#include "dynakin/correction.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {

Correction::Correction(const Model& of, const FilterSettings& with)
    : model(of),
      settings(with),
      measurement(of, with),
      gate(of),
      dx(Eigen::VectorXd::Zero(of.state_size())),
      scratch(dx),
      update_(of.state_size(), measurement.max_rows()) {}

void Correction::measure(const MarkerRef& markers, const Vector6& wrench) {
  measurement.admit_all();
  measurement.linearise(now.x, markers, wrench);
  gate.judge(settings, measurement.blocks(), now.P);
}

void Correction::leave_out_refused() {
  const auto& verdicts = gate.verdicts();
  for (std::size_t sensor = 0; sensor < verdicts.size(); ++sensor)
    if (verdicts[sensor] == Verdict::refused) measurement.leave_out(static_cast<int>(sensor));
  if (settings.wrench_needs_markers && gate.markers_refused() == gate.markers_measured())
    measurement.leave_out(static_cast<int>(verdicts.size()) - 1);
}

// Largest standard deviation of the coordinates that move a marker of this frame: of others it shows nothing, however
// often it is linearised.
double Correction::uncertainty_seen() const {
  double most = 0.0;
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    const RowBlock& block = measurement.blocks()[m];
    if (block.rows == 0) continue;
    for (const int c : *block.columns)
      if (c < model.n_free()) most = std::max(most, now.P(c, c));
  }
  return std::sqrt(most);
}

void Correction::correct(const MarkerRef& markers, const Vector6& wrench) {
  constexpr int most_iterations = 8;
  if (uncertainty_seen() > settings.iterate_beyond) return iterate(markers, wrench, most_iterations);
  leave_out_refused();
  sums = update_.apply(measurement.blocks(), now.P, dx);
  note_linearised();
}

void Correction::note_linearised() {
  if (tape && tape->records_update()) tape->linearised = now.x;
}

void Correction::iterate(const MarkerRef& markers, const Vector6& wrench, int most) {
  constexpr double settled = 1e-3;  // rad or m: a tangent is off by about half the square of its step
  before = now;
  for (int k = 0;; ++k) {
    leave_out_refused();
    if (k > 0) measurement.shift_innovations(dx);
    scratch = dx;
    const UpdateSums step = update_.apply(measurement.blocks(), now.P, dx);
    if (k == 0) {
      sums = step;
      scratch.setZero();
    }
    scratch -= dx;
    sums.factored = step.factored;
    if (!step.factored || k + 1 == most || scratch.head(model.n_free()).lpNorm<Eigen::Infinity>() < settled) break;
    now.x = before.x + dx;
    now.P = before.P;
    measurement.linearise(now.x, markers, wrench);
  }
  note_linearised();
  now.x = before.x;
}

void Correction::record_to(FrameTape* to) {
  tape = to;
  update_.record_to(to);
}

}  // namespace dynakin
