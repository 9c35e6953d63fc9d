#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>

#include "arrays.hpp"
#include "contacts.hpp"
#include "module.hpp"

using namespace dynakin;

namespace {

using Codes = nb::ndarray<const std::uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

std::string shape(std::initializer_list<std::size_t> sizes) {
  std::string text;
  for (const std::size_t size : sizes) text += (text.empty() ? "(" : ", ") + std::to_string(size);
  return text + ")";
}

PyContactLoads contact_loads(std::vector<std::string> segments, const Array3& wrench, const Array3& covariance,
                             const Codes& contact, const std::optional<Array3>& effects) {
  const std::size_t n = segments.size(), frames = wrench.shape(0);
  if (wrench.shape(1) != n || wrench.shape(2) != 6)
    throw std::invalid_argument("wrench: expected " + shape({frames, n, 6}));
  if (covariance.shape(0) != frames || covariance.shape(1) != 6 * n || covariance.shape(2) != 6 * n)
    throw std::invalid_argument("covariance: expected " + shape({frames, 6 * n, 6 * n}));
  if (contact.shape(0) != frames || contact.shape(1) != n)
    throw std::invalid_argument("contact: expected " + shape({frames, n}));
  const std::size_t states = effects ? effects->shape(2) / 6 : 0;
  if (effects &&
      (effects->shape(0) != frames || effects->shape(1) != 6 || effects->shape(2) != 6 * states || states > n))
    throw std::invalid_argument("effects: expected " + shape({frames, 6, 6 * n}) + " or fewer columns, six a contact");
  PyContactLoads out;
  out.names = std::move(segments);
  out.trial.frames = frames;
  out.trial.wrench.assign(wrench.data(), wrench.data() + wrench.size());
  out.trial.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  out.trial.states = states;
  if (effects) out.trial.effects.assign(effects->data(), effects->data() + effects->size());
  for (std::size_t i = 0; i < contact.size(); ++i) {
    if (contact.data()[i] > static_cast<std::uint8_t>(Contact::shared))
      throw std::invalid_argument("contact: expected 0 (none), 1 (measured), 2 (unmeasured) or 3 (shared), found " +
                                  std::to_string(contact.data()[i]));
    out.trial.contact.push_back(static_cast<Contact>(contact.data()[i]));
  }
  return out;
}

struct AtFrames {
  AtFrames(const Model& model, const StateRef& x) : kinematics(model), dynamics(model) {
    if (x.size() != model.state_size())
      throw std::invalid_argument("x: expected " + std::to_string(model.state_size()) + " numbers, found " +
                                  std::to_string(x.size()));
    set(model, x);
  }
  void set(const Model& model, const StateRef& x) {
    forward_kinematics(model, x, kinematics);
    subtree_dynamics(model, x, kinematics, dynamics);
  }
  KinematicState kinematics;
  DynamicState dynamics;
};

void check_frame(const PyContactLoads& loads, std::size_t frame) {
  if (frame >= loads.trial.frames)
    throw std::invalid_argument("frame: " + std::to_string(frame) + ", expected less than " +
                                std::to_string(loads.trial.frames));
}

nb::dict contact_moments(const Model& model, const StateRef& x, const PyContactLoads& loads, std::size_t frame,
                         const std::optional<Eigen::MatrixXd>& P, bool jacobian) {
  const AtFrames at(model, x);
  check_frame(loads, frame);
  if (P && (P->rows() != x.size() || P->cols() != x.size()))
    throw std::invalid_argument("covariance: expected " + shape({std::size_t(x.size()), std::size_t(x.size())}));
  ContactTrial one = loads.of(model);
  const std::size_t feet = one.segments.size(), nc = model.coordinates().size();
  const auto keep = [&](auto& values, std::size_t each) {
    values.assign(values.begin() + static_cast<std::ptrdiff_t>(frame * each),
                  values.begin() + static_cast<std::ptrdiff_t>((frame + 1) * each));
  };
  keep(one.wrench, 6 * feet);
  keep(one.covariance, 36 * feet * feet);
  keep(one.effects, 36 * one.states);
  keep(one.contact, feet);
  one.frames = 1;
  ContactRecord record(model, one);
  std::vector<double> moments(nc), moments_sd(P ? nc : 0);
  record.report(0, x, at.kinematics, at.dynamics, moments.data());
  if (P) record.deviations(0, x, at.kinematics, at.dynamics, *P, moments_sd.data());
  nb::dict out;
  out["moments"] = owned(std::move(moments), {nc});
  if (jacobian) {
    Eigen::MatrixXd J(nc, model.state_size());
    record.moments.jacobian(x, at.kinematics, at.dynamics, J);
    out["jacobian"] = RowMatrix(J);
  }
  out["foot_wrench"] = owned(std::move(record.wrench), {feet, 6});
  out["foot_adjustment"] = owned(std::move(record.adjustment), {feet, 6});
  out["remainder"] = owned(std::move(record.remainder), {6});
  out["moment_source"] = owned(std::move(record.source), {nc});
  if (P) {
    out["moments_sd"] = owned(std::move(moments_sd), {nc});
    out["foot_wrench_sd"] = owned(std::move(record.wrench_sd), {feet, 6});
  }
  return out;
}

nb::dict whole_body(const Model& model, const Array2& states, const std::vector<std::string>& segments,
                    const std::optional<Array3>& wrench) {
  const std::size_t frames = states.shape(0), n = model.state_size(), ns = model.segments().size();
  if (states.shape(1) != n) throw std::invalid_argument("states: expected " + shape({frames, n}));
  const std::vector<int> feet = segment_indices(model, segments);
  if (!feet.empty() && !wrench) throw std::invalid_argument("foot_wrench: expected one a segment named");
  if (wrench && (wrench->shape(0) != frames || wrench->shape(1) != feet.size() || wrench->shape(2) != 6))
    throw std::invalid_argument("foot_wrench: expected " + shape({frames, feet.size(), 6}));
  std::vector<double> centre(3 * frames), velocity(3 * frames), mass(frames), origins(3 * ns * frames),
      rotations(9 * ns * frames), loads(6 * ns * frames);
  {
    nb::gil_scoped_release release;
    AtFrames at(model, Eigen::Map<const Eigen::VectorXd>(states.data(), frames ? static_cast<Eigen::Index>(n) : 0));
    std::vector<Force> external(ns), joints(ns);
    for (std::size_t k = 0; k < frames; ++k) {
      at.set(model, Eigen::Map<const Eigen::VectorXd>(states.data() + k * n, static_cast<Eigen::Index>(n)));
      const MassCentre c = mass_centre(model, at.dynamics);
      Eigen::Map<Vector3>(centre.data() + 3 * k) = c.position;
      Eigen::Map<Vector3>(velocity.data() + 3 * k) = c.velocity;
      mass[k] = at.dynamics.mass;
      std::fill(external.begin(), external.end(), Force{});
      for (std::size_t i = 0; i < feet.size(); ++i) {
        const double* w = wrench->data() + 6 * (k * feet.size() + i);
        external[feet[i]] += {Eigen::Map<const Vector3>(w), Eigen::Map<const Vector3>(w + 3)};
      }
      joint_loads(model, at.kinematics, at.dynamics, &external, joints);
      for (std::size_t i = 0; i < ns; ++i) {
        const std::size_t here = k * ns + i;
        Eigen::Map<Vector3>(origins.data() + 3 * here) = at.kinematics.segments[i].p_GB;
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotations.data() + 9 * here) =
            at.kinematics.segments[i].R_GB;
        Eigen::Map<Vector6>(loads.data() + 6 * here) = joints[i].vector();
      }
    }
  }
  nb::dict out;
  out["mass_centre"] = owned(std::move(centre), {frames, 3});
  out["mass_centre_velocity"] = owned(std::move(velocity), {frames, 3});
  out["mass"] = owned(std::move(mass), {frames});
  out["joint_centres"] = owned(std::move(origins), {frames, ns, 3});
  out["orientations"] = owned(std::move(rotations), {frames, ns, 3, 3});
  out["joint_loads"] = owned(std::move(loads), {frames, ns, 6});
  return out;
}

}  // namespace

