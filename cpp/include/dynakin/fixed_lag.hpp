// Smoothing while it is measured: the frame that lies a fixed number of frames back, from all frames until now.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/backward_pass.hpp"
#include "dynakin/filter.hpp"
#include "dynakin/past_covariance.hpp"

namespace dynakin {

// Keeps what a filter did in the last frames. Its result equals that of a Smoother run over all frames until now,
// except that inequalities are kept in the metric of the filtered covariance. Nothing is allocated after construction.
// A state costs some products of matrix and vector for each frame of the lag; its covariance, which is worked out where
// it is asked for, half a step of the filter and more for each.
class FixedLag {
 public:
  // The filter must outlive it, stands before the first frame and is stepped by nobody else. Throws
  // std::invalid_argument for a lag below 1, and where constraints are kept in a way that has no smoother.
  FixedLag(Filter& filter, int lag);
  ~FixedLag() { filter_.record_to(nullptr); }
  FixedLag(const FixedLag&) = delete;
  FixedLag& operator=(const FixedLag&) = delete;

  // One step of the filter, then look_back(lag()) as soon as there is such a frame. dt since the frame before; the
  // first frame is an update only. A frame that is refused counts as one in which nothing was measured.
  StepReport step(double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how = nullptr);
  // The same by somebody else, in three parts: open, one predict (but for the first frame) and update of the filter,
  // close.
  void open(double dt);
  void close();
  // The frame that lies so many frames back, from all until now: 0 to the least of lag() and frames() - 1.
  void look_back(int by);

  const Filter& filter() const { return filter_; }
  int lag() const { return lag_; }
  long frames() const { return frames_; }
  // Whether the filter has gone far enough for there to be a frame at the lag.
  bool ready() const { return frames_ > lag_; }
  // How far the frame that was looked at lies back, s; its state, and its covariance as of PastCovariance.
  double delay() const { return delay_; }
  const Eigen::VectorXd& state() const { return x_; }
  const Eigen::MatrixXd& covariance();

 private:
  struct Frame {
    double dt;
    Belief filtered;
    FrameTape tape;
  };
  Frame& back(int by) { return ring_[static_cast<std::size_t>((frames_ - 1 - by) % (lag_ + 1))]; }

  Filter& filter_;
  int lag_, by_ = 0;
  long frames_ = 0;
  double delay_ = 0.0;
  bool has_covariance_ = false;  // of the frame that was looked at
  std::vector<Frame> ring_;
  BackwardPass mean_;
  PastCovariance covariance_;
  Eigen::VectorXd x_;
};

}  // namespace dynakin
