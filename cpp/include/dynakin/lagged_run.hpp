// A whole trial with a fixed lag: each frame's estimate from the frames until a given number later.
#pragma once

#include <cstddef>

#include "dynakin/fixed_lag.hpp"
#include "dynakin/run.hpp"
#include "dynakin/threads.hpp"

namespace dynakin {

// run_frames with a fixed lag. The last frames of a trial, which fewer follow, are estimated from all of these.
class LaggedRun {
 public:
  // Throws as FixedLag.
  LaggedRun(Filter& filter, const Trial& trial, int lag);

  // Frames first to end - 1, in as many calls as one likes, the last of which ends the trial. record: as of run_frames;
  // lagged: of the frames as they are seen later. contacts: as in run_frames, of lagged.
  void run(std::size_t first, std::size_t end, RunRecord& record, StateRecord& lagged,
           ContactRecord* contacts = nullptr);

 private:
  const AtWork working_;
  Filter& filter_;
  Trial trial_;
  FixedLag lag_;
};

}  // namespace dynakin
