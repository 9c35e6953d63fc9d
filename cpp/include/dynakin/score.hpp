// A whole trial through a filter for its figures alone: what a choice between noise settings is judged by.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "dynakin/trial.hpp"

namespace dynakin {

struct ScoreOptions {
  // Frames first to end - 1 count; those before are filtered too, those after are not.
  std::size_t first = 0, end = std::numeric_limits<std::size_t>::max();
  std::size_t ahead = 0;  // frames by which the state is also foreseen, without an update; 0: not at all
  double lost_m =
      k_infinity;        // RMS distance of a frame's markers from their estimates beyond which the person is lost,
  int lost_frames = 10;  // for so many frames in a row
  bool trace = false;    // whether states and moments are kept, to be compared with a truth
};

// Squared differences between what was measured and what a state says, summed channel by channel: 3 a marker, then 6
// wrench components (the body's own wrench, without what the plates are thought to add).
struct ChannelSums {
  explicit ChannelSums(std::size_t channels) : squares(channels), counts(channels) {}
  std::vector<double> squares;
  std::vector<int> counts;
};

struct Score {
  Score(const Model& model, std::size_t frames, const ScoreOptions& options);

  ChannelSums estimated, predicted, ahead;  // after the frame was used; before; `ahead` frames before
  double nis = 0.0, log_likelihood = 0.0;   // sums over the frames that count
  std::size_t rows = 0, refused = 0, counted = 0;
  std::size_t done = 0;                // frames filtered
  std::string divergence;              // why it was given up before the end; empty: it was not
  std::vector<double> state, moments;  // (frames, n), (frames, coordinates), with `trace`
};

// Divergence is an outcome here, not an exception, and ends the run.
Score score_trial(Filter& filter, const Trial& trial, const ScoreOptions& options);

}  // namespace dynakin
