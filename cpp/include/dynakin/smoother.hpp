// A whole trial forwards and backwards: each frame's estimate from all frames, in bounded memory.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dynakin/filter_given_constants.hpp"
#include "dynakin/reports.hpp"
#include "dynakin/run.hpp"
#include "dynakin/smoothed_dependence.hpp"
#include "dynakin/smoother_given_constants.hpp"
#include "dynakin/threads.hpp"

namespace dynakin {

struct SmoothRecord : StateRecord {
  SmoothRecord(const Model& of, std::size_t frames) : StateRecord(of, frames, Said::deviations), backward_us(frames) {}

  // All that smoothing adds to the run in wall time, which the frames of a stretch share evenly.
  std::vector<double> backward_us;
};

// The forward run keeps a checkpoint every so many frames, and of each frame what the filter decided. The way back
// takes each stretch between two checkpoints forwards once more, now given the constants, so memory grows with the root
// of the number of frames. While it looks back through one stretch another thread, where there is one (threads.hpp),
// takes the stretch before forwards and then reports the frames that were found (reports.hpp): the numbers are the same
// to the last bit. Afterwards the filter stands where the run left it.
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
  // Frames between two checkpoints, or from or up to a cut, once more and given the constants.
  struct Stretch {
    std::size_t first = 0, end = 0;
    std::optional<Belief> last;  // after it, where its constants are those of no later frame
    std::vector<FrameGivenConstants> frames;
  };

  Decision decision(std::size_t k, const Eigen::VectorXd& last) const;
  Eigen::VectorXd predicted(std::size_t k, double carried, Eigen::VectorXd x) const;
  Eigen::Map<const Eigen::VectorXd> state(std::size_t k, const RunRecord& record) const;
  // These touch nothing that look_back does.
  Belief belief_at(std::size_t k, const RunRecord& record);
  void replay(std::size_t end, const RunRecord& record, Stretch& out);
  void replay_frame(std::size_t k, const RunRecord& record, const FrameGivenConstants* last,
                    FrameGivenConstants& frame);
  void look_back(const Stretch& stretch, Reports& reports);

  const AtWork working_;
  Filter& filter_;
  Trial trial_;
  std::size_t stretch_, left_;
  std::vector<Filter::Checkpoint> checkpoints_;  // before each stretch and, last, after the run
  std::vector<Decision> decisions_;
  const Decision nothing_;
  Belief restarted_;  // after a frame with which everything started again
  FrameTape tape_;
  GivenConstants apart_;
  Stretch now_, before_;  // that is looked through, and that is replayed meanwhile
  // For replay.
  FilterGivenConstants forwards_;
  SmoothedDependence dependence_;
  Measurement measurement_;
  WrenchModel how_;
  // For look_back.
  SmootherGivenConstants backwards_;
  Projection projection_;
  Eigen::VectorXd x_;
};

}  // namespace dynakin
