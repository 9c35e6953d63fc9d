#include "dynakin/dynamics.hpp"

namespace dynakin {
namespace {

SpatialInertia to_ground(const InertiaVector& phi, const SegmentState& s) {
  Matrix3 I_B;
  I_B << phi(k_ixx), phi(k_ixy), phi(k_ixz), phi(k_ixy), phi(k_iyy), phi(k_iyz), phi(k_ixz), phi(k_iyz), phi(k_izz);
  const double m = phi(k_mass);
  const Vector3 h = s.R_GB * phi.segment<3>(k_mx);  // about the segment origin, ground axes
  const Vector3& o = s.p_GB;
  SpatialInertia out;
  out.mass = m;
  out.first_moment = m * o + h;
  out.inertia = s.R_GB * I_B * s.R_GB.transpose() + (m * o.dot(o) + 2.0 * o.dot(h)) * Matrix3::Identity() -
                m * o * o.transpose() - o * h.transpose() - h * o.transpose();
  return out;
}

}  // namespace

InertiaVector inertia_of(const Segment& segment, const StateRef& x) {
  InertiaVector phi = segment.inertia;
  for (int k = 0; k < k_inertia_count; ++k)
    if (segment.inertia_column[k] != k_none) phi(k) = x(segment.inertia_column[k]);
  return phi;
}

Force by_position(const SubtreeState& t, const Motion& S, const Motion& Sd, const Motion& Sdd) {
  return cross_dual(S, t.force) + t.inertia * Sdd + t.response * Sd;
}

// f = Y(v, a) phi.
void inertia_columns(const Segment& segment, const SegmentState& s,
                     Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> out) {
  const Vector3& w = s.velocity.ang;
  const Vector3& al = s.acceleration.ang;
  const Vector3& o = s.p_GB;
  const Vector3 a_o = s.acceleration.lin + w.cross(s.velocity.lin) + al.cross(o) + w.cross(w.cross(o));
  const auto& column = segment.inertia_column;
  if (column[k_mass] != k_none) out.col(column[k_mass]) = Force{a_o, o.cross(a_o)}.vector();
  for (int k = 0; k < 3; ++k) {
    if (column[k_mx + k] == k_none) continue;
    const Vector3 e = s.R_GB.col(k);
    const Vector3 f = al.cross(e) + w.cross(w.cross(e));
    out.col(column[k_mx + k]) = Force{f, o.cross(f) + e.cross(a_o)}.vector();
  }
  static constexpr int row[6] = {0, 1, 2, 0, 0, 1}, col[6] = {0, 1, 2, 1, 2, 2};
  const Vector3 w_B = s.R_GB.transpose() * w;
  const Vector3 al_B = s.R_GB.transpose() * al;
  for (int k = 0; k < 6; ++k) {
    if (column[k_ixx + k] == k_none) continue;
    const auto times = [&](const Vector3& v) {  // unit tensor of this entry times v
      Vector3 r = Vector3::Zero();
      r(row[k]) = v(col[k]);
      if (row[k] != col[k]) r(col[k]) = v(row[k]);
      return r;
    };
    out.col(column[k_ixx + k]) = Force{Vector3::Zero(), s.R_GB * (times(al_B) + w_B.cross(times(w_B)))}.vector();
  }
}

void subtree_dynamics(const Model& model, const StateRef& x, const KinematicState& state, DynamicState& out) {
  const int n = static_cast<int>(model.segments().size());
  out.wrench = Force{};
  out.mass = 0.0;
  for (int i = 0; i < n; ++i) {
    const SegmentState& s = state.segments[i];
    SubtreeState& t = out.subtrees[i];
    t.inertia = to_ground(inertia_of(model.segments()[i], x), s);
    t.response = VelocityResponse(t.inertia, s.velocity);
    t.force = t.inertia * s.acceleration + cross_dual(s.velocity, t.inertia * s.velocity);
  }
  for (int i = n - 1; i >= 0; --i) {
    const SubtreeState& t = out.subtrees[i];
    const int parent = model.segments()[i].parent;
    if (parent == k_none) {
      out.wrench += t.force;
      out.mass += t.inertia.mass;
      continue;
    }
    SubtreeState& p = out.subtrees[parent];
    p.force += t.force;
    p.inertia += t.inertia;
    p.response += t.response;
  }
}

void subtree_external(const Model& model, const std::vector<Force>* external, std::vector<Force>& out) {
  const int n = static_cast<int>(model.segments().size());
  for (int i = 0; i < n; ++i) out[i] = external ? (*external)[i] : Force{};
  if (!external) return;
  for (int i = n - 1; i >= 0; --i)
    if (const int parent = model.segments()[i].parent; parent != k_none) out[parent] += out[i];
}

void joint_moments(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                   const std::vector<Force>* external, Eigen::Ref<Eigen::VectorXd> out) {
  out.setZero();
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    const Segment& segment = model.segments()[i];
    for (int a = segment.first_axis; a < segment.end_axis; ++a)
      out(model.axes()[a].coordinate) +=
          state.axes[a].motion.ds_dq * dot(state.axes[a].screw, dynamics.subtrees[i].force);
  }
  if (!external) return;
  for (std::size_t i = 0; i < model.segments().size(); ++i)
    for (int j = static_cast<int>(i); j != k_none; j = model.segments()[j].parent)
      for (int a = model.segments()[j].first_axis; a < model.segments()[j].end_axis; ++a)
        out(model.axes()[a].coordinate) -= state.axes[a].motion.ds_dq * dot(state.axes[a].screw, (*external)[i]);
}

