// A whole trial forwards and backwards: each frame's estimate from all frames, in bounded memory.
#pragma once

#include <cstddef>
#include <vector>

#include "dynakin/given_constants.hpp"
#include "dynakin/run.hpp"

namespace dynakin {

struct SmoothRecord : StateRecord {
  SmoothRecord(const Model& of, std::size_t frames) : StateRecord(of, frames, true), backward_us(frames) {}

  std::vector<double> backward_us;  // all that smoothing adds to the run
};

// The forward run keeps a checkpoint every so many frames, and of each frame what the filter decided. The way back
// takes each stretch between two checkpoints forwards once more, now given the constants, so memory grows with the root
// of the number of frames. Afterwards the filter stands where the run left it.
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
  Decision decision(std::size_t k, const Eigen::VectorXd& last) const;
  Eigen::VectorXd predicted(std::size_t k, double carried, Eigen::VectorXd x) const;
  Eigen::Map<const Eigen::VectorXd> state(std::size_t k, const RunRecord& record) const;
  Belief belief_at(std::size_t k, const RunRecord& record);
  void begin(std::size_t first, const RunRecord& record);
  void replay(std::size_t k, std::size_t first, const RunRecord& record);

  Filter& filter_;
  Trial trial_;
  std::size_t stretch_, left_;
  std::vector<Filter::Checkpoint> checkpoints_;  // before each stretch and, last, after the run
  std::vector<Decision> decisions_;
  const Decision nothing_;
  Belief restarted_;  // after a frame with which everything started again
  FrameTape tape_;
  std::vector<GivenConstants::Frame> frames_;
  GivenConstants pass_;
  Projection projection_;
  Measurement measurement_;
  KinematicState kinematics_;
  DynamicState dynamics_;
  WrenchModel how_;
  Eigen::VectorXd x_;
};

}  // namespace dynakin
