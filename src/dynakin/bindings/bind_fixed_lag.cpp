#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <optional>

#include "arrays.hpp"
#include "dynakin/fixed_lag.hpp"
#include "module.hpp"
#include "trial.hpp"

using namespace dynakin;

namespace {

void check_ready(const FixedLag& lag) {
  if (!lag.ready())
    throw std::invalid_argument("fixed lag: no smoothed frame before frame " + std::to_string(lag.lag()) +
                                " (see ready)");
}

}  // namespace

void bind_fixed_lag(nb::module_& m) {
  nb::class_<FixedLag>(m, "FixedLag",
                       "Steps a Filter and smooths the frame that lies `lag` frames back, from all frames until now.")
      .def(
          nb::init<Filter&, int>(), nb::arg("filter"), nb::arg("lag"), nb::keep_alive<1, 2>(),
          "The filter stands before the first frame and is stepped by this object alone. Each step costs in "
          "proportion to the lag; so do state_sd and covariance, which are worked out where they are asked for: half a "
          "filter step for each frame of the lag.")
      .def(
          "step",
          [](FixedLag& lag, double dt, const Array2& markers, const Vector6& wrench,
             const std::optional<Matrix6>& wrench_covariance, const std::optional<Eigen::MatrixXd>& wrench_effects) {
            return lag.step(dt, marker_map(markers, lag.filter().model()), wrench,
                            GivenWrenchModel(lag.filter().model(), wrench_covariance, wrench_effects));
          },
          nb::arg("dt"), nb::arg("markers"), nb::arg("wrench"), nb::arg("wrench_covariance") = nb::none(),
          nb::arg("wrench_effects") = nb::none(),
          "As of Filter.step: dt s since the frame before (the first frame is an update only), markers (M, 3), wrench "
          "(6,).")
      .def_prop_ro("lag", &FixedLag::lag, "frames")
      .def_prop_ro("ready", &FixedLag::ready, "whether there is a smoothed frame yet")
      .def_prop_ro("delay_s", &FixedLag::delay, "how far the smoothed frame lies back")
      .def_prop_ro(
          "state",
          [](const FixedLag& lag) -> Eigen::VectorXd {
            check_ready(lag);
            return lag.state();
          },
          "smoothed x (n,) of the frame delay_s ago")
      .def_prop_ro(
          "state_sd",
          [](FixedLag& lag) -> Eigen::VectorXd {
            check_ready(lag);
            return lag.covariance().diagonal().cwiseMax(0.0).cwiseSqrt();
          },
          "its standard deviations (n,)")
      .def_prop_ro(
          "covariance",
          [](FixedLag& lag) -> Eigen::MatrixXd {
            check_ready(lag);
            return lag.covariance();
          },
          "its covariance (n, n): of all pairs of states of which none is a marker's own place or soft tissue, and of "
          "those that move the same marker; 0 elsewhere");
}
