// Physical consistency: a segment's inertia belongs to some distribution of mass exactly if its pseudo-inertia is
// positive definite (Wensing et al. 2018; docs/derivations.md, section 13). In the plane that is m > 0 and
// m izz > mx^2 + my^2.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/half_space.hpp"
#include "dynakin/model.hpp"

namespace dynakin {

class Consistency {
 public:
  explicit Consistency(const Model& model);

  // Segments of which something is estimated.
  int size() const { return static_cast<int>(estimated_.size()); }
  // Smallest eigenvalue of a segment's pseudo-inertia, each axis in units of where it started: 0 or less is impossible.
  double smallest_eigenvalue(int body, const Eigen::VectorXd& x) const;
  bool holds(const Eigen::VectorXd& x) const;
  // False where the segment's inertia is possible. Else the half space v' J(phi) v >= margin, which holds all inertia
  // that is possible by the margin and not this one; v belongs to the smallest eigenvalue.
  bool cut(int body, const Eigen::VectorXd& x, HalfSpace& out) const;

  // What a projection aims at, and what passes: the distance between them ends the cutting after few rounds.
  static constexpr double margin = 1e-4, tolerated = 0.5e-4;

 private:
  using Matrix4 = Eigen::Matrix4d;
  struct Body {
    int segment;
    bool planar;
    Eigen::Vector4d scale;
    double margin;
  };
  Matrix4 pseudo_inertia(const Body& body, const InertiaVector& phi) const;

  const Model& model_;
  std::vector<Body> estimated_;
};

}  // namespace dynakin
