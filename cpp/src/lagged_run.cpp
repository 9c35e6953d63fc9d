#include "dynakin/lagged_run.hpp"

#include <algorithm>

namespace dynakin {

LaggedRun::LaggedRun(Filter& filter, const Trial& trial, int lag) : filter_(filter), trial_(trial), lag_(filter, lag) {}

void LaggedRun::run(std::size_t first, std::size_t end, RunRecord& record, StateRecord& lagged,
                    ContactRecord* contacts) {
  const auto lag = static_cast<std::size_t>(lag_.lag());
  Helped helped(filter_);
  const auto report = [&](std::size_t k, int by) {
    lag_.look_back(by);
    lagged.report(k, lag_.state(), lag_.covariance(), contacts, &helped.helper());
  };
  for (std::size_t k = first; k < end; ++k) {
    lag_.open(trial_.dt(k));
    run_frames(filter_, trial_, k, k + 1, record);
    lag_.close();
    if (lag_.ready()) report(k - lag, lag_.lag());
  }
  if (end == trial_.frames)
    for (std::size_t by = std::min(lag, end); by-- > 0;) report(end - 1 - by, static_cast<int>(by));
}

}  // namespace dynakin
