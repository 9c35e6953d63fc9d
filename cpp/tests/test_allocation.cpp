// given a filter that stands ready, when it steps, then nothing is allocated: not by new, not by malloc.
#include <atomic>
#include <cstdlib>
#include <new>

#include "check.hpp"
#include "dynakin/contacts.hpp"
#include "dynakin/filter.hpp"
#include "dynakin/fixed_lag.hpp"
#include "dynakin/moment_derivatives.hpp"
#include "dynakin/output_sd.hpp"
#include "dynakin/projection.hpp"
#include "models.hpp"

#ifdef DYNAKIN_COUNT_ALLOCATIONS
namespace {
std::atomic<long> allocations{0};
}

extern "C" {
void* __real_malloc(std::size_t);
void* __real_calloc(std::size_t, std::size_t);
void* __real_realloc(void*, std::size_t);
void* __real_aligned_alloc(std::size_t, std::size_t);
int __real_posix_memalign(void**, std::size_t, std::size_t);
void* __wrap_malloc(std::size_t size) { return ++allocations, __real_malloc(size); }
void* __wrap_calloc(std::size_t n, std::size_t size) { return ++allocations, __real_calloc(n, size); }
void* __wrap_realloc(void* p, std::size_t size) { return ++allocations, __real_realloc(p, size); }
void* __wrap_aligned_alloc(std::size_t a, std::size_t size) { return ++allocations, __real_aligned_alloc(a, size); }
int __wrap_posix_memalign(void** p, std::size_t a, std::size_t n) {
  return ++allocations, __real_posix_memalign(p, a, n);
}
}
void* operator new(std::size_t size) { return std::malloc(size); }
void* operator new(std::size_t size, std::align_val_t align) { return std::aligned_alloc(std::size_t(align), size); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace {

// With contacts in the spec also with a WrenchModel that changes, frame by frame, and is away in some.
void check_no_allocation(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  FilterSettings settings = settings_for(model);
  settings.upper.setConstant(1.0);  // some elements are held, so the constraint works too
  const Eigen::VectorXd x = model.initial_state();
  auto markers = markers_at(model, x);
  const Vector6 wrench = Vector6::Constant(10.0);
  Filter filter(model, settings, x, prior_for(model));
  Helper helper(true);
  filter.share_with(&helper);
  WrenchModel how = wrench_model_for(model);
  for (int k = 0; k < 20; ++k) {
    if (k == 10) markers.col(1).setConstant(std::nan(""));
    how.effects *= 0.9;
    const bool given = model.contacts() > 0 && k % 5 != 4;
    const long before = allocations;
    const StepReport report = filter.step(0.01, markers, wrench, given ? &how : nullptr);
    CHECK(allocations == before);
    CHECK(!report.diverged());
    CHECK(report.constrained > 0 || k > 0);
  }
}

// White jerk, soft tissue, slow and late plates, gates with refusals, an equality, bounds that bind, recovery at hand.
void check_no_allocation_with_everything_on(dynakin::ModelSpec spec) {
  using namespace dynakin;
  for (MarkerSpec& m : spec.markers) m.soft_tissue = m.estimated;
  spec.wrench_offset = spec.wrench_measured;
  spec.wrench_delay = true;
  const Model model(spec);
  const int n = model.state_size(), n_free = model.n_free();
  FilterSettings settings = settings_for(model);
  settings.process_variance.setZero();
  settings.process_density.segment(2 * n_free, n_free).setConstant(100.0);
  for (const char* name : {"soft_tissue", "plates"}) {
    const Block& block = model.layout().block(name);
    settings.process_density.segment(block.offset, block.size).setConstant(1e-4);
    settings.decay_rate.segment(block.offset, block.size).setConstant(2.0);
  }
  settings.constraint = ConstraintKind::projection;
  settings.equality = Eigen::MatrixXd::Zero(2, n);
  settings.equality(0, 0) = 1.0;
  settings.equality(0, 1) = -1.0;
  settings.equality(1, 3 * n_free) = 1.0;
  settings.equality_value = settings.equality * model.initial_state();
  settings.upper = model.initial_state().array() + 0.002;
  settings.marker_gate = {6.6, 9.2, 11.3, 13.3, 15.1, 16.8};
  settings.wrench_gate = settings.marker_gate;
  settings.recovery.enabled = true;
  settings.iterate_beyond = 0.05;
  Eigen::MatrixXd P = prior_for(model);
  P.diagonal().tail(n - 3 * n_free) *= 0.01;  // inertia that markers and plates pull at, and that stays possible
  auto markers = markers_at(model, model.initial_state());
  markers.row(0).array() += 0.01;
  Filter filter(model, settings, model.initial_state(), P);
  int refused = 0, constrained = 0, iterated = 0;
  for (int k = 0; k < 40; ++k) {
    if (k == 10) markers.col(1).setConstant(std::nan(""));
    if (k == 20) markers.col(0).array() += 0.5;
    const Vector6 wrench = Vector6::Constant(k % 8 == 0 ? 1e5 : 10.0);
    iterated += filter.covariance().diagonal().head(n_free).maxCoeff() > 0.0025;
    const long before = allocations;
    const StepReport report = filter.step(0.01, markers, wrench);
    CHECK(allocations == before);
    CHECK(!report.broken() && report.tracking == Tracking::following);
    constrained += report.constrained;
    for (Verdict verdict : filter.verdicts()) refused += verdict == Verdict::refused;
  }
  CHECK(refused > 10 && constrained > 10 && iterated > 0);
}

// A motion that is lost and found again, and a marker that goes astray, on tape.
void check_recovery_allocates_nothing(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  FilterSettings settings = settings_for(model);
  settings.constraint = ConstraintKind::projection;
  settings.marker_gate = {6.6, 9.2, 11.3, 13.3, 15.1, 16.8};
  settings.recovery.enabled = true;
  settings.iterate_beyond = 0.05;
  const Eigen::VectorXd x = model.initial_state();
  Eigen::VectorXd turned = x;
  turned(0) += 1.5;
  Eigen::MatrixXd P = prior_for(model) * 0.01;
  auto markers = markers_at(model, x);
  const Vector6 no_wrench = Vector6::Constant(std::nan(""));
  Filter filter(model, settings, x, P);
  FrameTape tape(model.state_size(), filter.tape_rows());
  filter.record_to(&tape);
  int doubtful = 0, lost = 0, found = 0;
  for (int k = 0; k < 40; ++k) {
    if (k == 10) markers = markers_at(model, turned);
    if (k == 12)
      for (Eigen::Index m = 0; m < markers.cols(); ++m) markers(1, m) += 3.0 * static_cast<double>(m % 3);
    if (k == 20) markers = markers_at(model, turned);
    if (k == 30) markers.col(1).array() += 0.5;
    const long before = allocations;
    const StepReport report = filter.step(0.05, markers, no_wrench);
    CHECK(allocations == before);
    CHECK(!report.broken());
    doubtful += report.tracking == Tracking::doubtful;
    lost += report.tracking == Tracking::lost;
    found += report.tracking == Tracking::found;
  }
  CHECK(doubtful > 0 && lost > 0 && found > 0);
}

// Impossible inertia is cut back to possible one in each frame.
void check_keeping_inertia_possible_allocates_nothing(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  const FilterSettings settings = settings_for(model);
  Projection projection(model, settings);
  Eigen::MatrixXd P = prior_for(model);
  for (int k = 0; k < 10; ++k) {
    Eigen::VectorXd x = model.initial_state();
    const Block& block = model.layout().block("inertia");
    x(block.offset + 1) += 2.0 + 0.1 * k;  // first moment of the first segment
    CHECK(!projection.consistency().holds(x));
    const long before = allocations;
    const ProjectionReport report = projection.apply(x, P);
    CHECK(allocations == before);
    CHECK(report.solved && report.active > 0 && projection.consistency().holds(x));
  }
}

void check_moments_allocate_nothing(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  const Eigen::VectorXd x = model.initial_state();
  KinematicState kinematics(model);
  DynamicState dynamics(model);
  MomentWorkspace work(model);
  const std::vector<Force> external(model.segments().size(), {Vector3::Ones(), Vector3::Ones()});
  Eigen::MatrixXd jacobian(model.coordinates().size(), model.state_size());
  forward_kinematics(model, x, kinematics);
  subtree_dynamics(model, x, kinematics, dynamics);
  const long before = allocations;
  moment_jacobian(model, x, kinematics, dynamics, &external, work, jacobian);
  CHECK(allocations == before);
  CHECK(jacobian.allFinite() && jacobian.norm() > 0.0);
}

// All kinds of contact, with deviations, and the joints' loads.
void check_contacts_allocate_nothing(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  const Eigen::VectorXd x = model.initial_state();
  const Eigen::MatrixXd P = prior_for(model);
  KinematicState kinematics(model);
  DynamicState dynamics(model);
  forward_kinematics(model, x, kinematics);
  subtree_dynamics(model, x, kinematics, dynamics);
  ContactMoments contacts(model, {static_cast<int>(model.segments().size()) - 1, 0});
  ContactLoads loads(2, static_cast<std::size_t>(model.contacts()));
  loads.effects.setConstant(3.0);
  loads.covariance.topRightCorner(6, 6).setIdentity();  // errors that go together
  loads.covariance.topRightCorner(6, 6) *= -0.5;
  loads.covariance.bottomLeftCorner(6, 6) = loads.covariance.topRightCorner(6, 6);
  Eigen::VectorXd moments(model.coordinates().size());
  std::vector<double> moments_sd(model.coordinates().size()), wrench_sd(12);
  std::vector<Force> joints(model.segments().size());
  for (const Contact first : {Contact::none, Contact::measured, Contact::unmeasured, Contact::shared}) {
    loads.contact = {first, Contact::measured};
    const long before = allocations;
    CHECK(contacts.distribute(x, dynamics, loads));
    contacts.moments(kinematics, dynamics, moments);
    contacts.deviations(x, kinematics, dynamics, P, moments_sd.data(), wrench_sd.data());
    joint_loads(model, kinematics, dynamics, nullptr, joints);
    CHECK(allocations == before);
    CHECK(moments.allFinite() && contacts.remainder().norm() < 1e-9 && wrench_sd[6] > 0.0);
  }
}

// Bounds that bind, an equality, a gap; with the covariance, and what is reported of the state.
void check_fixed_lag_allocates_nothing(const dynakin::ModelSpec& spec) {
  using namespace dynakin;
  const Model model(spec);
  FilterSettings settings = settings_for(model);
  const Eigen::VectorXd x = model.initial_state();
  settings.constraint = ConstraintKind::projection;
  settings.upper = x.array() + 1e-3;
  settings.equality = Eigen::MatrixXd::Zero(1, x.size());
  settings.equality(0, 0) = settings.equality(0, 1) = 1.0;
  settings.equality_value = settings.equality * x;
  auto markers = markers_at(model, x);
  const Vector6 wrench = Vector6::Constant(10.0);
  Filter filter(model, settings, x, prior_for(model));
  FixedLag lag(filter, 5);
  const WrenchModel how = wrench_model_for(model);
  OutputDeviation deviation(model);
  std::vector<double> markers_sd(3 * model.markers().size()), moments_sd(model.coordinates().size()), wrench_sd(6);
  bool bound = false;
  for (int k = 0; k < 20; ++k) {
    if (k == 10) markers.col(1).setConstant(std::nan(""));
    const long before = allocations;
    const StepReport report = lag.step(0.01, markers, wrench, model.contacts() > 0 ? &how : nullptr);
    const Measurement& now = filter.evaluate();
    deviation.markers(now.kinematics(), filter.covariance(), markers_sd.data());
    deviation.wrench(now.kinematics(), now.dynamics(), filter.covariance(), wrench_sd.data());
    deviation.moments(filter.state(), now.kinematics(), now.dynamics(), filter.covariance(), moments_sd.data());
    const bool finite = !lag.ready() || lag.covariance().allFinite();
    CHECK(allocations == before);
    CHECK(!report.diverged() && finite && lag.state().allFinite());
    bound = bound || report.constrained > 0;
  }
  CHECK(lag.ready() && bound && moments_sd[0] > 0.0);
}

}  // namespace

TEST(the_counter_sees_allocations) {
  const long before = allocations;
  const Eigen::VectorXd by_eigen = Eigen::VectorXd::Zero(100);
  CHECK(allocations > before);
  const long between = allocations;
  void* volatile seen = ::operator new(8);  // volatile: else the compiler may leave the pair out
  ::operator delete(seen);
  CHECK(allocations > between && by_eigen.size() == 100);
}

TEST(a_planar_step_allocates_nothing) { check_no_allocation(planar_chain()); }
TEST(a_spatial_step_allocates_nothing) { check_no_allocation(spatial_tree()); }
TEST(a_step_with_contacts_allocates_nothing) {
  check_no_allocation(with_contact(planar_chain()));
  check_no_allocation(with_contact(spatial_tree()));
}
TEST(a_planar_step_with_everything_on_allocates_nothing) { check_no_allocation_with_everything_on(planar_chain()); }
TEST(a_spatial_step_with_everything_on_allocates_nothing) { check_no_allocation_with_everything_on(spatial_tree()); }
TEST(recovery_allocates_nothing) {
  check_recovery_allocates_nothing(planar_chain());
  check_recovery_allocates_nothing(spatial_tree());
}
TEST(keeping_inertia_possible_allocates_nothing) {
  check_keeping_inertia_possible_allocates_nothing(planar_chain());
  check_keeping_inertia_possible_allocates_nothing(spatial_tree());
}
TEST(the_moments_derivatives_allocate_nothing) {
  check_moments_allocate_nothing(planar_chain());
  check_moments_allocate_nothing(spatial_tree());
}
TEST(contacts_allocate_nothing) {
  check_contacts_allocate_nothing(planar_chain());
  check_contacts_allocate_nothing(spatial_tree());
  check_contacts_allocate_nothing(with_contact(planar_chain()));
  check_contacts_allocate_nothing(with_contact(spatial_tree()));
}
TEST(a_fixed_lag_allocates_nothing) {
  check_fixed_lag_allocates_nothing(planar_chain());
  check_fixed_lag_allocates_nothing(spatial_tree());
  check_fixed_lag_allocates_nothing(with_contact(spatial_tree()));
}
#endif