std::vector<int> segment_indices(const Model& model, const std::vector<std::string>& names) {
  std::vector<int> found;
  for (const std::string& name : names) {
    const auto& segments = model.segments();
    const auto at = std::find_if(segments.begin(), segments.end(), [&](const Segment& s) { return s.name == name; });
    if (at == segments.end()) {
      std::string known;
      for (const Segment& s : segments) known += (known.empty() ? "" : ", ") + s.name;
      throw std::invalid_argument("feet: no segment '" + name + "', expected one of " + known);
    }
    found.push_back(static_cast<int>(at - segments.begin()));
  }
  return found;
}

void bind_contacts(nb::module_& m) {
  nb::class_<PyContactLoads>(
      m, "ContactLoads", "Wrenches of contacts over a trial as they are expected, how sure that is, and what touches.")
      .def(
          "__init__",
          [](PyContactLoads* self, std::vector<std::string> segments, const Array3& wrench, const Array3& covariance,
             const Codes& contact, const std::optional<Array3>& effects) {
            new (self) PyContactLoads(contact_loads(std::move(segments), wrench, covariance, contact, effects));
          },
          nb::arg("segments"), nb::arg("wrench"), nb::arg("covariance"), nb::arg("contact"),
          nb::arg("effects") = nb::none(),
          "segments: a name a contact. wrench (T, C, 6) N and N m, on the person, about the ground origin; covariance "
          "(T, 6 C, 6 C), that of the sum positive definite; contact (T, C) uint8: 0 nothing touches, 1 on a plate, 2 "
          "not measured, 3 on a plate with another contact; effects (T, 6, 6 K): what the six states of each of the "
          "first K "
          "contacts add to its wrench, where the model has them. Raises ValueError for other shapes or codes.");
  m.def("contact_moments", &contact_moments, nb::arg("model"), nb::arg("x"), nb::arg("loads"), nb::arg("frame") = 0,
        nb::arg("covariance") = nb::none(), nb::arg("jacobian") = false,
        "Joint moments with the contacts' wrenches of one frame, changed as little as their covariance allows to give "
        "the wrench that x needs. A dict: moments (J,), N m or N; where asked jacobian, d moments / dx (J, n); "
        "foot_wrench (C, 6) "
        "as used; foot_adjustment (C, 6), its change; remainder (6,) that no contact gives; moment_source (J,): 0 "
        "measured, 1 derived from the motion, 2 divided by a prior; with the covariance (n, n) of x also moments_sd, "
        "foot_wrench_sd.");
  m.def(
      "whole_body", &whole_body, nb::arg("model"), nb::arg("states"), nb::arg("segments") = std::vector<std::string>(),
      nb::arg("foot_wrench") = nb::none(),
      "Of states (T, n), with the wrenches foot_wrench (T, F, 6) on the named segments: mass (T,) kg, mass_centre and "
      "mass_centre_velocity (T, 3), joint_centres (T, S, 3) and orientations (T, S, 3, 3) R_GB of the segments, and "
      "joint_loads (T, S, 6): force and moment of the parent on each segment, ground axes, about its joint centre.");
}
