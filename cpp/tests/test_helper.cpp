#include <array>

#include "check.hpp"
#include "dynakin/filter.hpp"
#include "dynakin/helper.hpp"
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
