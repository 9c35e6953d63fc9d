#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <utility>

#include "arrays.hpp"
#include "contacts.hpp"
#include "dynakin/lagged_run.hpp"
#include "dynakin/smoother.hpp"
#include "dynakin/threads.hpp"
#include "module.hpp"
#include "trial.hpp"

using namespace dynakin;

namespace {

constexpr std::size_t k_stretch = 256;  // frames between two looks at the interpreter: progress, Ctrl-C

void look_up(const nb::object& progress, std::size_t done, std::size_t total) {
  if (!progress.is_none()) progress(done, total);
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

// Names are prefix, what it is, and of markers and wrench the suffix.
void add_arrays_of(StateRecord&& record, std::size_t frames, const std::string& prefix, const char* suffix,
                   nb::dict& out) {
  const Model& model = record.model;
  const std::size_t n = model.state_size(), nc = model.coordinates().size(), n_markers = model.markers().size();
  const auto key = [&](const char* name, const char* end = "") { return nb::str((prefix + name + end).c_str()); };
  out[key("state")] = owned(std::move(record.state), {frames, n});
  out[key("state_sd")] = owned(std::move(record.state_sd), {frames, n});
  if (record.said == Said::state) return;
  out[key("markers", suffix)] = owned(std::move(record.markers), {frames, n_markers, 3});
  out[key("wrench", suffix)] = owned(std::move(record.wrench), {frames, 6});
  out[key("moments")] = owned(std::move(record.moments), {frames, nc});
  if (!record.deviation) return;
  out[key("markers_sd")] = owned(std::move(record.markers_sd), {frames, n_markers, 3});
  out[key("wrench_sd")] = owned(std::move(record.wrench_sd), {frames, 6});
  out[key("moments_sd")] = owned(std::move(record.moments_sd), {frames, nc});
}

nb::dict arrays_of(RunRecord&& record, std::size_t frames) {
  const std::size_t n_markers = record.model.markers().size(), channels = 3 * n_markers + 6;
  const bool sensors = record.sensors;
  nb::dict out;
  add_arrays_of(std::move(record), frames, "", "_estimated", out);
  if (sensors) {
    out["markers_predicted"] = owned(std::move(record.markers_predicted), {frames, n_markers, 3});
    out["wrench_predicted"] = owned(std::move(record.wrench_predicted), {frames, 6});
    out["innovation"] = owned(std::move(record.innovation), {frames, channels});
    out["innovation_sd"] = owned(std::move(record.innovation_sd), {frames, channels});
    out["test_ratio"] = owned(std::move(record.test_ratio), {frames, n_markers + 1});
  }
  out["nis"] = owned(std::move(record.nis), {frames});
  out["log_likelihood"] = owned(std::move(record.log_likelihood), {frames});
  out["step_us"] = owned(std::move(record.step_us), {frames});
  out["n_rows"] = owned(std::move(record.rows), {frames});
  out["constrained"] = owned(std::move(record.constrained), {frames});
  out["verdicts"] = owned(std::move(record.verdicts), {frames, n_markers + 1});
  out["tracking"] = owned(std::move(record.tracking), {frames});
  const auto n_free = static_cast<std::size_t>(record.model.n_free());
  out["at_limit"] = owned(std::move(record.at_limit), {frames, n_free});
  out["constraints_met"] = owned(std::move(record.constraints_met), {frames});
  return out;
}

// What a run needs of the feet, where there are any.
struct Feet {
  Feet(const Model& model, const PyContactLoads* loads, std::size_t frames) {
    if (!loads) return;
    if (loads->trial.frames != frames)
      throw std::invalid_argument("feet: loads of " + std::to_string(loads->trial.frames) + " frames, expected " +
                                  std::to_string(frames));
    trial = loads->of(model);
    record.emplace(model, trial);
  }
  Feet(const Feet&) = delete;
  Feet& operator=(const Feet&) = delete;

  ContactRecord* pointer() { return record ? &*record : nullptr; }
  void add_arrays(const Model& model, const std::string& prefix, bool deviations, nb::dict& out) {
    if (!record) return;
    const std::size_t frames = trial.frames, feet = trial.segments.size(), nc = model.coordinates().size();
    const auto key = [&](const char* name) { return nb::str((prefix + name).c_str()); };
    out[key("foot_wrench")] = owned(std::move(record->wrench), {frames, feet, 6});
    out[key("foot_adjustment")] = owned(std::move(record->adjustment), {frames, feet, 6});
    out[key("remainder")] = owned(std::move(record->remainder), {frames, 6});
    out[key("moment_source")] = owned(std::move(record->source), {frames, nc});
    if (deviations) out[key("foot_wrench_sd")] = owned(std::move(record->wrench_sd), {frames, feet, 6});
  }
  ContactTrial trial;
  std::optional<ContactRecord> record;
};

nb::dict run(Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench, nb::object progress,
             bool output_sd, bool state_only, const PyContactLoads* loads,
             const std::optional<Array3>& wrench_covariance, const std::optional<Array3>& wrench_effects) {
  const Trial trial = trial_of(filter, time, markers, wrench, wrench_covariance, wrench_effects);
  const Said said = state_only ? Said::state : output_sd ? Said::deviations : Said::outputs;
  Feet feet(filter.model(), state_only ? nullptr : loads, trial.frames);
  RunRecord record(filter.model(), trial.frames, said, !state_only);
  const AtWork working;
  for (std::size_t first = 0; first < trial.frames; first += k_stretch) {
    const std::size_t end = std::min(trial.frames, first + k_stretch);
    {
      nb::gil_scoped_release release;
      run_frames(filter, trial, first, end, record, feet.pointer());
    }
    look_up(progress, end, trial.frames);
  }
  nb::dict out = arrays_of(std::move(record), trial.frames);
  feet.add_arrays(filter.model(), "", output_sd, out);
  return out;
}

nb::dict run_smoothed(Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench,
                      nb::object progress, bool outputs, std::size_t stretch, const PyContactLoads* loads,
                      const std::optional<Array3>& wrench_covariance, const std::optional<Array3>& wrench_effects) {
  const Trial trial = trial_of(filter, time, markers, wrench, wrench_covariance, wrench_effects);
  Feet feet(filter.model(), outputs ? loads : nullptr, trial.frames);
  Feet smoothed_feet(filter.model(), loads, trial.frames);
  const std::size_t frames = trial.frames;
  Smoother smoother(filter, trial, stretch);
  RunRecord record(filter.model(), frames, outputs ? Said::deviations : Said::state);
  for (std::size_t first = 0; first < frames; first += k_stretch) {
    const std::size_t end = std::min(frames, first + k_stretch);
    {
      nb::gil_scoped_release release;
      smoother.forward(first, end, record, feet.pointer());
    }
    look_up(progress, end, 2 * frames);
  }
  SmoothRecord smoothed(filter.model(), frames);
  for (std::size_t left = frames; left > 0;) {
    {
      nb::gil_scoped_release release;
      left = smoother.backward(record, smoothed, smoothed_feet.pointer());
    }
    look_up(progress, 2 * frames - left, 2 * frames);
  }
  nb::dict out = arrays_of(std::move(record), frames);
  add_arrays_of(std::move(smoothed), frames, "smoothed_", "", out);
  out["backward_us"] = owned(std::move(smoothed.backward_us), {frames});
  feet.add_arrays(filter.model(), "", true, out);
  smoothed_feet.add_arrays(filter.model(), "smoothed_", true, out);
  return out;
}

nb::dict run_lagged(Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench, int lag,
                    nb::object progress, const PyContactLoads* loads, const std::optional<Array3>& wrench_covariance,
                    const std::optional<Array3>& wrench_effects) {
  const Trial trial = trial_of(filter, time, markers, wrench, wrench_covariance, wrench_effects);
  Feet lagged_feet(filter.model(), loads, trial.frames);
  const std::size_t frames = trial.frames;
  LaggedRun lagged_run(filter, trial, lag);
  RunRecord record(filter.model(), frames, Said::state);
  StateRecord lagged(filter.model(), frames, Said::deviations);
  constexpr std::size_t together = 16;  // a frame takes longer than in a run
  for (std::size_t first = 0; first < frames; first += together) {
    const std::size_t end = std::min(frames, first + together);
    {
      nb::gil_scoped_release release;
      lagged_run.run(first, end, record, lagged, lagged_feet.pointer());
    }
    look_up(progress, end, frames);
  }
  nb::dict out = arrays_of(std::move(record), frames);
  add_arrays_of(std::move(lagged), frames, "smoothed_", "", out);
  lagged_feet.add_arrays(filter.model(), "smoothed_", true, out);
  return out;
}

}  // namespace

void bind_run(nb::class_<Filter>& filter) {
  filter
      .def("run", &run, nb::arg("time"), nb::arg("markers"), nb::arg("wrench"), nb::arg("progress") = nb::none(),
           nb::arg("output_sd") = false, nb::arg("state_only") = false, nb::arg("feet") = nb::none(),
           nb::arg("wrench_covariance") = nb::none(), nb::arg("wrench_effects") = nb::none(),
           "Runs over time (T,), markers (T, M, 3) and wrench (T, 6); the first frame is an update only. Returns "
           "arrays by name; wrench_covariance (T, 6, 6), about the ground origin, takes the place of the settings', "
           "and wrench_effects (T, 6, 6 C) is what the states of the contacts take from it; with output_sd also "
           "markers_sd, wrench_sd (of the body's own wrench) and moments_sd; with state_only nothing of markers, "
           "wrenches and moments, nor of what was expected of sensors. "
           "With feet the moments are those of contact_moments, and foot_wrench, foot_adjustment, remainder, "
           "moment_source "
           "(and foot_wrench_sd) come with them. "
           "Raises DivergenceError naming the frame. progress(done, total) is called now and then.")
      .def(
          "run_smoothed", &run_smoothed, nb::arg("time"), nb::arg("markers"), nb::arg("wrench"),
          nb::arg("progress") = nb::none(), nb::arg("outputs") = false, nb::arg("stretch") = 0,
          nb::arg("feet") = nb::none(), nb::arg("wrench_covariance") = nb::none(),
          nb::arg("wrench_effects") = nb::none(),
          "run, then backwards over the same frames: the arrays of run (of markers_estimated, wrench_estimated, "
          "moments and the feet with `outputs` alone, then with deviations), and smoothed_state, _markers, _wrench and "
          "_moments, each also with _sd, and backward_us. The filter then stands where run would have left it; after "
          "an interruption it stands anywhere. progress counts both ways: total is twice the frames. Memory in "
          "addition to the arrays: T / stretch checkpoints and stretch frames, twice as many where a second thread "
          "helps; 0: sqrt(T). It helps where fewer threads smooth in this process than OMP_NUM_THREADS says (else: "
          "than the machine has), and changes no bit. Raises ValueError where bounds are kept by constraint 'gain' "
          "or 'sigmoid'.")
      .def("run_lagged", &run_lagged, nb::arg("time"), nb::arg("markers"), nb::arg("wrench"), nb::arg("lag"),
           nb::arg("progress") = nb::none(), nb::arg("feet") = nb::none(), nb::arg("wrench_covariance") = nb::none(),
           nb::arg("wrench_effects") = nb::none(),
           "run_smoothed's arrays (but backward_us), where each frame is smoothed from the frames until `lag` later "
           "alone, as a FixedLag gives it while it is measured; the last ones from those that there are. Time goes "
           "with frames times lag. Raises as run_smoothed.");
}
