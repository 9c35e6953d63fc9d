// Derivatives of segments' and subtrees' forces that the wrench's and the moments' Jacobians share
// (docs/derivations.md, section 4).
#pragma once

#include "dynakin/dynamics.hpp"

namespace dynakin {

// Force that an axis (or length) displacement, rate and second rate each ask of the subtree behind it.
Force by_position(const SubtreeState& t, const Motion& S, const Motion& Sd, const Motion& Sdd);

// d f / d phi of one segment in the columns of its estimated numbers; the others of out (6, n) are left as they are.
void inertia_columns(const Segment& segment, const SegmentState& s,
                     Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> out);

}  // namespace dynakin
