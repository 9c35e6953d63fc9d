#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "dynakin/spec.hpp"
#include "module.hpp"

using namespace dynakin;

// Lists of specs are read as copies, and assigned back where they were changed: a reference to an element would dangle
// as soon as another list is assigned.
namespace {

// Pickling by the tuple of all fields.
template <class T, class... Fields>
void picklable(nb::class_<T>& cls, Fields T::*... fields) {
  cls.def("__getstate__", [=](const T& self) { return nb::make_tuple(self.*fields...); });
  cls.def("__setstate__", [=](T& self, const nb::tuple& state) {
    if (state.size() != sizeof...(fields)) throw nb::value_error("pickle of another version of this class");
    new (&self) T();
    std::size_t i = 0;
    ((self.*fields = nb::cast<Fields>(state[i++])), ...);
  });
}

AxisKind axis_kind(const std::string& name) {
  if (name == "rotation") return AxisKind::rotation;
  if (name == "translation") return AxisKind::translation;
  throw nb::value_error(("axis kind: expected 'rotation' or 'translation', found '" + name + "'").c_str());
}

std::string axis_kind_name(AxisKind kind) { return kind == AxisKind::rotation ? "rotation" : "translation"; }

constexpr std::pair<FunctionKind, const char*> function_kinds[] = {
    {FunctionKind::polynomial, "polynomial"},
    {FunctionKind::spline, "spline"},
    {FunctionKind::piecewise_linear, "piecewise_linear"}};

FunctionKind function_kind(const std::string& name) {
  for (const auto& [kind, known] : function_kinds)
    if (name == known) return kind;
  throw nb::value_error(
      ("function kind: expected 'polynomial', 'spline' or 'piecewise_linear', found '" + name + "'").c_str());
}

std::string function_kind_name(FunctionKind kind) { return function_kinds[static_cast<int>(kind)].second; }

void bind_function(nb::module_& m) {
  using Numbers = std::vector<double>;
  nb::class_<FunctionSpec> function(
      m, "FunctionSpec",
      "sum_k coefficients[k] x**k ('polynomial'), or a function through the points (x, y), straight on beyond them: "
      "'spline' (twice continuously differentiable cubics, as OpenSim's SimmSpline) or 'piecewise_linear'.");
  function
      .def(
          "__init__",
          [](FunctionSpec* self, const std::string& kind, Numbers coefficients, Numbers x, Numbers y) {
            new (self) FunctionSpec{function_kind(kind), std::move(coefficients), std::move(x), std::move(y)};
          },
          nb::arg("kind") = "polynomial", nb::arg("coefficients") = Numbers{}, nb::arg("x") = Numbers{},
          nb::arg("y") = Numbers{})
      .def_prop_rw(
          "kind", [](const FunctionSpec& f) { return function_kind_name(f.kind); },
          [](FunctionSpec& f, const std::string& name) { f.kind = function_kind(name); })
      .def_rw("coefficients", &FunctionSpec::coefficients)
      .def_rw("x", &FunctionSpec::x)
      .def_rw("y", &FunctionSpec::y);
  function.def("__getstate__", [](const FunctionSpec& f) {
    return nb::make_tuple(function_kind_name(f.kind), f.coefficients, f.x, f.y);
  });
  function.def("__setstate__", [](FunctionSpec& self, const nb::tuple& s) {
    new (&self) FunctionSpec{function_kind(nb::cast<std::string>(s[0])), nb::cast<Numbers>(s[1]),
                             nb::cast<Numbers>(s[2]), nb::cast<Numbers>(s[3])};
  });
}

void bind_axis(nb::module_& m) {
  nb::class_<AxisSpec> axis(m, "AxisSpec",
                            "One degree of freedom, s = scale * sum_k coefficients[k] u**k (rad or m); u is the "
                            "coordinate, or what the functions make of it one after the other.");
  axis.def(
          "__init__",
          [](AxisSpec* self, std::string coordinate, const std::string& kind, const Vector3& direction,
             std::vector<double> coefficients, std::string scale, std::vector<FunctionSpec> functions) {
            new (self) AxisSpec{std::move(coordinate),   axis_kind(kind),  direction,
                                std::move(coefficients), std::move(scale), std::move(functions)};
          },
          nb::arg("coordinate"), nb::arg("kind") = "rotation", nb::arg("direction") = Vector3(Vector3::UnitZ()),
          nb::arg("coefficients") = std::vector<double>{0.0, 1.0}, nb::arg("scale") = "",
          nb::arg("functions") = std::vector<FunctionSpec>{})
      .def_rw("coordinate", &AxisSpec::coordinate)
      .def_prop_rw(
          "kind", [](const AxisSpec& a) { return axis_kind_name(a.kind); },
          [](AxisSpec& a, const std::string& name) { a.kind = axis_kind(name); })
      .def_rw("direction", &AxisSpec::direction, nb::rv_policy::copy)
      .def_rw("coefficients", &AxisSpec::coefficients)
      .def_rw("scale", &AxisSpec::scale)
      .def_rw("functions", &AxisSpec::functions, nb::rv_policy::copy);
  axis.def("__getstate__", [](const AxisSpec& a) {
    return nb::make_tuple(a.coordinate, axis_kind_name(a.kind), a.direction, a.coefficients, a.scale, a.functions);
  });
  axis.def("__setstate__", [](AxisSpec& self, const nb::tuple& s) {
    new (&self) AxisSpec{nb::cast<std::string>(s[0]), axis_kind(nb::cast<std::string>(s[1])),
                         nb::cast<Vector3>(s[2]),     nb::cast<std::vector<double>>(s[3]),
                         nb::cast<std::string>(s[4]), nb::cast<std::vector<FunctionSpec>>(s[5])};
  });
}

}  // namespace

