// What one update did to mean and covariance, in the form that a backward pass undoes (docs/derivations.md, section 9).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dynakin/measurement.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

// Sized once for a filter (Filter::tape_rows); writing allocates nothing. With sensors (as many as Measurement has
// blocks) it is also told how the update came about, so that its rows can be linearised again; with max_rows 0 nothing
// else is kept.
struct FrameTape {
  FrameTape(int state_size, int max_rows, std::size_t sensors = 0);

  void clear();                          // a new frame
  void clear_chunks() { ends.clear(); }  // an update begins anew: only its last linearisation counts
  // After S = L L': Z = P H' L^-T, in the panels' columns from `from` on, and w = L^-1 v of the blocks from first to
  // end - 1. A = L^-1 H is formed here.
  void add_chunk(const std::vector<RowBlock>& blocks, int first, int end, const Eigen::Ref<const Eigen::MatrixXd>& L,
                 const Panels& Z, int from, const Eigen::Ref<const Eigen::VectorXd>& w);
  // The row a x = b, known for sure, with Pa = P a and missing = b - a x.
  void add_equality(const Eigen::Ref<const Eigen::VectorXd, 0, Eigen::InnerStride<>>& a,
                    const Eigen::Ref<const Eigen::VectorXd>& Pa, double aPa, double missing);
  void forget(int i) {
    any_forgotten = true;
    forgotten[i] = 1;
  }

  // A column a row of A and Z, so that a chunk is a block of whole columns.
  Eigen::MatrixXd A, Z;
  Eigen::VectorXd w;
  std::vector<int> ends;  // of the chunks, in rows
  bool any_forgotten = false;
  std::vector<std::uint8_t> forgotten;  // (n,) elements that were drawn anew before the update: the motion was held
  Eigen::VectorXd pull;  // (n,) N' u: binding inequalities and their multipliers, the mean moved by P N' u
  bool pulled = false;
  bool cut = false;  // everything started again after the update

  // With sensors only.
  bool tells() const { return !used.empty(); }
  std::vector<std::uint8_t> used;         // blocks that the update took
  Eigen::VectorXd before, linearised;     // (n,) the state that it corrected, and where its rows were linearised last
  double stirred = 0.0, stirred_s = 0.0;  // before it: what `stir` was asked for, times and seconds
  Eigen::VectorXd moved;                  // (n,) by constraints that no state within reach kept all of
  bool fell_back = false;

 private:
  int rows() const { return ends.empty() ? 0 : ends.back(); }
};

}  // namespace dynakin
