#include "dynakin/kinematics.hpp"

namespace dynakin {

KinematicState::KinematicState(const Model& model)
    : axes(model.axes().size()), segments(model.segments().size()), markers(model.markers().size()) {
  for (const Segment& s : model.segments()) placements.emplace_back(s.lengths.size());
}

CoordinateValue coordinate_value(const Model& model, const StateRef& x, int coordinate) {
  const Coordinate& c = model.coordinates()[coordinate];
  if (c.index == k_none) return {c.value, 0.0, 0.0};
  const int n = model.n_free();
  return {x(c.index), x(c.index + n), x(c.index + 2 * n)};
}

double parameter_value(const Model& model, const StateRef& x, int parameter) {
  const Parameter& p = model.parameters()[parameter];
  return p.column == k_none ? p.value : x(p.column);
}

void forward_kinematics(const Model& model, const StateRef& x, KinematicState& out) {
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    const Segment& segment = model.segments()[i];
    SegmentState frame;
    if (segment.parent == k_none) {
      frame.R_GB.setIdentity();
      frame.p_GB.setZero();
      frame.acceleration.lin = -model.spec().gravity;
    } else {
      frame = out.segments[segment.parent];
    }

    Vector3 p_PJ = segment.translation;
    for (std::size_t k = 0; k < segment.lengths.size(); ++k) {
      const Placement& term = segment.lengths[k];
      p_PJ += parameter_value(model, x, term.parameter) * term.direction;
      PlacementState& placement = out.placements[i][k];
      placement.screw = {frame.R_GB * term.direction, Vector3::Zero()};
      placement.screw_rate = frame.velocity.cross(placement.screw);
      placement.screw_second = frame.acceleration.cross(placement.screw) + frame.velocity.cross(placement.screw_rate);
    }
    frame.p_GB += frame.R_GB * p_PJ;
    frame.R_GB = frame.R_GB * segment.rotation;

    for (int a = segment.first_axis; a < segment.end_axis; ++a) {
      const Axis& axis = model.axes()[a];
      AxisState& state = out.axes[a];
      const auto [q, qd, qdd] = coordinate_value(model, x, axis.coordinate);
      const int scale = axis.function.scale_parameter();
      state.motion = axis.function.evaluate(q, qd, qdd, scale == k_none ? 1.0 : parameter_value(model, x, scale));
      const Vector3 direction = frame.R_GB * axis.direction;
      if (axis.kind == AxisKind::rotation) {
        state.screw = {frame.p_GB.cross(direction), direction};
        frame.R_GB = frame.R_GB * Eigen::AngleAxisd(state.motion.s, axis.direction).toRotationMatrix();
      } else {
        state.screw = {direction, Vector3::Zero()};
        frame.p_GB += direction * state.motion.s;
      }
      state.screw_rate = frame.velocity.cross(state.screw);
      frame.velocity += state.screw * state.motion.sd;
      frame.acceleration += state.screw * state.motion.sdd + state.screw_rate * state.motion.sd;
      state.screw_second = frame.acceleration.cross(state.screw) + frame.velocity.cross(state.screw_rate);
    }
    out.segments[i] = frame;
  }

  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    const Marker& marker = model.markers()[m];
    Vector3 p = marker.position;
    for (int k = 0; k < 3; ++k) {
      if (marker.column[k] != k_none) p(k) = x(marker.column[k]);
      if (marker.soft_tissue[k] != k_none) p(k) += x(marker.soft_tissue[k]);
    }
    const SegmentState& segment = out.segments[marker.segment];
    out.markers[m] = segment.p_GB + segment.R_GB * p;
  }
}

void marker_jacobian(const Model& model, const KinematicState& state, int marker, const std::vector<int>& column_slot,
                     Eigen::Ref<Eigen::Matrix<double, 3, Eigen::Dynamic>> out) {
  out.setZero();
  const Marker& site = model.markers()[marker];
  const Vector3& p_GM = state.markers[marker];
  for (int i = site.segment; i != k_none; i = model.segments()[i].parent) {
    const Segment& segment = model.segments()[i];
    for (int a = segment.first_axis; a < segment.end_axis; ++a) {
      const Axis& axis = model.axes()[a];
      const AxisState& s = state.axes[a];
      const Vector3 velocity = s.screw.at(p_GM);
      if (const int c = model.coordinate_column(axis.coordinate); c != k_none)
        out.col(column_slot[c]) += velocity * s.motion.ds_dq;
      if (const int scale = axis.function.scale_parameter(); scale != k_none)
        if (const int c = model.parameters()[scale].column; c != k_none)
          out.col(column_slot[c]) += velocity * s.motion.ds_dL;
    }
    for (std::size_t k = 0; k < segment.lengths.size(); ++k)
      if (const int c = model.parameters()[segment.lengths[k].parameter].column; c != k_none)
        out.col(column_slot[c]) += state.placements[i][k].screw.lin;
  }
  for (int k = 0; k < 3; ++k)
    for (const int c : {site.column[k], site.soft_tissue[k]})
      if (c != k_none) out.col(column_slot[c]) += state.segments[site.segment].R_GB.col(k);
}

std::vector<std::vector<int>> marker_column_slots(const Model& model) {
  std::vector<std::vector<int>> slots;
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    const auto& columns = model.marker_columns(static_cast<int>(m));
    slots.emplace_back(model.state_size(), k_none);
    for (std::size_t k = 0; k < columns.size(); ++k) slots.back()[columns[k]] = static_cast<int>(k);
  }
  return slots;
}

}  // namespace dynakin
