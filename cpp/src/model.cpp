#include "dynakin/model.hpp"

#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

namespace dynakin {
namespace {

[[noreturn]] void fail(const std::string& message) { throw std::invalid_argument(message); }

template <class Items>
std::string listed(const Items& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : ", ") + item.name;
  return text.empty() ? "none" : text;
}

template <class Items>
int find(const Items& items, const std::string& name, const std::string& where, const std::string& kind) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<int>(i);
  fail(where + ": no " + kind + " '" + name + "' (there is: " + listed(items) + ")");
}

template <class Items>
void check_names(const Items& items, const std::string& kind) {
  std::set<std::string> seen;
  for (const auto& item : items) {
    if (item.name.empty()) fail(kind + " without a name");
    if (!seen.insert(item.name).second) fail(kind + " '" + item.name + "' is declared twice");
  }
}

template <class Derived>
void check_finite(const Eigen::MatrixBase<Derived>& value, const std::string& where) {
  if (!value.allFinite()) fail(where + ": not a finite number");
}

Vector3 unit(const Vector3& direction, const std::string& where) {
  check_finite(direction, where);
  if (std::abs(direction.norm() - 1.0) > 1e-9)
    fail(where + ": expected a unit vector, its length is " + std::to_string(direction.norm()));
  return direction;
}

constexpr const char* axis_names[3] = {"x", "y", "z"};
constexpr const char* component_names[6] = {"fx", "fy", "fz", "mx", "my", "mz"};

std::vector<int> sorted(const std::set<int>& columns) {
  std::vector<int> list;
  for (int c : columns)
    if (c != k_none) list.push_back(c);
  return list;
}

}  // namespace

Model::Model(const ModelSpec& spec) : spec_(spec) {
  check_names(spec.coordinates, "coordinate");
  check_names(spec.parameters, "geometry parameter");
  check_names(spec.segments, "segment");
  check_names(spec.markers, "marker");
  check_finite(spec.gravity, "gravity");
  if (spec.segments.empty()) fail("model '" + spec.name + "' has no segment");
  compile_coordinates();
  compile_parameters();
  compile_markers();
  compile_soft_tissue();
  compile_segments();
  compile_plates();
  compile_contacts();
  compile_columns();
}

void Model::compile_coordinates() {
  std::vector<std::string> position, speed, acceleration;
  for (const CoordinateSpec& c : spec_.coordinates) {
    if (!std::isfinite(c.value)) fail("coordinate '" + c.name + "': value is not a finite number");
    coordinates_.push_back({c.name, c.value, c.locked ? k_none : n_free_});
    if (c.locked) continue;
    ++n_free_;
    position.push_back(c.name);
    speed.push_back(c.name + "/speed");
    acceleration.push_back(c.name + "/acceleration");
  }
  layout_.append("coordinates", position);
  layout_.append("speeds", speed);
  layout_.append("accelerations", acceleration);
}

void Model::compile_parameters() {
  std::vector<std::string> names;
  for (const ParameterSpec& p : spec_.parameters) {
    if (!std::isfinite(p.value)) fail("geometry parameter '" + p.name + "': value is not a finite number");
    parameters_.push_back({p.name, p.value, p.estimated ? layout_.size() + static_cast<int>(names.size()) : k_none});
    if (p.estimated) names.push_back("length/" + p.name);
  }
  layout_.append("lengths", names);
}

void Model::compile_markers() {
  std::vector<std::string> names;
  for (const MarkerSpec& m : spec_.markers) {
    const std::string where = "marker '" + m.name + "'";
    check_finite(m.position, where + ": position");
    Marker marker{m.name, find(spec_.segments, m.segment, where, "segment"), m.position, {}, {}, m.measured, 0};
    for (int k = 0; k < 3; ++k) {
      marker.n_measured += m.measured[k];
      marker.column[k] = m.estimated[k] ? layout_.size() + static_cast<int>(names.size()) : k_none;
      if (m.estimated[k]) names.push_back("marker/" + m.name + "/" + axis_names[k]);
    }
    markers_.push_back(marker);
  }
  layout_.append("markers", names);
}

void Model::compile_soft_tissue() {
  std::vector<std::string> names;
  for (std::size_t m = 0; m < markers_.size(); ++m)
    for (int k = 0; k < 3; ++k) {
      const bool moves = spec_.markers[m].soft_tissue[k];
      markers_[m].soft_tissue[k] = moves ? layout_.size() + static_cast<int>(names.size()) : k_none;
      if (moves) names.push_back("soft_tissue/" + markers_[m].name + "/" + axis_names[k]);
    }
  layout_.append("soft_tissue", names);
}

void Model::compile_contacts() {
  std::vector<std::string> names;
  if (!spec_.contacts.empty()) contacts_column_ = layout_.size();
  for (const std::string& contact : spec_.contacts)
    for (const char* component : component_names) names.push_back("contact/" + contact + "/" + component);
  layout_.append("contacts", names);
}

void Model::compile_plates() {
  std::vector<std::string> names;
  for (int k = 0; k < 6; ++k) {
    offset_columns_[k] = spec_.wrench_offset[k] ? layout_.size() + static_cast<int>(names.size()) : k_none;
    if (spec_.wrench_offset[k]) names.push_back(std::string("plates/") + component_names[k]);
  }
  if (spec_.wrench_delay) {
    delay_column_ = layout_.size() + static_cast<int>(names.size());
    names.push_back("plates/delay");
  }
  layout_.append("plates", names);
}

