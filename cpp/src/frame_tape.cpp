#include "dynakin/frame_tape.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {

FrameTape::FrameTape(int state_size, int max_rows, std::size_t sensors)
    : A(Eigen::MatrixXd::Zero(state_size, max_rows)),
      Z(A),
      w(Eigen::VectorXd::Zero(max_rows)),
      forgotten(state_size, 0),
      pull(Eigen::VectorXd::Zero(state_size)),
      used(sensors, 0) {
  if (tells()) before = linearised = moved = pull;
  ends.reserve(max_rows);
}

void FrameTape::clear() {
  clear_chunks();
  if (any_forgotten) std::fill(forgotten.begin(), forgotten.end(), std::uint8_t{0});
  any_forgotten = pulled = cut = fell_back = false;
  stirred = stirred_s = 0.0;
}

void FrameTape::add_chunk(const std::vector<RowBlock>& blocks, int first, int end,
                          const Eigen::Ref<const Eigen::MatrixXd>& L, const Panels& Z_rows, int first_row,
                          const Eigen::Ref<const Eigen::VectorXd>& w_chunk) {
  if (A.cols() == 0) return;
  const int from = rows();
  const int count = static_cast<int>(w_chunk.size());
  auto Ht = A.middleCols(from, count);
  Ht.setZero();
  int at = 0;
  for (int b = first; b < end; ++b) {
    const RowBlock& block = blocks[b];
    for (int r = 0; r < block.rows; ++r, ++at)
      for (std::size_t c = 0; c < block.columns->size(); ++c) Ht((*block.columns)[c], at) = block.H(r, c);
  }
  L.transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(Ht);
  Z_rows.get(first_row, Z.middleCols(from, count));
  w.segment(from, count) = w_chunk;
  ends.push_back(from + count);
}

void FrameTape::add_equality(const Eigen::Ref<const Eigen::VectorXd, 0, Eigen::InnerStride<>>& a,
                             const Eigen::Ref<const Eigen::VectorXd>& Pa, double aPa, double missing) {
  if (A.cols() == 0) return;
  const int at = rows();
  const double L = std::sqrt(aPa);
  A.col(at) = a / L;
  Z.col(at) = Pa / L;
  w(at) = missing / L;
  ends.push_back(at + 1);
}

}  // namespace dynakin
