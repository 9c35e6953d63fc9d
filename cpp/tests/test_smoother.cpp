#include "check.hpp"
#include "dynakin/fixed_lag.hpp"
#include "dynakin/smoother.hpp"
#include "dynakin/threads.hpp"
#include "models.hpp"

using namespace dynakin;

namespace {

// A trial in which the markers wave about and one is lost for a while, with some lengths held by their bounds.
struct Made {
  explicit Made(const ModelSpec& spec, int frames = 23) : model(spec), settings(settings_for(model)) {
    settings.constraint = ConstraintKind::projection;
    const Block& lengths = model.layout().block("lengths");
    settings.upper.segment(lengths.offset, lengths.size) =
        model.initial_state().segment(lengths.offset, lengths.size).array() + 1e-3;
    const auto still = markers_at(model, model.initial_state());
    for (int k = 0; k < frames; ++k) {
      auto shown = still;
      shown.array() += 0.02 * std::sin(0.3 * k);
      if (k > 5 && k < 10) shown.col(1).setConstant(std::nan(""));
      time.push_back(0.01 * k + 0.001 * (k % 3));
      markers.insert(markers.end(), shown.data(), shown.data() + shown.size());
      for (int c = 0; c < 6; ++c) wrench.push_back(k == 15 ? std::nan("") : c == 1 ? 400.0 : 5.0);
      if (spec.contacts.empty()) continue;
      const WrenchModel how = wrench_model_for(model);
      const Eigen::Matrix<double, 6, 6> R = (1.0 + 0.1 * (k % 4)) * how.covariance;
      covariance.insert(covariance.end(), R.data(), R.data() + R.size());
      const double part = k < 14 ? 1.0 - 0.05 * k : 0.0;  // a contact that leaves
      for (Eigen::Index i = 0; i < 6; ++i)
        for (Eigen::Index j = 0; j < how.effects.cols(); ++j) effects.push_back(part * how.effects(i, j));
    }
  }
  Trial trial() const {
    return {time.data(),
            markers.data(),
            wrench.data(),
            time.size(),
            covariance.empty() ? nullptr : covariance.data(),
            effects.empty() ? nullptr : effects.data()};
  }
  SmoothRecord smoothed(std::size_t stretch) const {
    Filter f(model, settings, model.initial_state(), prior_for(model));
    Smoother smoother(f, trial(), stretch);
    RunRecord record(model, time.size());
    smoother.forward(0, 7, record);
    smoother.forward(7, time.size(), record);
    SmoothRecord out(model, time.size());
    while (smoother.backward(record, out) > 0) {
    }
    CHECK(smoother.backward(record, out) == 0);
    const std::size_t n = model.state_size();
    for (std::size_t i = 0; i < n; ++i) {
      CHECK(f.state()(static_cast<Eigen::Index>(i)) == record.state[record.state.size() - n + i]);
      CHECK(out.state[out.state.size() - n + i] == record.state[record.state.size() - n + i]);
    }
    for (std::size_t i = 0; i < out.state_sd.size(); ++i) CHECK(out.state_sd[i] <= record.state_sd[i] * (1.0 + 1e-12));
    return out;
  }

  Model model;
  FilterSettings settings;
  std::vector<double> time, markers, wrench, covariance, effects;
};

}  // namespace

// Numbers are each given with their standard deviations; moments that nothing makes uncertain are next to zero.
void check_near(const std::vector<double>& found, const std::vector<double>& expected, const std::vector<double>& sd,
                double tolerance) {
  for (std::size_t i = 0; i < found.size(); ++i) CHECK_NEAR(found[i], expected[i], tolerance * sd[i] + 1e-12);
}

TEST(smoothing_gives_the_same_numbers_with_any_checkpoints) {
  for (const ModelSpec& spec :
       {planar_chain(), spatial_tree(), with_contact(planar_chain()), with_contact(spatial_tree())}) {
    const Made trial(spec);
    const SmoothRecord whole = trial.smoothed(1000);
    for (std::size_t stretch : {0, 1, 4, 22}) {
      const SmoothRecord out = trial.smoothed(stretch);
      check_near(out.state, whole.state, whole.state_sd, 1e-9);
      check_near(out.state_sd, whole.state_sd, whole.state_sd, 1e-9);
      check_near(out.moments, whole.moments, whole.moments_sd, 1e-9);
      check_near(out.moments_sd, whole.moments_sd, whole.moments_sd, 1e-9);
      check_near(out.wrench_sd, whole.wrench_sd, whole.wrench_sd, 1e-9);
    }
  }
}