void wrench_jacobian(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                     Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> out) {
  for (int c : model.wrench_columns()) out.col(c).setZero();
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    const Segment& segment = model.segments()[i];
    const SubtreeState& t = dynamics.subtrees[i];
    for (int a = segment.first_axis; a < segment.end_axis; ++a) {
      const Axis& axis = model.axes()[a];
      const AxisState& s = state.axes[a];
      const AxisMotion& f = s.motion;
      const Vector6 d_s = by_position(t, s.screw, s.screw_rate, s.screw_second).vector();
      const Vector6 d_sd = (t.inertia * (s.screw_rate * 2.0) + t.response * s.screw).vector();
      const Vector6 d_sdd = (t.inertia * s.screw).vector();
      if (const int c = model.coordinate_column(axis.coordinate); c != k_none) {
        out.col(c) += d_s * f.ds_dq + d_sd * f.dsd_dq + d_sdd * f.dsdd_dq;
        out.col(model.speed_column(axis.coordinate)) += d_sd * f.ds_dq + d_sdd * f.dsdd_dqd;
        out.col(model.acceleration_column(axis.coordinate)) += d_sdd * f.ds_dq;
      }
      if (const int scale = axis.function.scale_parameter(); scale != k_none)
        if (const int c = model.parameters()[scale].column; c != k_none)
          out.col(c) += d_s * f.ds_dL + d_sd * f.dsd_dL + d_sdd * f.dsdd_dL;
    }
    for (std::size_t k = 0; k < segment.lengths.size(); ++k) {
      const int c = model.parameters()[segment.lengths[k].parameter].column;
      if (c == k_none) continue;
      const PlacementState& p = state.placements[i][k];
      out.col(c) += by_position(t, p.screw, p.screw_rate, p.screw_second).vector();
    }
    inertia_columns(segment, state.segments[i], out);
  }
}

MassCentre mass_centre(const Model& model, const DynamicState& dynamics) {
  MassCentre out;
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    if (model.segments()[i].parent != k_none) continue;
    out.position += dynamics.subtrees[i].inertia.first_moment;
    out.velocity += dynamics.subtrees[i].response.momentum;
  }
  out.position /= dynamics.mass;
  out.velocity /= dynamics.mass;
  return out;
}

void joint_loads(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                 const std::vector<Force>* external, std::vector<Force>& out) {
  subtree_external(model, external, out);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Force load = dynamics.subtrees[i].force - out[i];
    out[i] = {load.lin, load.ang - state.segments[i].p_GB.cross(load.lin)};
  }
}

}  // namespace dynakin
