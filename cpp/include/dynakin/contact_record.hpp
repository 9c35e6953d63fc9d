// The feet's loads of a whole trial, and what is reported of them and of the moments that they leave.
#pragma once

#include <cstddef>
#include <vector>

#include "dynakin/contacts.hpp"

namespace dynakin {

// Row-major, ground on person, about the ground origin; see FootLoad.
struct FeetTrial {
  std::vector<int> segments;
  std::size_t frames = 0;
  std::vector<double> wrench;      // (frames, feet, 6)
  std::vector<double> covariance;  // (frames, feet, 6, 6)
  std::vector<Contact> contact;    // (frames, feet)
};

struct ContactRecord {
  // The trial must outlive it.
  ContactRecord(const Model& model, const FeetTrial& trial);

  // Frame k: its moments (coordinates) and, where asked, their standard deviations. Throws std::invalid_argument where
  // the feet's covariances are not positive definite.
  void report(std::size_t k, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
              const Eigen::MatrixXd* P, double* moments_out, double* moments_sd);

  const FeetTrial& trial;
  ContactMoments moments;
  std::vector<double> foot_wrench, foot_wrench_sd, foot_adjustment;  // (frames, feet, 6)
  std::vector<double> remainder;                                     // (frames, 6)
  std::vector<std::uint8_t> source;                                  // (frames, coordinates) MomentSource
 private:
  std::vector<FootLoad> loads_;
};

}  // namespace dynakin