TEST(what_is_given_of_the_wrench_tells_the_smoother) {
  Made trial(with_contact(spatial_tree()));
  const SmoothRecord with = trial.smoothed(4);
  const int contact = trial.model.contact_column(0);
  CHECK(with.state_sd[static_cast<std::size_t>(contact) + 1] <
        0.9 * std::sqrt(prior_for(trial.model)(contact, contact)));
  trial.covariance.clear();
  trial.effects.clear();
  const SmoothRecord without = trial.smoothed(4);
  CHECK(with.state != without.state && with.wrench_sd != without.wrench_sd);
}

// Bounds that bind are kept in another metric than the smoother's: the state is then near its, and within them.
void check_a_fixed_lag_ends_where_the_smoother_does(const ModelSpec& spec, bool bounded) {
  Made trial(spec);
  if (!bounded) trial.settings.constraint = ConstraintKind::none;
  const SmoothRecord out = trial.smoothed(0);
  Filter f(trial.model, trial.settings, trial.model.initial_state(), prior_for(trial.model));
  FixedLag lag(f, 6);
  const std::size_t m = trial.model.markers().size(), n = trial.model.state_size(), frames = trial.time.size();
  const Trial given = trial.trial();
  WrenchModel how;
  for (std::size_t k = 0; k < frames; ++k) {
    CHECK(lag.ready() == (k > 6));
    if (given.wrench_covariance) {
      const Eigen::Index columns = 6 * trial.model.contacts();
      how.covariance = Eigen::Map<const Matrix6>(given.wrench_covariance + 36 * k);
      how.effects = Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>>(
          given.wrench_effects + 6 * columns * k, 6, columns);
    }
    lag.step(given.dt(k), given.markers_at(k, m), Eigen::Map<const Vector6>(trial.wrench.data() + 6 * k),
             given.wrench_covariance ? &how : nullptr);
  }
  CHECK_NEAR(lag.delay(), trial.time[frames - 1] - trial.time[frames - 7], 1e-12);
  for (std::size_t i = 0; i < n; ++i) {
    const double sd = out.state_sd[(frames - 7) * n + i];
    const double x = lag.state()(static_cast<Eigen::Index>(i));
    CHECK_NEAR(x, out.state[(frames - 7) * n + i], (bounded ? 1e-2 : 1e-7) * sd);
    CHECK(!bounded || x <= trial.settings.upper(static_cast<Eigen::Index>(i)));
    CHECK_NEAR(std::sqrt(lag.covariance()(i, i)), sd, 1e-10 * sd);
  }
}

TEST(a_fixed_lag_ends_where_the_smoother_does) {
  for (bool bounded : {false, true}) {
    check_a_fixed_lag_ends_where_the_smoother_does(spatial_tree(), bounded);
    check_a_fixed_lag_ends_where_the_smoother_does(with_contact(spatial_tree()), bounded);
  }
}

TEST(smoothing_refuses_bounds_that_have_no_smoother) {
  const Model model(planar_chain());
  FilterSettings settings = settings_for(model);
  settings.upper(0) = 1.0;
  for (const auto& [kind, name] : {std::pair{ConstraintKind::gain, "'gain'"}, {ConstraintKind::sigmoid, "'sigmoid'"}}) {
    settings.constraint = kind;
    Filter filter(model, settings, model.initial_state(), prior_for(model));
    check_refused([&] { FixedLag(filter, 3); }, name);
  }
}

TEST(no_more_threads_are_at_work_than_may_be) {
  const AtWork first(1);
  CHECK(static_cast<bool>(first));
  CHECK(!AtWork(1));
  {
    const AtWork second(2);
    CHECK(static_cast<bool>(second));
    CHECK(!AtWork(2));
  }
  CHECK(static_cast<bool>(AtWork(2)));
}
