#include "dynakin/moment_derivatives.hpp"

namespace dynakin {
namespace {

using Variation = MomentWorkspace::Variation;
using Row = MomentWorkspace::Row;
using MomentMatrix = Eigen::Ref<Eigen::MatrixXd>;

// B' m = (0; result): B answers to angular motion only.
Vector3 times_transposed(const VelocityResponse& B, const Motion& m) {
  return 2.0 * B.momentum.cross(m.lin) + B.angular.transpose() * m.ang;
}

void vary(int column, const SubtreeState& t, const Motion& screw, const Motion& rate, const Motion& second,
          std::vector<Variation>& out) {
  out.push_back({column, screw, rate, second, by_position(t, screw, rate, second)});
}

// s, sd and sdd of an axis as its coordinate, speed, acceleration and scale change them.
void vary_axis(const Model& model, const SubtreeState& t, const Axis& axis, const AxisState& state,
               std::vector<Variation>& out) {
  const Motion &S = state.screw, &Sd = state.screw_rate, &Sdd = state.screw_second;
  const AxisMotion& f = state.motion;
  const auto add = [&](int column, double d_s, double d_sd, double d_sdd) {
    vary(column, t, S * d_s, Sd * d_s + S * d_sd, Sdd * d_s + Sd * (2.0 * d_sd) + S * d_sdd, out);
  };
  if (const int c = model.coordinate_column(axis.coordinate); c != k_none) {
    add(c, f.ds_dq, f.dsd_dq, f.dsdd_dq);
    add(model.speed_column(axis.coordinate), 0.0, f.ds_dq, f.dsdd_dqd);
    add(model.acceleration_column(axis.coordinate), 0.0, 0.0, f.ds_dq);
  }
  if (const int scale = axis.function.scale_parameter(); scale != k_none)
    if (const int c = model.parameters()[scale].column; c != k_none) add(c, f.ds_dL, f.dsd_dL, f.dsdd_dL);
}

Row row_of(const Axis& axis, const AxisState& state, const SubtreeState& t, const Force& external, int end_before) {
  const Motion S = state.screw * state.motion.ds_dq;
  return {axis.coordinate,
          end_before,
          S,
          t.inertia * S,
          times_transposed(t.response, S),
          Force{} - cross_dual(S, external)};
}

// A moment S' F along s is worth ds/dq along q, a slope that changes with q and the scale.
void add_slope_change(const Model& model, const StateRef& x, const Axis& axis, double moment, MomentMatrix out) {
  const int scale = axis.function.scale_parameter();
  const double L = scale == k_none ? 1.0 : parameter_value(model, x, scale);
  const double q = coordinate_value(model, x, axis.coordinate).q;
  const AxisMotion slope = axis.function.evaluate(q, 1.0, 0.0, L);  // at a speed of 1 the rate is the slope
  if (const int c = model.coordinate_column(axis.coordinate); c != k_none)
    out(axis.coordinate, c) += slope.dsd_dq * moment;
  if (scale != k_none)
    if (const int c = model.parameters()[scale].column; c != k_none) out(axis.coordinate, c) += slope.dsd_dL * moment;
}

// The variation moves the axis and all that is behind it: S and the force are carried along together, which leaves
// their product as it was; an external wrench is not carried along.
void add_moving(const Row& row, const Variation& v, MomentMatrix out) {
  out(row.coordinate, v.column) +=
      dot(v.second, row.inertial) + v.rate.ang.dot(row.response) + dot(v.screw, row.external);
}

// The variation is behind the axis, which stays.
void add_behind(const Row& row, const Variation& v, MomentMatrix out) {
  out(row.coordinate, v.column) += dot(row.screw, v.force);
}

// Variations and rows of all segments, each once; what the changing slopes add goes to out already.
void prepare(const Model& model, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
             MomentWorkspace& work, MomentMatrix out) {
  auto& variations = work.variations;
  variations.clear();
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    const Segment& segment = model.segments()[i];
    const SubtreeState& t = dynamics.subtrees[i];
    for (std::size_t k = 0; k < segment.lengths.size(); ++k)
      if (const int c = model.parameters()[segment.lengths[k].parameter].column; c != k_none) {
        const PlacementState& p = state.placements[i][k];
        vary(c, t, p.screw, p.screw_rate, p.screw_second, variations);
      }
    for (int a = segment.first_axis; a < segment.end_axis; ++a) {
      const Axis& axis = model.axes()[a];
      vary_axis(model, t, axis, state.axes[a], variations);
      work.rows[a] = row_of(axis, state.axes[a], t, work.external[i], static_cast<int>(variations.size()));
      add_slope_change(model, x, axis, dot(state.axes[a].screw, t.force - work.external[i]), out);
    }
    work.first_variation[i + 1] = static_cast<int>(variations.size());
    inertia_columns(segment, state.segments[i], work.inertia);
  }
}

}  // namespace

MomentWorkspace::MomentWorkspace(const Model& model)
    : first_variation(model.segments().size() + 1, 0),
      rows(model.axes().size()),
      external(model.segments().size()),
      inertia(6, model.state_size()) {
  std::size_t most = 4 * model.axes().size();
  for (const Segment& segment : model.segments()) most += segment.lengths.size();
  variations.reserve(most);
}

void moment_jacobian(const Model& model, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                     const std::vector<Force>* external, MomentWorkspace& work, MomentMatrix out) {
  out.setZero();
  subtree_external(model, external, work.external);
  prepare(model, x, state, dynamics, work, out);
  const auto& variations = work.variations;
  // Each segment k with those it hangs on: other branches do not feel each other.
  for (int k = 0; k < static_cast<int>(model.segments().size()); ++k)
    for (int i = k; i != k_none; i = model.segments()[i].parent) {
      const Segment &behind = model.segments()[k], &before = model.segments()[i];
      for (int a = before.first_axis; a < before.end_axis; ++a) {
        const Row& row = work.rows[a];
        const int from = i == k ? row.end_before : work.first_variation[k];
        for (int v = from; v < work.first_variation[k + 1]; ++v) add_behind(row, variations[v], out);
        for (const int c : behind.inertia_column)
          if (c != k_none)
            out(row.coordinate, c) +=
                row.screw.lin.dot(work.inertia.col(c).head<3>()) + row.screw.ang.dot(work.inertia.col(c).tail<3>());
      }
      for (int a = behind.first_axis; a < behind.end_axis; ++a) {
        const Row& row = work.rows[a];
        const int end = i == k ? row.end_before : work.first_variation[i + 1];
        for (int v = work.first_variation[i]; v < end; ++v) add_moving(row, variations[v], out);
      }
    }
}

}  // namespace dynakin
