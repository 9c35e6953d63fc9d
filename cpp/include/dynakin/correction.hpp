// What a frame's measurements make of a predicted state: linearised, judged and, where it takes that, linearised anew.
#pragma once

#include "dynakin/gate.hpp"
#include "dynakin/update.hpp"

namespace dynakin {

struct Belief {
  Eigen::VectorXd x;
  Eigen::MatrixXd P;
};

// The workbench that a filter and its recovery share. The model and the settings must outlive it.
struct Correction {
  Correction(const Model& model, const FilterSettings& settings);

  // Rows of all sensors that this frame measures, at the present state, and a verdict on each.
  void measure(const MarkerRef& markers, const Vector6& wrench);
  // P is corrected and dx is what the state has still to take. A state that is known badly is linearised again where
  // the measurements have it.
  void correct(const MarkerRef& markers, const Vector6& wrench);
  // Gauss-Newton steps of the one update (iterated extended Kalman filter, Bell and Cathey 1993), from a measurement
  // that has been linearised at x. The sums are those of the first step: of the innovation as it was predicted.
  void iterate(const MarkerRef& markers, const Vector6& wrench, int most);
  void record_to(FrameTape* to);
  void share_with(Helper* helper) { update_.share_with(helper); }

  const Model& model;
  const FilterSettings& settings;
  Measurement measurement;
  Gate gate;
  Belief now, before;           // before: the last iteration
  Eigen::VectorXd dx, scratch;  // (n,)
  UpdateSums sums;
  FrameTape* tape = nullptr;

 private:
  void leave_out_refused();
  double uncertainty_seen() const;
  void note_linearised();

  JointUpdate update_;
};

}  // namespace dynakin
