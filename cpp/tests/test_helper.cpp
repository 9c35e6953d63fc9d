#include <array>

#include "check.hpp"
#include "dynakin/filter.hpp"
#include "dynakin/helper.hpp"
#include "dynakin/run.hpp"
#include "models.hpp"

using namespace dynakin;

TEST(each_part_is_done_once_whoever_does_it) {
  for (const bool threaded : {false, true}) {
    Helper helper(threaded);
    std::array<int, 24> done{};  // no atomics: a part is of one thread, and is done when share returns
    for (int loop = 1; loop <= 3000; ++loop) {
      const int count = loop % 25;
      helper.share(count, [&done](int i) { ++done[static_cast<std::size_t>(i)]; });
      if (loop % 25 != 0) continue;
      for (int i = 0; i < 24; ++i) CHECK(done[static_cast<std::size_t>(i)] == loop / 25 * (24 - i));
    }
  }
}

TEST(a_step_is_the_same_to_the_bit_with_a_helper) {
  const Model model(planar_chain());
  const FilterSettings settings = settings_for(model);
  const Eigen::VectorXd x = model.initial_state();
  const auto markers = markers_at(model, x);
  Filter alone(model, settings, x, prior_for(model)), helped(model, settings, x, prior_for(model));
  Helper helper(true);
  helped.share_with(&helper);
  for (int k = 0; k < 200; ++k) {
    const Vector6 wrench = Vector6::Constant(10.0 + k);
    alone.step(0.01, markers, wrench);
    helped.step(0.01, markers, wrench);
    CHECK(alone.state() == helped.state() && alone.covariance() == helped.covariance());
  }
}

TEST(what_is_reported_is_the_same_to_the_bit_with_a_helper) {
  constexpr std::size_t frames = 200;
  const Model model(with_contact(spatial_tree()));
  const FilterSettings settings = settings_for(model);
  const Eigen::VectorXd x = model.initial_state();
  Filter filter(model, settings, x, prior_for(model));
  const WrenchModel how = wrench_model_for(model);
  ContactTrial trial;
  trial.segments = {static_cast<int>(model.segments().size()) - 1};
  trial.frames = frames;
  trial.states = 1;
  trial.wrench.assign(6 * frames, 10.0);
  trial.effects.assign(36 * frames, 0.5);
  trial.contact.assign(frames, Contact::measured);
  for (std::size_t k = 0; k < 36 * frames; ++k) trial.covariance.push_back(k % 36 % 7 == 0 ? 4.0 : 0.1);
  ContactRecord contacts_alone(model, trial), contacts_helped(model, trial);
  StateRecord alone(model, frames, Said::deviations), helped(model, frames, Said::deviations);
  Helper helper(true);
  for (std::size_t k = 0; k < frames; ++k) {
    filter.step(0.01, markers_at(model, x), Vector6::Constant(10.0), &how);
    ContactRecord* const feet = k % 2 ? &contacts_alone : nullptr;
    alone.report(k, filter.state(), filter.covariance(), feet);
    helped.report(k, filter.state(), filter.covariance(), feet ? &contacts_helped : nullptr, &helper);
  }
  CHECK(alone.markers_sd == helped.markers_sd && alone.wrench_sd == helped.wrench_sd);
  CHECK(alone.moments_sd == helped.moments_sd && contacts_alone.wrench_sd == contacts_helped.wrench_sd);
  CHECK(alone.markers_sd.back() > 0.0 && alone.wrench_sd.back() > 0.0 && alone.moments_sd.back() > 0.0);
  CHECK(contacts_alone.wrench_sd.back() > 0.0);
}
