// Total external wrench and joint moments (1) by Newton-Euler sweeps in the ground frame, and the wrench's derivatives.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/kinematics.hpp"

namespace dynakin {

// Of each segment with all that hangs on it.
struct SubtreeState {
  Force force;  // sum of f_i = I_i a_i + v_i x* I_i v_i
  SpatialInertia inertia;
  VelocityResponse response;
};

struct DynamicState {
  explicit DynamicState(const Model& model) : subtrees(model.segments().size()) {}

  std::vector<SubtreeState> subtrees;
  Force wrench;       // external, on the whole body, about the ground origin
  double mass = 0.0;  // of the whole body
};

// Needs forward_kinematics of the same x. The wrench is what the ground must give: weight and inertia together.
void subtree_dynamics(const Model& model, const StateRef& x, const KinematicState& state, DynamicState& out);

// Sum of the wrenches on each segment and on all that hangs on it; external as in joint_moments, out a segment each.
void subtree_external(const Model& model, const std::vector<Force>* external, std::vector<Force>& out);

// Moment (N m) or force (N) along each coordinate, locked ones too: S' (subtree force - external wrenches that act
// there). external: a wrench a segment, already about the ground origin, or nullptr.
void joint_moments(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                   const std::vector<Force>* external, Eigen::Ref<Eigen::VectorXd> out);

// d wrench / dx in the columns model.wrench_columns(); the others of out (6, n) are left as they are.
void wrench_jacobian(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                     Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> out);

// What an axis' (or length's) displacement, rate and second rate ask of the subtree behind it, and d f / d phi of one
// segment (other columns of out (6, n) stay): the Jacobians share them (docs/derivations.md, section 4).
Force by_position(const SubtreeState& t, const Motion& S, const Motion& Sd, const Motion& Sdd);
void inertia_columns(const Segment& segment, const SegmentState& s,
                     Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> out);

// A segment's ten numbers about its origin, its axes: those of x where they are estimated.
InertiaVector inertia_of(const Segment& segment, const StateRef& x);

struct MassCentre {
  Vector3 position = Vector3::Zero();  // m, ground frame
  Vector3 velocity = Vector3::Zero();  // m/s
};

// Of the whole body, from its first moment and its linear momentum. Needs subtree_dynamics.
MassCentre mass_centre(const Model& model, const DynamicState& dynamics);

// What each segment's parent does to it through the joint by which it hangs, ground axes, about the segment's origin:
// the whole of it (muscles, ligaments and bones together), and for a floating root what nothing accounts for. external:
// a wrench a segment about the ground origin, or nullptr; out: one a segment.
void joint_loads(const Model& model, const KinematicState& state, const DynamicState& dynamics,
                 const std::vector<Force>* external, std::vector<Force>& out);

}  // namespace dynakin
