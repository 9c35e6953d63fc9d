#include "dynakin/lagged_run.hpp"

#include <algorithm>

namespace dynakin {

LaggedRun::LaggedRun(Filter& filter, const Trial& trial, int lag)
    : filter_(filter), trial_(trial), lag_(filter, lag), kinematics_(filter.model()), dynamics_(filter.model()) {}

void LaggedRun::run(std::size_t first, std::size_t end, RunRecord& record, StateRecord& lagged, ContactRecord* contacts,
                    ContactRecord* lagged_contacts) {
  const auto lag = static_cast<std::size_t>(lag_.lag());
  for (std::size_t k = first; k < end; ++k) {
    lag_.open(trial_.dt(k));
    run_frames(filter_, trial_, k, k + 1, record, contacts);
    lag_.close();
    if (!lag_.ready()) continue;
    lag_.look_back(lag_.lag());
    report(k - lag, lagged, lagged_contacts);
  }
  if (end < trial_.frames) return;
  for (std::size_t by = std::min(lag, end); by-- > 0;) {
    lag_.look_back(static_cast<int>(by));
    report(end - 1 - by, lagged, lagged_contacts);
  }
}

void LaggedRun::report(std::size_t k, StateRecord& lagged, ContactRecord* contacts) {
  const Eigen::VectorXd& x = lag_.state();
  forward_kinematics(filter_.model(), x, kinematics_);
  subtree_dynamics(filter_.model(), x, kinematics_, dynamics_);
  lagged.report(k, x, lag_.covariance(), kinematics_, dynamics_, contacts);
}

}  // namespace dynakin
