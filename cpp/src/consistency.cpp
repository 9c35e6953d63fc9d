#include "dynakin/consistency.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dynakin/dynamics.hpp"

namespace dynakin {
namespace {

// Nothing out of the plane is estimated or measured. Where it is measured, the numbers that are not estimated count
// too.
bool is_planar(const Model& model, const Segment& segment) {
  const auto& measured = model.spec().wrench_measured;
  if (measured[2] || measured[3] || measured[4]) return false;
  for (int k : {k_mz, k_ixx, k_iyy, k_ixy, k_ixz, k_iyz})
    if (segment.inertia_column[k] != k_none) return false;
  return true;
}

}  // namespace

Consistency::Consistency(const Model& model) : model_(model) {
  for (std::size_t i = 0; i < model.segments().size(); ++i) {
    const Segment& segment = model.segments()[i];
    const auto& columns = segment.inertia_column;
    if (std::all_of(columns.begin(), columns.end(), [](int c) { return c == k_none; })) continue;
    Body body{static_cast<int>(i), is_planar(model, segment), Eigen::Vector4d::Ones(), margin};
    // The diagonal of J at the start sets the units; a body without extent keeps ones.
    const Eigen::Vector4d diagonal = pseudo_inertia(body, segment.inertia).diagonal();
    for (int k = 0; k < 4; ++k) body.scale(k) = diagonal(k) > 0.0 ? 1.0 / std::sqrt(diagonal(k)) : 1.0;
    // A start that is itself closer to impossible than the margin may stay where it is.
    const Eigen::SelfAdjointEigenSolver<Matrix4> eigen(pseudo_inertia(body, segment.inertia), Eigen::EigenvaluesOnly);
    body.margin = std::max(std::min(margin, 0.5 * eigen.eigenvalues()(0)), 1e-12);
    estimated_.push_back(body);
  }
}

// Linear in phi. Space: [Sigma h; h' m] with Sigma = tr(I)/2 1 - I. Plane: [izz mx my; mx m 0; my 0 m], padded by a
// one.
Consistency::Matrix4 Consistency::pseudo_inertia(const Body& body, const InertiaVector& phi) const {
  Matrix4 J = Matrix4::Zero();
  const Vector3 h = phi.segment<3>(k_mx);
  if (body.planar) {
    J.diagonal() << phi(k_izz), phi(k_mass), phi(k_mass), 0.0;
    J(0, 1) = J(1, 0) = h.x();
    J(0, 2) = J(2, 0) = h.y();
  } else {
    const double half = 0.5 * (phi(k_ixx) + phi(k_iyy) + phi(k_izz));
    J.diagonal() << half - phi(k_ixx), half - phi(k_iyy), half - phi(k_izz), phi(k_mass);
    J(0, 1) = J(1, 0) = -phi(k_ixy);
    J(0, 2) = J(2, 0) = -phi(k_ixz);
    J(1, 2) = J(2, 1) = -phi(k_iyz);
    J.topRightCorner<3, 1>() = h;
    J.bottomLeftCorner<1, 3>() = h.transpose();
  }
  J = body.scale.asDiagonal() * J * body.scale.asDiagonal();
  if (body.planar) J(3, 3) = 1.0;
  return J;
}

double Consistency::smallest_eigenvalue(int body, const Eigen::VectorXd& x) const {
  const Matrix4 J = pseudo_inertia(estimated_[body], inertia_of(model_.segments()[estimated_[body].segment], x));
  return Eigen::SelfAdjointEigenSolver<Matrix4>(J, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

bool Consistency::holds(const Eigen::VectorXd& x) const {
  for (int b = 0; b < size(); ++b)
    if (!(smallest_eigenvalue(b, x) > 0.0)) return false;
  return true;
}

bool Consistency::cut(int which, const Eigen::VectorXd& x, HalfSpace& out) const {
  const Body& body = estimated_[which];
  const InertiaVector phi = inertia_of(model_.segments()[body.segment], x);
  Matrix4 J = pseudo_inertia(body, phi);
  J.diagonal().array() -= body.margin * tolerated / margin;
  if (J.llt().info() == Eigen::Success) return false;  // far cheaper than the eigenvalues, and the usual case
  const Eigen::SelfAdjointEigenSolver<Matrix4> eigen(pseudo_inertia(body, phi));
  const Eigen::Vector4d v = eigen.eigenvectors().col(0);
  const auto& column = model_.segments()[body.segment].inertia_column;
  // v' J v is linear in phi, with nothing constant but the plane's padding: its coefficients by unit vectors.
  out.size = 0;
  out.bound = body.margin;
  for (int k = 0; k < k_inertia_count; ++k) {
    Matrix4 unit = pseudo_inertia(body, InertiaVector::Unit(k));
    if (body.planar) unit(3, 3) = 0.0;
    const double a = v.dot(unit * v);
    if (a == 0.0) continue;
    if (column[k] == k_none) {
      out.bound -= a * phi(k);
      continue;
    }
    out.index[out.size] = column[k];
    out.value[out.size] = a;
    ++out.size;
  }
  if (body.planar) out.bound -= v(3) * v(3);
  return out.size > 0;
}

}  // namespace dynakin
