// How a filter loses and finds its motion again: whether a frame is believed, and what is done where it is not.
#pragma once

#include "dynakin/correction.hpp"

namespace dynakin {

// What the filter makes of its own estimate. doubtful: most markers were refused, or would be further than
// recovery.fit_m from the estimate that they gave, so nothing of the frame was used; lost: so, or unseen, for longer
// than recovery.blind_s, the motion is held until it is found; found: sought anew in this frame, and the markers fit;
// restarted: the numbers had broken down, everything starts again from x0, and the motion is to be found.
enum class Tracking : std::uint8_t { following, doubtful, lost, found, restarted };
const char* describe(Tracking tracking);

// Works on a filter's correction, which must outlive it. Where recovery is not enabled every frame is believed.
class Recovery {
 public:
  // What later frames depend on.
  struct Memory {
    double unbelieved_s = 0.0;     // since a frame whose markers were believed
    double sought_s = k_infinity;  // since a better motion was last sought than one that is followed
    double vain_s = 0.0;           // since one that is held was first sought in vain
    double pause_s = 0.0;          // until it is sought next
    double shortest_step_s = k_infinity;
    bool held = false;  // the motion is lost, and to be found before anything is believed
  };

  explicit Recovery(Correction& correction);

  // The present belief becomes the one that everything starts from.
  void start();
  void restart();
  // Seconds of dt, passed since the last frame, over which the motion is carried on. White jerk says nothing of what a
  // person does meanwhile that is worth having: beyond blind_s without a marker that is believed the motion is held
  // where it was. Where frames are further apart, blind_s reaches to the next one, but never twice as far.
  double carry_on(double dt);
  double carried() const { return carried_; }  // what it gave last
  // Before a frame is measured: holds a motion that is lost, and coordinates that have not been seen for long.
  void hold();
  // Of a frame that is measured and judged: P is corrected and dx is what the state has still to take.
  Tracking correct(const MarkerRef& markers, const Vector6& wrench);

  const Memory& memory() const { return memory_; }
  void restore(const Memory& memory) { memory_ = memory; }

 private:
  bool believes_most() const { return 2 * gate_.markers_refused() <= gate_.markers_measured(); }
  double carried_of(double dt);
  void expect_impact();
  Tracking doubt();
  Tracking seek(const MarkerRef& markers);
  bool seek_motion(const MarkerRef& markers, int refused);
  bool seek_better(const MarkerRef& markers, const Vector6& wrench, int refused);
  bool turn_towards(const MarkerRef& markers);
  Tracking fit(const MarkerRef& markers, const Vector6& wrench);
  bool correct_to_fit(const MarkerRef& markers, const Vector6& wrench);
  bool judge_by_distance(const MarkerRef& markers);
  double squared_distance(const MarkerRef& markers, std::size_t m) const;
  double distance(const MarkerRef& markers) const;
  double distance_within_bounds(const MarkerRef& markers);
  void hold_coordinate(int i);
  void hold_motion();

  Correction& c_;
  const Model& model_;
  const RecoverySettings& settings_;
  Measurement& measurement_;
  Gate& gate_;
  Belief& now_;
  Memory memory_;
  double carried_ = 0.0;
  bool unseen_ = false;           // coordinates are held in this frame, because nothing is seen of them
  Belief start_, kept_, sought_;  // kept_: as the frame found it; sought_: from where its motion was sought
  Eigen::VectorXd ahead_, posture_, best_;
  MarkerMatrix from_, to_;
  std::vector<std::uint8_t> unsure_;  // coordinates that the last frame left at half of unseen_sd or more
  std::vector<std::uint8_t> forgotten_;
  const Vector6 no_wrench_ = Vector6::Constant(std::nan(""));
};

}  // namespace dynakin
