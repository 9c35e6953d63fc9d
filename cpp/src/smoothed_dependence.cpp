#include "dynakin/smoothed_dependence.hpp"

#include <algorithm>

#include "given_transition.hpp"

namespace dynakin {

SmoothedDependence::SmoothedDependence(const GivenConstants& apart, int max_rows)
    : apart_(apart), panels_(apart.c(), chunk_rows(max_rows)) {
  const int chunk = chunk_rows(max_rows);
  Wt_.setZero(apart.c(), apart.d());
  M_.setZero(apart.c(), chunk);
  U_.setZero(panels_.max_columns(), chunk);
}

void SmoothedDependence::smooth(std::span<FrameGivenConstants> frames) {
  // Carried on from frame to frame, V and P from all frames gather rounding that the way back from what decayed
  // enlarges; so they start anew every so often.
  constexpr int most_frames = 16;
  constexpr double least_kept = 0.3;
  bool anew = true;
  int since = 0;
  double kept = 1.0;
  for (std::size_t k = frames.size(); k-- > 0;) {
    FrameGivenConstants& frame = frames[k];
    frame.anew = anew;
    if (anew) {
      frame.Vt.noalias() -= Wt_ * frame.S;
      since = 0;
      kept = 1.0;
    }
    for (std::size_t c = frame.chunk_ends.size(); c-- > 0;)
      undo_chunk(frame, c == 0 ? 0 : frame.chunk_ends[c - 1], frame.chunk_ends[c]);
    for (const int i : frame.decided->forgotten) Wt_.col(i).setZero();
    kept *= std::min(frame.how.kept.minCoeff(), 1.0);
    anew = !frame.decided->forgotten.empty() || ++since == most_frames || !(kept > least_kept);
    if (k > 0 && !anew) {  // F V = V + Q W
      Eigen::MatrixXd& before = frames[k - 1].Vt;
      before = frame.Vt;
      add_noise(frame.how, Wt_, before);
      by_transition_back(frame.how, before);
    }
    by_transposed_transition(frame.how, Wt_);
  }
}

// W' - (W' Z - D') L^-1 H
void SmoothedDependence::undo_chunk(const FrameGivenConstants& frame, int from, int end) {
  if (apart_.c() == 0) return;
  const int rows = end - from;
  auto M = M_.leftCols(rows);
  auto U = U_.topLeftCorner(rows, rows);
  M = -frame.Dt.middleCols(from, rows);
  M.noalias() += Wt_ * frame.Z.middleCols(from, rows);
  U = frame.L.block(0, from, rows, rows).transpose();
  panels_.set(M);
  panels_.divide_back(U, rows);
  panels_.get(0, M);
  frame.add_product(-1.0, M, from, end, Wt_);
}

}  // namespace dynakin
