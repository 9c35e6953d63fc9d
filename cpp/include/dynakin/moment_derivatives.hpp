// Derivatives of the joint moments (1) w.r.t. the whole state, for their standard deviations. On demand: no step of the
// filter needs them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/dynamics.hpp"

namespace dynakin {

// What moment_jacobian works in: allocated once for a model, holds nothing between calls.
struct MomentWorkspace {
  explicit MomentWorkspace(const Model& model);

  // What a column of x does through one axis or length: a body k behind it answers with
  // df_k = screw x* f_k + B_k rate + I_k second (docs/derivations.md, section 4).
  struct Variation {
    int column;
    Motion screw, rate, second;
    Force force;  // sum of the df_k
  };
  // One axis' share in the moment of its coordinate, all of it times ds/dq.
  struct Row {
    int coordinate;
    int end_before;    // its segment's variations below this index move the axis, the others do not
    Motion screw;      // S
    Force inertial;    // I^c S
    Vector3 response;  // B^c' S, whose linear part vanishes
    Force external;    // -S x* (external wrenches behind)
  };

  std::vector<Variation> variations;  // a segment after the other; in each the lengths, then axis by axis
  std::vector<int> first_variation;   // of each segment, and the end
  std::vector<Row> rows;              // one an axis
  std::vector<Force> external;        // sum over each subtree
  Eigen::Matrix<double, 6, Eigen::Dynamic> inertia;  // d f_k / d phi_k in the columns of x; the others are not used
};

// d (joint moments) / dx: (coordinates, n), N m or N per unit of x, locked coordinates too. external: as in
// joint_moments, and they stay as they are while x varies. Needs subtree_dynamics of the same x. Allocates nothing.
void moment_jacobian(const Model& model, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                     const std::vector<Force>* external, MomentWorkspace& work, Eigen::Ref<Eigen::MatrixXd> out);

}  // namespace dynakin
