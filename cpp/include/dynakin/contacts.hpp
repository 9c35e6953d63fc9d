// Joint moments that leave no residual at the root: the feet's wrenches, changed as little as their uncertainty allows
// so that they sum to what the state's mechanics needs (docs/derivations.md, section 15).
#pragma once

#include <cstdint>
#include <vector>

#include "dynakin/moment_derivatives.hpp"
#include "dynakin/output_sd.hpp"

namespace dynakin {

enum class Contact : std::uint8_t {
  none,       // in the air: its wrench is zero, for sure
  measured,   // on a plate
  unmeasured  // on something that has no plate
};

// Where a coordinate's moment comes from.
enum class MomentSource : std::uint8_t {
  measured,  // no unmeasured contact lies behind the coordinate
  derived,   // the only unmeasured one does: its wrench is what the motion leaves for it
  unknown    // one of several does; the moment is NaN
};

// What is known of a foot's wrench, ground on person, about the ground origin. wrench and covariance (positive
// definite) count where the contact is measured.
struct FootLoad {
  Contact contact = Contact::none;
  Vector6 wrench = Vector6::Zero();
  Matrix6 covariance = Matrix6::Identity();
};

// Allocated once for a model. distribute comes first; what follows is of the same state and loads.
class ContactMoments {
 public:
  // feet: a segment each, all different. Throws std::invalid_argument otherwise.
  ContactMoments(const Model& model, std::vector<int> feet);

  int feet() const { return static_cast<int>(feet_.size()); }

  // loads: one a foot. False, and nothing else is defined, where the sum of the measured ones' covariances is not
  // positive definite.
  bool distribute(const DynamicState& dynamics, const std::vector<FootLoad>& loads);

  // Of each foot: its wrench as used, and how far that is from the measured one (zero where it is not measured). NaN
  // where it is not known.
  const std::vector<Vector6>& wrenches() const { return wrench_; }
  const std::vector<Vector6>& adjustments() const { return adjustment_; }
  // What the state needs less the sum of the wrenches: zero if anything touches, what is left in flight, else NaN.
  const Vector6& remainder() const { return remainder_; }
  const std::vector<MomentSource>& sources() const { return source_; }  // a coordinate each

  // (coordinates), N m or N, locked ones too.
  void moments(const KinematicState& state, const DynamicState& dynamics, Eigen::Ref<Eigen::VectorXd> out) const;
  // d moments / dx (coordinates, n), the distribution changing with x; without meaning where the source is unknown.
  void jacobian(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                Eigen::Ref<Eigen::MatrixXd> out);
  // Standard deviations by the covariance of x and those of the measured wrenches: moments_sd (coordinates),
  // wrench_sd (feet, 6).
  void deviations(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                  const Eigen::MatrixXd& P, double* moments_sd, double* wrench_sd);

 private:
  void mark_sources(const std::vector<FootLoad>& loads, bool several);
  void levers(const KinematicState& state);

  const Model& model_;
  std::vector<int> feet_;
  std::vector<FootLoad> loads_;
  std::vector<Vector6> wrench_, adjustment_;
  std::vector<Matrix6> share_;  // A_i: what foot i takes of what the sum lacks
  Vector6 remainder_;
  std::vector<MomentSource> source_;
  std::vector<Force> external_;  // a segment each
  MomentWorkspace work_;
  using Lever = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  std::vector<Lever> lever_;  // G_i: d (power of foot i's wrench) / d speed of each coordinate
  Lever common_;              // D = sum of G_i A_i
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_J_, wrench_JP_;
  Eigen::MatrixXd J_;
  RowVariances variances_;
};

}  // namespace dynakin
