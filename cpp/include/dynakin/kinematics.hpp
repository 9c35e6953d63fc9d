// Poses, velocities and accelerations of all segments in the ground frame, and the markers with their derivatives.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/model.hpp"
#include "dynakin/spatial.hpp"

namespace dynakin {

using StateRef = Eigen::Ref<const Eigen::VectorXd>;

// What one axis does at the present state, all in the ground frame about its origin.
struct AxisState {
  AxisMotion motion;
  Motion screw;         // S
  Motion screw_rate;    // Sdot = v x S
  Motion screw_second;  // Sddot = a x S + v x Sdot
};

// A length term seen as a prismatic axis at rest before the joint.
struct PlacementState {
  Motion screw, screw_rate, screw_second;
};

struct SegmentState {
  Matrix3 R_GB;
  Vector3 p_GB;
  Motion velocity;
  Motion acceleration;  // spatial; starts from -gravity at the ground, so weight is part of it
};

struct KinematicState {
  explicit KinematicState(const Model& model);

  std::vector<AxisState> axes;
  std::vector<SegmentState> segments;
  std::vector<std::vector<PlacementState>> placements;  // a list a segment, in the order of its length terms
  std::vector<Vector3> markers;                         // p_GM
};

// Values of coordinate i in x, or where it is locked.
struct CoordinateValue {
  double q, qd, qdd;
};
CoordinateValue coordinate_value(const Model& model, const StateRef& x, int coordinate);
double parameter_value(const Model& model, const StateRef& x, int parameter);

void forward_kinematics(const Model& model, const StateRef& x, KinematicState& out);

// d p_GM / dx at the columns model.marker_columns(marker), zero-filled first; rows: x, y, z (3, columns).
// column_slot[c] gives the place of state column c in the list (`marker_column_slots`).
void marker_jacobian(const Model& model, const KinematicState& state, int marker, const std::vector<int>& column_slot,
                     Eigen::Ref<Eigen::Matrix<double, 3, Eigen::Dynamic>> out);

// For each marker and state column its place in model.marker_columns(marker), or k_none.
std::vector<std::vector<int>> marker_column_slots(const Model& model);

}  // namespace dynakin
