// A Kalman filter and smoother of what moves, given what does not: the constants, which all frames share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynakin/correction.hpp"
#include "dynakin/panels.hpp"
#include "dynakin/process.hpp"

namespace dynakin {

// What a filter decided in a frame, as far as that cannot be found again from its states.
struct Decision {
  double carried = 0.0;                      // Filter::carried
  std::vector<std::uint8_t> used;            // FrameTape's
  Eigen::VectorXd before, linearised;        // (n,) its, empty: as predicted, and as before
  std::vector<int> forgotten;                // columns
  std::vector<std::pair<int, double>> pull;  // its entries that are not zero
  double stirred = 0.0, stirred_s = 0.0;
  Eigen::VectorXd moved;  // (n,) empty: nothing fell back
  bool cut = false;
};

// The states are d, which move or are disturbed, and the constants c, which are known at the end, from all frames:
// c = c^ + C z with z of unit covariance. Given z, d has a filter of its own, of covariance S and a mean that is linear
// in z, m + V z. That takes the rows that the whole filter took, and nothing of its covariance but where a stretch of
// frames begins; it is backwards what a smoother has to carry (docs/derivations.md, section 9).
class GivenConstants {
 public:
  // A frame of a stretch: what led to it, the rows it took, and S, V and m after them.
  struct Frame {
    explicit Frame(const Model& model) : how(model) {}

    const Decision* decided = nullptr;
    double dt = 0.0;
    bool first = false;             // nothing led to it: an update only
    Eigen::VectorXd before, after;  // (n,) the whole filter's state before and after the update
    Transition how;
    Eigen::VectorXd mean;   // (d,)
    Eigen::MatrixXd S, Vt;  // (d, d), V' (c, d)
    // H over d by its entries, row after row. With S = L L' of a chunk: Z = S_before H' L^-T, Dt = (H_c C + H V)' L^-T,
    // w = L^-1 (innovation), a column or number a row; L stands beside its rows.
    std::vector<int> row_ends, columns, chunk_ends;
    std::vector<int> block_first;  // of a row: the first of its block, whose rows all have the same columns
    std::vector<double> values;
    Eigen::MatrixXd Z, Dt, L;
    Eigen::VectorXd w;
    int rows() const { return static_cast<int>(row_ends.size()); }
    int begin(int row) const { return row == 0 ? 0 : row_ends[row - 1]; }
  };

  GivenConstants(const Model& model, const FilterSettings& settings, int max_rows);

  // The last frame of all: nothing is said by later ones, and the constants are as it has them.
  void end(const Belief& last);
  // A stretch forwards: from what is known before its first frame, through its frames, in their order.
  // moved: by how much `Decision::moved` moves the state in the stretch, (n,).
  void start(const Belief& before, const Eigen::VectorXd& moved);
  // decided, dt, before and after are given, the rest is found. last: the frame before, nullptr of the first; blocks
  // are linearised where the filter had them, and those that it did not use have no rows.
  void step(const std::vector<RowBlock>& blocks, const Frame* last, Frame& frame);

  // A stretch backwards, from its last frame to its first: the frame's state from all frames, and its covariance (n, n)
  // of all pairs of elements of which none is a marker's own, and of those that move the same marker. Other entries are
  // of no meaning before complete().
  void look(const Frame& frame, Eigen::VectorXd& x);
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  void complete();
  // Over the frame's update and what led to it. last: as of step.
  void undo(const Frame& frame, const Frame* last);

 private:
  void sort_columns();
  void predict(const Eigen::MatrixXd& S, const Eigen::MatrixXd& Vt, Frame& frame);
  void gather(const std::vector<RowBlock>& blocks, Frame& frame);
  void correct(int from, int end, Frame& frame);
  void keep_equalities(Frame& frame);
  void undo_chunk(const Frame& frame, int from, int end);
  void undo_transition(const Transition& how, const Frame* last);
  int moving() const { return static_cast<int>(moving_.size()); }
  int constants() const { return static_cast<int>(constant_.size()); }

  const Model& model_;
  const FilterSettings& settings_;
  std::vector<int> moving_, constant_;  // columns of x; the motion comes first, of the constants those of no marker
  std::vector<int> place_;              // column -> place in moving_, or -1 - place in constant_
  std::vector<int> wide_;               // places in moving_ of what is no marker's own
  int wide_constants_ = 0;
  std::vector<std::vector<int>> own_;  // of a marker: its columns that are its own
  Eigen::VectorXd c_, c_now_;          // (c,) from all frames: at the frame that is looked at, on the way forwards
  Eigen::MatrixXd Ct_;                 // C', upper triangular
  // Where the stretch begins.
  Eigen::MatrixXd S_, Vt_;
  Eigen::VectorXd shift_;  // (d,) m less the whole filter's mean
  // Of the present frame's rows.
  std::vector<int> c_ends_, c_columns_;
  std::vector<double> c_values_, innovation_;
  Eigen::MatrixXd R_, Zt_, S_rows_;  // R_: (6, rows)
  Panels Z_panels_, D_panels_;
  // Backwards: the adjoints of m, S and V.
  Eigen::VectorXd lambda_;
  Eigen::MatrixXd Lambda_, Wt_;
  Eigen::MatrixXd P_, Yt_;  // (d, d) covariance given z from all frames, V' from all frames (c, d)
  bool there_ = false;      // they are of the frame that is looked at
  bool ended_ = false;      // no later frame has said anything yet
  int since_ = 0;           // frames since they were not carried here from the frame after
  double decayed_ = 1.0;    // least that was kept of an element on the way
  Eigen::MatrixXd G_, M_, X_, T_, Yw_, Pw_, Pwc_, covariance_;
};

}  // namespace dynakin
