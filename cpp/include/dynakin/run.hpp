// A whole trial through a filter, with a record of what is reported of each frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynakin/contact_record.hpp"
#include "dynakin/helper.hpp"
#include "dynakin/output_sd.hpp"
#include "dynakin/threads.hpp"
#include "dynakin/trial.hpp"

namespace dynakin {

// A frame that another thread is to report.
struct WaitingFrame {
  std::size_t k = 0;
  Eigen::VectorXd x;
  Eigen::MatrixXd P;
};

// The state with its deviations; markers, wrench and moments too; their deviations too.
enum class Said { state, outputs, deviations };

// What is said of the state in each frame: row-major arrays, a row a frame; what is not said is empty. The wrench is
// the body's own, without what the plates are thought to add.
struct StateRecord {
  StateRecord(const Model& model, std::size_t frames, Said said);

  // Frame k; contacts: as in run_frames. helper: takes a share of the deviations, which changes no bit of them.
  void report(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P, ContactRecord* contacts,
              Helper* helper = nullptr);

  const Model& model;
  const Said said;
  std::vector<double> state, state_sd;
  std::vector<double> markers, markers_sd;  // (frames, markers, 3)
  std::vector<double> wrench, wrench_sd;    // (frames, 6)
  std::vector<double> moments, moments_sd;  // (frames, coordinates)
  std::optional<OutputDeviation> deviation;
  std::vector<WaitingFrame> waiting;  // of Reports; a frame's covariance is the most that it keeps
 private:
  KinematicState kinematics_;
  DynamicState dynamics_;
};

// The same of a run, with what it made of each frame.
struct RunRecord : StateRecord {
  // sensors: whether to say what was expected of each sensor, which takes the gate longer.
  RunRecord(const Model& model, std::size_t frames, Said said = Said::outputs, bool sensors = true);

  const bool sensors;
  std::vector<double> markers_predicted, wrench_predicted;    // before the frame is used
  std::vector<double> innovation, innovation_sd, test_ratio;  // SensorReport's
  std::vector<double> nis, log_likelihood, step_us;
  std::vector<int> rows, constrained;
  std::vector<std::uint8_t> verdicts;  // (frames, markers + 1), of each marker and, last, of the plates
  std::vector<std::uint8_t> tracking, constraints_met;
  std::vector<std::uint8_t> at_limit;  // (frames, free coordinates), which the filter held at an end of its range
};

// A place for a second thread (threads.hpp) as long as this lives: where there is one, and the model is large enough,
// it helps the filter and whoever asks for it.
class Helped {
 public:
  explicit Helped(Filter& filter);
  ~Helped() { filter_.share_with(nullptr); }
  Helped(const Helped&) = delete;
  Helped& operator=(const Helped&) = delete;
  Helper& helper() { return helper_; }

 private:
  Filter& filter_;
  const AtWork other_;
  Helper helper_;
};

// Frames first to end - 1; frame 0 is an update only, the others step by the difference of their times. With contacts,
// moments (and their deviations) are those that the feet's wrenches leave. Throws DivergenceError naming the frame and
// its time.
void run_frames(Filter& filter, const Trial& trial, std::size_t first, std::size_t end, RunRecord& record,
                ContactRecord* contacts = nullptr);

}  // namespace dynakin