void Model::compile_segments() {
  std::vector<std::string> names;
  std::set<int> driven;
  for (const SegmentSpec& s : spec_.segments) {
    const std::string where = "segment '" + s.name + "'";
    Segment segment;
    segment.name = s.name;
    if (s.name == "ground") fail("segment 'ground': the name stands for the ground itself");
    segment.parent = s.parent == "ground" ? k_none : find(segments_, s.parent, where + ": parent", "earlier segment");
    check_finite(s.rotation, where + ": rotation");
    if (!(s.rotation * s.rotation.transpose()).isIdentity(1e-9) || s.rotation.determinant() < 0.0)
      fail(where + ": rotation is not a rotation matrix");
    check_finite(s.translation, where + ": translation");
    check_finite(s.inertia, where + ": inertia");
    if (s.inertia(k_mass) < 0.0)
      fail(where + ": mass is " + std::to_string(s.inertia(k_mass)) + " kg, expected 0 or more");
    segment.rotation = s.rotation;
    segment.translation = s.translation;
    for (const LengthTerm& t : s.lengths) {
      check_finite(t.direction, where + ": direction of length '" + t.parameter + "'");
      segment.lengths.push_back({find(spec_.parameters, t.parameter, where, "geometry parameter"), t.direction});
    }
    segment.first_axis = static_cast<int>(axes_.size());
    for (const AxisSpec& a : s.axes) {
      const std::string axis = where + ": axis of '" + a.coordinate + "'";
      const int coordinate = find(spec_.coordinates, a.coordinate, axis, "coordinate");
      driven.insert(coordinate);
      if (a.coefficients.empty()) fail(axis + ": no coefficients");
      for (double c : a.coefficients)
        if (!std::isfinite(c)) fail(axis + ": a coefficient is not a finite number");
      const int scale = a.scale.empty() ? k_none : find(spec_.parameters, a.scale, axis, "geometry parameter");
      std::vector<ScalarFunction> inner;
      for (const FunctionSpec& f : a.functions) inner.emplace_back(f, axis);
      axes_.push_back(
          {a.kind, unit(a.direction, axis), coordinate, AxisFunction(a.coefficients, scale, std::move(inner))});
    }
    segment.end_axis = static_cast<int>(axes_.size());
    segment.inertia = s.inertia;
    for (int k = 0; k < k_inertia_count; ++k) {
      segment.inertia_column[k] = s.inertia_estimated[k] ? layout_.size() + static_cast<int>(names.size()) : k_none;
      if (s.inertia_estimated[k]) names.push_back("inertia/" + s.name + "/" + inertia_names[k]);
      if (k == k_mass) mass_columns_.push_back(segment.inertia_column[k]);
    }
    segments_.push_back(segment);
  }
  layout_.append("inertia", names);
  std::erase(mass_columns_, k_none);
  for (std::size_t i = 0; i < coordinates_.size(); ++i)
    if (!driven.count(static_cast<int>(i))) fail("coordinate '" + coordinates_[i].name + "' moves no axis");
}

void Model::compile_columns() {
  // What moves each segment's frame: its own joint's columns and those of all segments it hangs from.
  std::vector<std::set<int>> geometry(segments_.size());
  std::set<int> wrench;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& s = segments_[i];
    if (s.parent != k_none) geometry[i] = geometry[s.parent];
    for (const Placement& t : s.lengths) geometry[i].insert(parameters_[t.parameter].column);
    for (int a = s.first_axis; a < s.end_axis; ++a) {
      geometry[i].insert(coordinate_column(axes_[a].coordinate));
      if (const int scale = axes_[a].function.scale_parameter(); scale != k_none)
        geometry[i].insert(parameters_[scale].column);
      wrench.insert(speed_column(axes_[a].coordinate));
      wrench.insert(acceleration_column(axes_[a].coordinate));
    }
    wrench.insert(geometry[i].begin(), geometry[i].end());
    wrench.insert(s.inertia_column.begin(), s.inertia_column.end());
  }
  wrench.insert(offset_columns_.begin(), offset_columns_.end());
  wrench.insert(delay_column_);
  for (int k = 0; k < 6 * contacts(); ++k) wrench.insert(contacts_column_ + k);
  wrench_columns_ = sorted(wrench);
  for (const Marker& m : markers_) {
    std::set<int> columns = geometry[m.segment];
    columns.insert(m.column.begin(), m.column.end());
    columns.insert(m.soft_tissue.begin(), m.soft_tissue.end());
    marker_columns_.push_back(sorted(columns));
  }
}

Eigen::VectorXd Model::initial_state() const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(state_size());
  for (const Coordinate& c : coordinates_)
    if (c.index != k_none) x(c.index) = c.value;
  for (const Parameter& p : parameters_)
    if (p.column != k_none) x(p.column) = p.value;
  for (const Marker& m : markers_)
    for (int k = 0; k < 3; ++k)
      if (m.column[k] != k_none) x(m.column[k]) = m.position(k);
  for (const Segment& s : segments_)
    for (int k = 0; k < k_inertia_count; ++k)
      if (s.inertia_column[k] != k_none) x(s.inertia_column[k]) = s.inertia(k);
  return x;
}

}  // namespace dynakin
