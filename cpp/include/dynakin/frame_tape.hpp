// What one update did to mean and covariance, in the form that a smoother takes (docs/derivations.md, section 9).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dynakin/measurement.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

// Sized once for a filter (Filter::tape_rows); writing allocates nothing. With sensors (as many as Measurement has
// blocks) it also records how the update came about, so that its rows can be linearised again; with max_rows 0 nothing
// else is kept.
struct FrameTape {
  FrameTape(int state_size, int max_rows, std::size_t sensors = 0);

  void clear();         // a new frame
  void clear_chunks();  // an update begins anew: only its last linearisation counts
  // All sensors' rows. After S = L L': the first columns of the panels are Z = P H' L^-T, and w = L^-1 v.
  void add_update(const std::vector<RowBlock>& blocks, const Eigen::Ref<const Eigen::MatrixXd>& L, const Panels& Z,
                  const Eigen::Ref<const Eigen::VectorXd>& w);
  // The row a x = b, known for sure, with Pa = P a and missing = b - a x; columns: where a is not zero.
  void add_equality(const std::vector<int>& columns,
                    const Eigen::Ref<const Eigen::VectorXd, 0, Eigen::InnerStride<>>& a,
                    const Eigen::Ref<const Eigen::VectorXd>& Pa, double aPa, double missing);
  void forget(int i) {
    any_forgotten = true;
    forgotten[i] = 1;
  }

  // Rows that were taken together: of Z and w, and the blocks that make them up. L is L.block(from, from, rows, rows).
  struct Chunk {
    int from, rows, first_block, end_block;
  };
  struct Block {
    const std::vector<int>* columns;
    int rows;
    std::size_t at;  // of its H in entries, column by column
  };
  Panels::Rows rows_of(const Block& block) const {
    return {*block.columns, entries.data() + block.at, block.rows, 1, block.rows};
  }
  std::vector<Chunk> chunks;  // the update, then one for each equality
  std::vector<Block> blocks;
  std::vector<double> entries;
  Panels Z;
  Eigen::MatrixXd L;
  Eigen::VectorXd w;
  bool any_forgotten = false;
  std::vector<std::uint8_t> forgotten;  // (n,) elements that were drawn anew before the update: the motion was held
  Eigen::VectorXd pull;  // (n,) N' u: binding inequalities and their multipliers, the mean moved by P N' u
  bool pulled = false;
  bool cut = false;  // everything started again after the update

  // With sensors only.
  bool records_update() const { return !used.empty(); }
  std::vector<std::uint8_t> used;         // blocks that the update took
  Eigen::VectorXd before, linearised;     // (n,) the state that it corrected, and where its rows were linearised last
  double stirred = 0.0, stirred_s = 0.0;  // before it: what `stir` was asked for, times and seconds
  Eigen::VectorXd moved;                  // (n,) by constraints that no state within reach kept all of
  bool fell_back = false;

 private:
  Chunk& new_chunk(int rows);
};

}  // namespace dynakin
