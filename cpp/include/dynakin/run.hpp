// A whole trial through a filter, with a record of what is reported of each frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynakin/contact_record.hpp"
#include "dynakin/filter.hpp"
#include "dynakin/output_sd.hpp"

namespace dynakin {

// Row-major arrays, a row a frame. "predicted": before the frame is used; "estimated": after; the
// wrench then is the body's own, without what the plates are thought to add.
struct RunRecord {
  RunRecord(const Model& model, std::size_t frames, bool output_sd = false);

  std::vector<double> state, state_sd;
  std::vector<double> markers_predicted, markers_estimated;  // (frames, markers, 3)
  std::vector<double> wrench_predicted, wrench_estimated;    // (frames, 6)
  std::vector<double> moments;                               // (frames, coordinates)
  // Standard deviations of what is estimated, on demand; empty otherwise.
  std::vector<double> markers_sd, wrench_sd, moments_sd;
  std::optional<OutputDeviation> deviation;  // works them out
  std::vector<double> nis, log_likelihood, step_us;
  std::vector<int> rows, constrained;
  std::vector<std::uint8_t> verdicts;  // (frames, markers + 1), of each marker and, last, of the plates
  std::vector<std::uint8_t> tracking, constraints_met;
};

// Frames first to end - 1; frame 0 is an update only, the others step by the difference of their times.
// With contacts, moments (and their deviations) are those that the feet's wrenches leave.
// Throws DivergenceError naming the frame and its time.
void run_frames(Filter& filter, const double* time, const double* markers, const double* wrench, std::size_t first,
                std::size_t end, RunRecord& record, ContactRecord* contacts = nullptr);

}  // namespace dynakin
