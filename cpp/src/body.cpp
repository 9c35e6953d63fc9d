#include "dynakin/body.hpp"

namespace dynakin {

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
