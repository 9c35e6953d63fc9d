#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <utility>

#include "arrays.hpp"
#include "dynakin/score.hpp"
#include "module.hpp"
#include "trial.hpp"

using namespace dynakin;

namespace {

void add_sums(ChannelSums&& sums, const std::string& name, nb::dict& out) {
  const std::size_t channels = sums.squares.size();
  out[(name + "_squares").c_str()] = owned(std::move(sums.squares), {channels});
  out[(name + "_counts").c_str()] = owned(std::move(sums.counts), {channels});
}

nb::dict score(Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench, std::size_t first,
               std::size_t end, std::size_t ahead, double lost_m, bool trace) {
  const Trial trial = trial_of(filter, time, markers, wrench);
  const Model& model = filter.model();
  ScoreOptions options;
  options.first = first;
  options.end = end;
  options.ahead = ahead;
  options.lost_m = lost_m;
  options.trace = trace;
  Score found = [&] {
    nb::gil_scoped_release release;
    return score_trial(filter, trial, options);
  }();
  nb::dict out;
  add_sums(std::move(found.estimated), "estimated", out);
  add_sums(std::move(found.predicted), "predicted", out);
  add_sums(std::move(found.ahead), "ahead", out);
  out["nis"] = found.nis;
  out["log_likelihood"] = found.log_likelihood;
  out["n_rows"] = found.rows;
  out["refused"] = found.refused;
  out["counted"] = found.counted;
  out["done"] = found.done;
  out["divergence"] = found.divergence;
  if (trace) {
    const auto n = static_cast<std::size_t>(model.state_size());
    out["state"] = owned(std::move(found.state), {trial.frames, n});
    out["moments"] = owned(std::move(found.moments), {trial.frames, model.coordinates().size()});
  }
  return out;
}

}  // namespace

void bind_score(nb::class_<Filter>& filter) {
  filter.def("score", &score, nb::arg("time"), nb::arg("markers"), nb::arg("wrench"), nb::arg("first"), nb::arg("end"),
             nb::arg("ahead") = 0, nb::arg("lost_m") = k_infinity, nb::arg("trace") = false,
             "run for its figures alone, over frames 0 to end - 1, of which those from first on count: sums of squares "
             "and counts a channel (3M + 6: markers, then the body's own wrench) of the estimate (estimated_), of the "
             "expectation before the frame (predicted_) and of that so many frames earlier (ahead_); sums of nis, "
             "log_likelihood, n_rows, refused sensors; frames counted and done; divergence, a word where the filter "
             "diverged or the markers were further off than lost_m for ten frames, which ends the run. With trace also "
             "state (T, n) and moments (T, C).");
}
