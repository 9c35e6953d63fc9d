// The compiled model: a tree of segments joined by chains of 1-DoF axes. Checked once, never changed afterwards.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "dynakin/axis_function.hpp"
#include "dynakin/spec.hpp"
#include "dynakin/state_layout.hpp"

namespace dynakin {

inline constexpr int k_none = -1;  // no such column, parent or parameter

struct Axis {
  AxisKind kind;
  Vector3 direction;  // unit, in the joint frame moved along by the axes before
  int coordinate;
  AxisFunction function;
};

struct Placement {
  int parameter;
  Vector3 direction;  // in the parent segment
};

struct Segment {
  std::string name;
  int parent;  // k_none: the ground
  Matrix3 rotation;
  Vector3 translation;
  std::vector<Placement> lengths;
  int first_axis, end_axis;  // range in Model::axes()
  InertiaVector inertia;
  std::array<int, k_inertia_count> inertia_column;  // in x, k_none where fixed
};

struct Marker {
  std::string name;
  int segment;
  Vector3 position;
  std::array<int, 3> column;       // in x, k_none where fixed
  std::array<int, 3> soft_tissue;  // columns of its displacement from there, k_none where it has none
  std::array<bool, 3> measured;
  int n_measured;
};

struct Coordinate {
  std::string name;
  double value;
  int index;  // among the free ones, k_none when locked
};

struct Parameter {
  std::string name;
  double value;
  int column;  // in x, k_none where fixed
};

class Model {
 public:
  // Throws std::invalid_argument naming the key, what was found and what was expected.
  explicit Model(const ModelSpec& spec);

  const ModelSpec& spec() const { return spec_; }
  const StateLayout& layout() const { return layout_; }
  int state_size() const { return layout_.size(); }
  int n_free() const { return n_free_; }

  const std::vector<Axis>& axes() const { return axes_; }
  const std::vector<Segment>& segments() const { return segments_; }
  const std::vector<Marker>& markers() const { return markers_; }
  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }

  // Columns of x in which a marker's rows or the wrench's rows can differ from zero, in increasing order.
  const std::vector<int>& marker_columns(int marker) const { return marker_columns_[marker]; }
  const std::vector<int>& wrench_columns() const { return wrench_columns_; }
  const std::vector<int>& mass_columns() const { return mass_columns_; }
  // Columns of the plates' slow error and of their delay, k_none where they are not estimated.
  const std::array<int, 6>& offset_columns() const { return offset_columns_; }
  int delay_column() const { return delay_column_; }
  // Column of the first of six numbers of a contact, k_none of one that the spec does not name.
  int contact_column(int contact) const { return contact < contacts() ? contacts_column_ + 6 * contact : k_none; }
  int contacts() const { return static_cast<int>(spec_.contacts.size()); }

  int coordinate_column(int coordinate) const { return coordinates_[coordinate].index; }
  int speed_column(int coordinate) const { return shifted(coordinate, n_free_); }
  int acceleration_column(int coordinate) const { return shifted(coordinate, 2 * n_free_); }

  Eigen::VectorXd initial_state() const;  // the spec's values; speeds and accelerations zero

 private:
  int shifted(int coordinate, int by) const {
    const int i = coordinates_[coordinate].index;
    return i == k_none ? k_none : i + by;
  }
  void compile_coordinates();
  void compile_parameters();
  void compile_segments();
  void compile_markers();
  void compile_soft_tissue();
  void compile_plates();
  void compile_contacts();
  void compile_columns();

  ModelSpec spec_;
  StateLayout layout_;
  int n_free_ = 0;
  std::vector<Axis> axes_;
  std::vector<Segment> segments_;
  std::vector<Marker> markers_;
  std::vector<Coordinate> coordinates_;
  std::vector<Parameter> parameters_;
  std::vector<std::vector<int>> marker_columns_;
  std::vector<int> wrench_columns_, mass_columns_;
  std::array<int, 6> offset_columns_{};
  int delay_column_ = k_none, contacts_column_ = k_none;
};

}  // namespace dynakin
