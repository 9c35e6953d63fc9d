// The wrenches of contacts and the joint moments that they leave: each contact has an expected wrench and a covariance
// (a plate's with its errors, or a prior where no plate measures), and all are changed as little as these allow so that
// they sum to what the state's mechanics needs (docs/derivations.md, section 15).
#pragma once

#include <cstdint>
#include <vector>

#include "dynakin/moment_derivatives.hpp"
#include "dynakin/output_sd.hpp"

namespace dynakin {

enum class Contact : std::uint8_t {
  none,        // nothing touches: its wrench is zero, for sure
  measured,    // on a plate of its own
  unmeasured,  // on something that has no plate: what is known of its wrench is a prior
  shared       // on a plate that bears another contact too: the sum is measured, its parts are a prior's
};

// Where a coordinate's moment comes from; the worst of the contacts that lie behind it.
enum class MomentSource : std::uint8_t {
  measured,  // no unmeasured contact lies behind the coordinate, nor one that shares a plate with another
  derived,   // the only unmeasured one does: its wrench is what the motion leaves for it
  prior      // one of several does, or one that shares a plate: how they divide the load is a prior's
};

// What is known of the contacts' wrenches in a frame, on the person, about the ground origin. Where nothing touches,
// wrench and covariance do not count. What covariances of different contacts share stands off the diagonal: two
// feet on one plate have a sum that is known better than its parts.
struct ContactLoads {
  // states: how many contacts, the first ones, have states.
  explicit ContactLoads(std::size_t contacts, std::size_t states = 0);
  std::vector<Contact> contact;
  Eigen::VectorXd wrench;      // (6 contacts)
  Eigen::MatrixXd covariance;  // (6 contacts, 6 contacts), symmetric; that of the sum is positive definite
  // (6, 6 states): what the six states of a contact that has them add to its wrench.
  Eigen::Matrix<double, 6, Eigen::Dynamic> effects;
};

// Allocated once for a model. distribute comes first; what follows is of the same state and loads.
class ContactMoments {
 public:
  // segments: of the contacts, valid numbers; those that the model has states of come first. Throws
  // std::invalid_argument otherwise.
  ContactMoments(const Model& model, std::vector<int> segments);

  int contacts() const { return static_cast<int>(segments_.size()); }

  // False, and nothing else is defined, where the covariance of the wrenches' sum is not positive definite.
  bool distribute(const StateRef& x, const DynamicState& dynamics, const ContactLoads& loads);

  // Of each contact: its wrench as used, and how far that is from the one expected without its states.
  const std::vector<Vector6>& wrenches() const { return wrench_; }
  const std::vector<Vector6>& adjustments() const { return adjustment_; }
  // What the state needs less the sum of the wrenches: zero, unless nothing touches.
  const Vector6& remainder() const { return remainder_; }
  const std::vector<MomentSource>& sources() const { return source_; }  // a coordinate each

  // (coordinates), N m or N, locked ones too.
  void moments(const KinematicState& state, const DynamicState& dynamics, Eigen::Ref<Eigen::VectorXd> out) const;
  // d moments / dx (coordinates, n), the distribution changing with x.
  void jacobian(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                Eigen::Ref<Eigen::MatrixXd> out);
  // Standard deviations by the covariance of x and that of the expected wrenches: moments_sd (coordinates), wrench_sd
  // (contacts, 6).
  void deviations(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                  const Eigen::MatrixXd& P, double* moments_sd, double* wrench_sd);

 private:
  void mark_sources();
  void levers(const KinematicState& state);
  int column(std::size_t i) const { return model_.contact_column(static_cast<int>(i)); }
  bool touches(std::size_t i) const { return loads_.contact[i] != Contact::none; }
  auto effects(std::size_t i) const { return loads_.effects.middleCols<6>(static_cast<Eigen::Index>(6 * i)); }
  auto block(std::size_t i, std::size_t j) const {
    return loads_.covariance.block<6, 6>(static_cast<Eigen::Index>(6 * i), static_cast<Eigen::Index>(6 * j));
  }

  const Model& model_;
  std::vector<int> segments_;
  ContactLoads loads_;
  std::vector<Vector6> wrench_, adjustment_;
  std::vector<Matrix6> with_sum_;  // C_i: covariance of contact i's wrench with the sum
  std::vector<Matrix6> share_;     // A_i = C_i S^-1: what contact i takes of what the sum lacks
  Vector6 remainder_;
  std::vector<MomentSource> source_;
  std::vector<Force> external_;  // a segment each
  MomentWorkspace work_;
  using Lever = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  std::vector<Lever> lever_;  // G_i: d (power of contact i's wrench) / d speed of each coordinate
  Lever common_;              // D = sum of G_i A_i
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_J_;
  Eigen::MatrixXd J_;
  RowVariances variances_;
  RowCovariance row_covariance_;
};

}  // namespace dynakin