void bind_spec(nb::module_& m) {
  bind_function(m);
  bind_axis(m);

  nb::class_<LengthTerm> length(m, "LengthTerm", "Adds direction * parameter to a joint's placement in its parent.");
  length.def(nb::init<std::string, Vector3>(), nb::arg("parameter"), nb::arg("direction"))
      .def_rw("parameter", &LengthTerm::parameter)
      .def_rw("direction", &LengthTerm::direction, nb::rv_policy::copy);
  picklable(length, &LengthTerm::parameter, &LengthTerm::direction);

  nb::class_<SegmentSpec> segment(m, "SegmentSpec", "A rigid segment and the joint by which it hangs from its parent.");
  segment
      .def(nb::init<std::string, std::string, Matrix3, Vector3, std::vector<LengthTerm>, std::vector<AxisSpec>,
                    InertiaVector, std::array<bool, k_inertia_count>>(),
           nb::arg("name"), nb::arg("parent") = "ground", nb::arg("rotation") = Matrix3(Matrix3::Identity()),
           nb::arg("translation") = Vector3(Vector3::Zero()), nb::arg("lengths") = std::vector<LengthTerm>{},
           nb::arg("axes") = std::vector<AxisSpec>{}, nb::arg("inertia") = InertiaVector(InertiaVector::Zero()),
           nb::arg("inertia_estimated") = std::array<bool, k_inertia_count>{})
      .def_rw("name", &SegmentSpec::name)
      .def_rw("parent", &SegmentSpec::parent)
      .def_rw("rotation", &SegmentSpec::rotation, nb::rv_policy::copy)
      .def_rw("translation", &SegmentSpec::translation, nb::rv_policy::copy)
      .def_rw("lengths", &SegmentSpec::lengths, nb::rv_policy::copy)
      .def_rw("axes", &SegmentSpec::axes, nb::rv_policy::copy)
      .def_rw("inertia", &SegmentSpec::inertia, nb::rv_policy::copy)
      .def_rw("inertia_estimated", &SegmentSpec::inertia_estimated);
  picklable(segment, &SegmentSpec::name, &SegmentSpec::parent, &SegmentSpec::rotation, &SegmentSpec::translation,
            &SegmentSpec::lengths, &SegmentSpec::axes, &SegmentSpec::inertia, &SegmentSpec::inertia_estimated);

  nb::class_<CoordinateSpec> coordinate(m, "CoordinateSpec", "A generalised coordinate (rad or m).");
  coordinate
      .def(nb::init<std::string, double, bool>(), nb::arg("name"), nb::arg("value") = 0.0, nb::arg("locked") = false)
      .def_rw("name", &CoordinateSpec::name)
      .def_rw("value", &CoordinateSpec::value)
      .def_rw("locked", &CoordinateSpec::locked);
  picklable(coordinate, &CoordinateSpec::name, &CoordinateSpec::value, &CoordinateSpec::locked);

  nb::class_<ParameterSpec> parameter(m, "ParameterSpec", "A geometry parameter, such as a segment's length (m).");
  parameter.def(nb::init<std::string, double, bool>(), nb::arg("name"), nb::arg("value"), nb::arg("estimated") = true)
      .def_rw("name", &ParameterSpec::name)
      .def_rw("value", &ParameterSpec::value)
      .def_rw("estimated", &ParameterSpec::estimated);
  picklable(parameter, &ParameterSpec::name, &ParameterSpec::value, &ParameterSpec::estimated);

  using Flags3 = std::array<bool, 3>;
  nb::class_<MarkerSpec> marker(m, "MarkerSpec", "A marker site on a segment (m, segment frame).");
  marker
      .def(nb::init<std::string, std::string, Vector3, Flags3, Flags3, Flags3>(), nb::arg("name"), nb::arg("segment"),
           nb::arg("position"), nb::arg("measured") = Flags3{true, true, true},
           nb::arg("estimated") = Flags3{true, true, true}, nb::arg("soft_tissue") = Flags3{})
      .def_rw("name", &MarkerSpec::name)
      .def_rw("segment", &MarkerSpec::segment)
      .def_rw("position", &MarkerSpec::position, nb::rv_policy::copy)
      .def_rw("measured", &MarkerSpec::measured)
      .def_rw("estimated", &MarkerSpec::estimated)
      .def_rw("soft_tissue", &MarkerSpec::soft_tissue);
  picklable(marker, &MarkerSpec::name, &MarkerSpec::segment, &MarkerSpec::position, &MarkerSpec::measured,
            &MarkerSpec::estimated, &MarkerSpec::soft_tissue);

  using Flags6 = std::array<bool, 6>;
  nb::class_<ModelSpec> model(
      m, "ModelSpec",
      "A model as plain data; Model checks and compiles it. Its lists are read as copies: assign them back.");
  model
      .def(nb::init<std::string, std::vector<CoordinateSpec>, std::vector<ParameterSpec>, std::vector<SegmentSpec>,
                    std::vector<MarkerSpec>, Vector3, Flags6, Flags6, Vector3, bool, std::vector<std::string>>(),
           nb::arg("name"), nb::arg("coordinates"), nb::arg("parameters"), nb::arg("segments"), nb::arg("markers"),
           nb::arg("gravity") = Vector3(0.0, -9.80665, 0.0),
           nb::arg("wrench_measured") = Flags6{true, true, true, true, true, true}, nb::arg("wrench_offset") = Flags6{},
           nb::arg("wrench_offset_point") = Vector3(0.0, 0.0, 0.0), nb::arg("wrench_delay") = false,
           nb::arg("contacts") = std::vector<std::string>())
      .def_rw("name", &ModelSpec::name)
      .def_rw("coordinates", &ModelSpec::coordinates, nb::rv_policy::copy)
      .def_rw("parameters", &ModelSpec::parameters, nb::rv_policy::copy)
      .def_rw("segments", &ModelSpec::segments, nb::rv_policy::copy)
      .def_rw("markers", &ModelSpec::markers, nb::rv_policy::copy)
      .def_rw("gravity", &ModelSpec::gravity, nb::rv_policy::copy)
      .def_rw("wrench_measured", &ModelSpec::wrench_measured)
      .def_rw("wrench_offset", &ModelSpec::wrench_offset)
      .def_rw("wrench_offset_point", &ModelSpec::wrench_offset_point, nb::rv_policy::copy)
      .def_rw("wrench_delay", &ModelSpec::wrench_delay)
      .def_rw("contacts", &ModelSpec::contacts);
  picklable(model, &ModelSpec::name, &ModelSpec::coordinates, &ModelSpec::parameters, &ModelSpec::segments,
            &ModelSpec::markers, &ModelSpec::gravity, &ModelSpec::wrench_measured, &ModelSpec::wrench_offset,
            &ModelSpec::wrench_offset_point, &ModelSpec::wrench_delay, &ModelSpec::contacts);
}
