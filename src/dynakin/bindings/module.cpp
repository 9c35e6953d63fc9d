#include "module.hpp"

NB_MODULE(_core, m) {
  // A command ends without a last collection of cycles, so that what they hold is still there.
  nb::set_leak_warnings(false);
  m.doc() = "dynakin's compiled core: model, kinematics, dynamics, filter. Arrays in and out are float64 copies.";
  bind_spec(m);
  bind_model(m);
  bind_mechanics(m);
  bind_contacts(m);
  bind_threads(m);
  bind_filter(m);
  bind_fixed_lag(m);
}
