// A whole trial forwards and backwards: each frame's estimate from all frames, in bounded memory.
#pragma once

#include <cstddef>
#include <vector>

#include "dynakin/backward_pass.hpp"
#include "dynakin/run.hpp"

namespace dynakin {

struct SmoothRecord : StateRecord {
  SmoothRecord(const Model& of, std::size_t frames) : StateRecord(of, frames, true), backward_us(frames) {}

  std::vector<double> backward_us;  // without the second run forwards
};

// The forward run keeps a checkpoint every so many frames. The way back runs each stretch between two of them forwards
// once more, now with tapes, so memory grows with the root of the number of frames. Afterwards the filter stands
// where the run left it.
class Smoother {
 public:
  // stretch: frames between checkpoints, 0: sqrt(frames). Throws std::invalid_argument where constraints are kept in a
  // way that has no smoother.
  Smoother(Filter& filter, const Trial& trial, std::size_t stretch = 0);
  ~Smoother() { filter_.record_to(nullptr); }
  Smoother(const Smoother&) = delete;
  Smoother& operator=(const Smoother&) = delete;

  // run_frames, from the first frame to the last, in as many calls as one likes.
  void forward(std::size_t first, std::size_t end, RunRecord& record, ContactRecord* contacts = nullptr);
  // The last stretch that is left; returns how many frames then are left. contacts: as in run_frames.
  std::size_t backward(const RunRecord& record, SmoothRecord& out, ContactRecord* contacts = nullptr);

 private:
  struct Frame {
    Belief filtered;
    FrameTape tape;
  };
  void replay(std::size_t first, std::size_t end, const RunRecord& record);

  Filter& filter_;
  Trial trial_;
  std::size_t stretch_, left_;
  std::vector<Filter::Checkpoint> checkpoints_;  // before each stretch and, last, after the run
  std::vector<Frame> replayed_;
  BackwardPass pass_;
  KinematicState kinematics_;
  DynamicState dynamics_;
  Belief smoothed_;
};

}  // namespace dynakin
