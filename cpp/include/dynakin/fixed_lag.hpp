// Smoothing while it is measured: the frame that lies a fixed number of frames back, from all frames until now.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/backward_pass.hpp"
#include "dynakin/filter.hpp"

namespace dynakin {

// Steps a filter and keeps what it did in the last frames. Its result equals that of a Smoother run over all frames
// until now, except that without deviations inequalities are kept in the metric of the filtered covariance. Nothing is
// allocated after construction; without deviations a step costs some products of matrix and vector more for each frame
// of the lag, with them as many products of matrices.
class FixedLag {
 public:
  // The filter must outlive it, stands before the first frame and is stepped by nobody else. Throws
  // std::invalid_argument for a lag below 1, and where constraints are kept in a way that has no smoother.
  FixedLag(Filter& filter, int lag, bool deviations = false);
  FixedLag(const FixedLag&) = delete;
  FixedLag& operator=(const FixedLag&) = delete;

  // dt since the frame before; the first frame is an update only.
  StepReport step(double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how = nullptr);

  const Filter& filter() const { return filter_; }
  int lag() const { return lag_; }
  bool deviations() const { return deviations_; }
  // Whether the filter has gone far enough for there to be a smoothed frame.
  bool ready() const { return frames_ > lag_; }
  // How far the smoothed frame lies back, s.
  double delay() const { return delay_; }
  const Eigen::VectorXd& state() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return P_; }  // empty without deviations

 private:
  struct Frame {
    double dt;
    Belief filtered;
    FrameTape tape;
  };
  StepReport record(Frame& now, double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how);
  Frame& back(int by) { return ring_[static_cast<std::size_t>((frames_ - 1 - by) % (lag_ + 1))]; }

  Filter& filter_;
  int lag_;
  bool deviations_;
  long frames_ = 0;
  double delay_ = 0.0;
  std::vector<Frame> ring_;
  BackwardPass pass_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd P_;
};

}  // namespace dynakin
