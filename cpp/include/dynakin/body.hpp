// What is read of the body as a whole and of its joints: centre of mass, and the loads that joints carry.
#pragma once

#include <vector>

#include "dynakin/dynamics.hpp"

namespace dynakin {

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
