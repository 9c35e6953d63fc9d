// The contacts' loads of a whole trial, and what is reported of them and of the moments that they leave.
#pragma once

#include <cstddef>
#include <vector>

#include "dynakin/contacts.hpp"

namespace dynakin {

// Row-major, on the person, about the ground origin; see ContactLoads.
struct ContactTrial {
  std::vector<int> segments;
  std::size_t frames = 0;
  std::vector<double> wrench;      // (frames, contacts, 6)
  std::vector<double> covariance;  // (frames, contacts, 6, contacts, 6)
  std::size_t states = 0;          // how many contacts, the first ones, have states
  std::vector<double> effects;     // (frames, 6, states, 6)
  std::vector<Contact> contact;    // (frames, contacts)
};

struct ContactRecord {
  // The trial must outlive it. Throws std::invalid_argument where the model has states of other contacts.
  ContactRecord(const Model& model, const ContactTrial& trial);

  // Frame k and its moments (coordinates). Throws std::invalid_argument where the covariance of the wrenches' sum is
  // not positive definite.
  void report(std::size_t k, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
              double* moments_out);
  // Then, of the same frame, their standard deviations and those of the wrenches.
  void deviations(std::size_t k, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                  const Eigen::MatrixXd& P, double* moments_sd);

  const ContactTrial& trial;
  ContactMoments moments;
  std::vector<double> wrench, wrench_sd, adjustment;  // (frames, contacts, 6)
  std::vector<double> remainder;                      // (frames, 6)
  std::vector<std::uint8_t> source;                   // (frames, coordinates) MomentSource
 private:
  ContactLoads loads_;
};

}  // namespace dynakin
