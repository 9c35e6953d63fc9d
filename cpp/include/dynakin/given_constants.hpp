// A trial's states in two parts: what moves, and what does not, the constants, which all frames share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

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
struct GivenConstants {
  GivenConstants(const Model& model, const FilterSettings& settings);

  int d() const { return static_cast<int>(moving.size()); }
  int c() const { return static_cast<int>(constant.size()); }

  // Columns of x: first what is no marker's own (the motion before all), so many of each, then what is.
  std::vector<int> moving, constant;
  int wide = 0, wide_constants = 0;
  std::vector<int> place;                    // column -> place in moving, or -1 - place in constant
  std::vector<std::vector<int>> own;         // of a marker: columns of x
  std::vector<std::vector<int>> own_moving;  // of a marker: places in moving
  // Of a marker: places in moving of what moves it, coordinates with their speeds and accelerations.
  std::vector<std::vector<int>> movers;
};

// A frame of a stretch: what led to it, the rows it took, and S, V and m after them.
struct FrameGivenConstants {
  explicit FrameGivenConstants(const Model& model) : how(model) {}

  const Decision* decided = nullptr;
  double dt = 0.0;
  bool first = false;             // nothing led to it: an update only
  Eigen::VectorXd before, after;  // (n,) the whole filter's state before and after the update
  Transition how;                 // of what moves: kept and variance (d,)
  Eigen::VectorXd constants;      // (c,) c^, moved with what moved the whole filter's
  Eigen::VectorXd mean;           // (d,)
  Eigen::MatrixXd S, Vt;          // (d, d), V' (c, d), in the end V' from all frames
  bool anew = false;              // what goes backwards from frame to frame is formed anew here
  // H over d by its entries, row after row. With S = L L' of a chunk: Z = S_before H' L^-T, Dt = (H_c C + H V)' L^-T,
  // w = L^-1 (innovation), a column or number a row; L stands next to its rows.
  std::vector<int> row_ends, columns, chunk_ends;
  std::vector<int> block_first;  // of a row: the first of its block, whose rows all have the same columns
  std::vector<double> values;
  Eigen::MatrixXd Z, Dt, L;
  Eigen::VectorXd w;
  int rows() const { return static_cast<int>(row_ends.size()); }
  int begin(int row) const { return row == 0 ? 0 : row_ends[row - 1]; }
  // out + sign M H by columns, of the rows from `from` to end - 1: M has a column for each, out one for each of d.
  template <class M, class Out>
  void add_product(double sign, const M& m, int from, int end, Out&& out) const {
    for (int row = from; row < end;) {
      const int r = row - from, first = begin(row), size = row_ends[row] - first;
      const bool three = row + 2 < end && block_first[row + 2] == block_first[row];  // in one pass
      for (int k = 0; k < size; ++k) {
        const double* const h = &values[first + k];
        auto to = out.col(columns[first + k]);
        if (three)
          to += sign * h[0] * m.col(r) + sign * h[size] * m.col(r + 1) + sign * h[2 * size] * m.col(r + 2);
        else
          to += sign * h[0] * m.col(r);
      }
      row += three ? 3 : 1;
    }
  }
};

// Rows of one chunk at most, of max_rows in all.
int chunk_rows(int max_rows);
// A = C C' in place, of a covariance that may leave some combinations no variance: their columns of C are zero.
void factor_covariance(Eigen::MatrixXd& A);

}  // namespace dynakin
