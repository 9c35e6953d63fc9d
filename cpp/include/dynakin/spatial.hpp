// Spatial vectors about the ground origin, linear part first, and the inertia of a rigid body seen from there.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dynakin {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

// Velocity, acceleration or screw of a joint axis: lin is that of the body-fixed point now at the ground origin.
struct Motion {
  Vector3 lin = Vector3::Zero();
  Vector3 ang = Vector3::Zero();

  Motion operator+(const Motion& b) const { return {lin + b.lin, ang + b.ang}; }
  Motion operator*(double s) const { return {lin * s, ang * s}; }
  Motion& operator+=(const Motion& b) {
    lin += b.lin;
    ang += b.ang;
    return *this;
  }
  // Spatial cross product v x m.
  Motion cross(const Motion& m) const { return {ang.cross(m.lin) + lin.cross(m.ang), ang.cross(m.ang)}; }
  // Velocity of the point p when the motion is a twist.
  Vector3 at(const Vector3& p) const { return lin + ang.cross(p); }
};

// Force and moment about the ground origin.
struct Force {
  Vector3 lin = Vector3::Zero();
  Vector3 ang = Vector3::Zero();

  Force operator+(const Force& b) const { return {lin + b.lin, ang + b.ang}; }
  Force operator-(const Force& b) const { return {lin - b.lin, ang - b.ang}; }
  Force& operator+=(const Force& b) {
    lin += b.lin;
    ang += b.ang;
    return *this;
  }
  Vector6 vector() const {
    Vector6 w;
    w << lin, ang;
    return w;
  }
};

// v x* f
inline Force cross_dual(const Motion& v, const Force& f) {
  return {v.ang.cross(f.lin), v.ang.cross(f.ang) + v.lin.cross(f.lin)};
}

inline double dot(const Motion& m, const Force& f) { return m.lin.dot(f.lin) + m.ang.dot(f.ang); }

// Mass, first moment and inertia about the ground origin; a sum of bodies is the sum of these.
struct SpatialInertia {
  double mass = 0.0;
  Vector3 first_moment = Vector3::Zero();
  Matrix3 inertia = Matrix3::Zero();

  SpatialInertia& operator+=(const SpatialInertia& b) {
    mass += b.mass;
    first_moment += b.first_moment;
    inertia += b.inertia;
    return *this;
  }
  Force operator*(const Motion& m) const {
    return {mass * m.lin + m.ang.cross(first_moment), first_moment.cross(m.lin) + inertia * m.ang};
  }
};

// B = v x* I - I v x + (I v) xbar*: how a body's force answers a change of velocity. In the ground frame its columns
// for linear motion vanish, so three numbers of momentum and a 3x3 matrix carry it (docs/derivations.md, section 4).
struct VelocityResponse {
  Vector3 momentum = Vector3::Zero();
  Matrix3 angular = Matrix3::Zero();

  VelocityResponse() = default;
  VelocityResponse(const SpatialInertia& I, const Motion& v)
      : momentum((I * v).lin),
        angular(skew(v.ang) * (2.0 * I.inertia - I.inertia.trace() * Matrix3::Identity()) +
                2.0 * v.lin.dot(I.first_moment) * Matrix3::Identity() - 2.0 * v.lin * I.first_moment.transpose()) {}

  VelocityResponse& operator+=(const VelocityResponse& b) {
    momentum += b.momentum;
    angular += b.angular;
    return *this;
  }
  Force operator*(const Motion& m) const { return {2.0 * m.ang.cross(momentum), angular * m.ang}; }
};

}  // namespace dynakin
