// A model as plain data: what a file says, before it is checked and compiled into a Model. Picklable, comparable by
// eye.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "dynakin/spatial.hpp"

namespace dynakin {

enum class AxisKind { rotation, translation };

enum class FunctionKind { polynomial, spline, piecewise_linear };

// sum_k coefficients[k] x^k, or a function through the points (x[k], y[k]), x increasing, that goes straight on beyond
// the outermost.
struct FunctionSpec {
  FunctionKind kind = FunctionKind::polynomial;
  std::vector<double> coefficients;
  std::vector<double> x, y;
};

// One degree of freedom: s = scale * sum_k coefficients[k] u^k, a rotation (rad) about or translation (m) along
// direction; u is the coordinate, or what the functions make of it one after the other.
struct AxisSpec {
  std::string coordinate;
  AxisKind kind = AxisKind::rotation;
  Vector3 direction = Vector3::UnitZ();
  std::vector<double> coefficients = {0.0, 1.0};
  std::string scale;  // a geometry parameter, or empty for 1
  std::vector<FunctionSpec> functions = {};
};

// Adds direction * (parameter) to the placement of a joint in its parent segment.
struct LengthTerm {
  std::string parameter;
  Vector3 direction = Vector3::UnitY();
};

// The ten numbers of a rigid body about its segment's origin; tensor entries as they stand, not products of inertia.
enum InertiaIndex { k_mass, k_mx, k_my, k_mz, k_ixx, k_iyy, k_izz, k_ixy, k_ixz, k_iyz, k_inertia_count };
inline constexpr std::array<const char*, k_inertia_count> inertia_names = {"mass", "mx",  "my",  "mz",  "ixx",
                                                                           "iyy",  "izz", "ixy", "ixz", "iyz"};
using InertiaVector = Eigen::Matrix<double, k_inertia_count, 1>;

struct SegmentSpec {
  std::string name;
  std::string parent = "ground";
  Matrix3 rotation = Matrix3::Identity();  // R_PJ: joint frame in the parent
  Vector3 translation = Vector3::Zero();   // joint origin in the parent, m, before the length terms
  std::vector<LengthTerm> lengths;
  std::vector<AxisSpec> axes;
  InertiaVector inertia = InertiaVector::Zero();
  std::array<bool, k_inertia_count> inertia_estimated{};
};

struct CoordinateSpec {
  std::string name;
  double value = 0.0;  // rad or m: where it starts, or where it is locked
  bool locked = false;
};

struct ParameterSpec {
  std::string name;
  double value = 0.0;  // m
  bool estimated = true;
};

struct MarkerSpec {
  std::string name;
  std::string segment;
  Vector3 position = Vector3::Zero();                  // m, in the segment frame
  std::array<bool, 3> measured = {true, true, true};   // ground axes that the recording measures
  std::array<bool, 3> estimated = {true, true, true};  // axes of the segment along which the place is estimated
  std::array<bool, 3> soft_tissue{};                   // axes along which it also moves with skin and muscle
};

struct ModelSpec {
  std::string name;
  std::vector<CoordinateSpec> coordinates;
  std::vector<ParameterSpec> parameters;
  std::vector<SegmentSpec> segments;  // a parent stands before its children
  std::vector<MarkerSpec> markers;
  Vector3 gravity{0.0, -9.80665, 0.0};  // m/s^2, ground frame
  std::array<bool, 6> wrench_measured = {true, true, true, true, true, true};
  std::array<bool, 6> wrench_offset{};  // components whose slow error, about wrench_offset_point, is estimated
  Vector3 wrench_offset_point = Vector3::Zero();  // m, ground frame
  bool wrench_delay = false;                      // whether the plates' delay behind the markers is estimated
  // Contacts whose wrench on the person is a state where no plate measures it: six numbers each, of unit variance, that
  // a WrenchModel turns into newtons.
  std::vector<std::string> contacts = {};
};

}  // namespace dynakin
