#include "dynakin/lagged_run.hpp"

#include <algorithm>

#include "dynakin/reports.hpp"

namespace dynakin {

LaggedRun::LaggedRun(Filter& filter, const Trial& trial, int lag) : filter_(filter), trial_(trial), lag_(filter, lag) {}

void LaggedRun::run(std::size_t first, std::size_t end, RunRecord& record, StateRecord& lagged,
                    ContactRecord* contacts) {
  const auto lag = static_cast<std::size_t>(lag_.lag());
  const Helped helped(filter_);
  Reports reports(lagged, contacts, static_cast<bool>(helped));
  for (std::size_t k = first; k < end; ++k) {
    lag_.open(trial_.dt(k));
    run_frames(filter_, trial_, k, k + 1, record);
    lag_.close();
    if (!lag_.ready()) continue;
    lag_.look_back(lag_.lag());
    reports.add(k - lag, lag_.state(), lag_.covariance());
  }
  if (end == trial_.frames)
    for (std::size_t by = std::min(lag, end); by-- > 0;) {
      lag_.look_back(static_cast<int>(by));
      reports.add(end - 1 - by, lag_.state(), lag_.covariance());
    }
  reports.end();
}

}  // namespace dynakin
