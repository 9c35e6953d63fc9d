#include "dynakin/frame_tape.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {

FrameTape::FrameTape(int state_size, int max_rows, std::size_t sensors)
    : Z(state_size, max_rows),
      L(Eigen::MatrixXd::Zero(Z.max_columns(), max_rows)),
      w(Eigen::VectorXd::Zero(max_rows)),
      forgotten(state_size, 0),
      pull(Eigen::VectorXd::Zero(state_size)),
      used(sensors, 0) {
  if (records_update()) before = linearised = moved = pull;
  const auto most = static_cast<std::size_t>(max_rows);
  chunks.reserve(most);
  blocks.reserve(most);
  entries.reserve(most * static_cast<std::size_t>(state_size));
}

void FrameTape::clear() {
  clear_chunks();
  if (any_forgotten) std::fill(forgotten.begin(), forgotten.end(), std::uint8_t{0});
  any_forgotten = pulled = cut = fell_back = false;
  stirred = stirred_s = 0.0;
}

void FrameTape::clear_chunks() {
  chunks.clear();
  blocks.clear();
  entries.clear();
}

FrameTape::Chunk& FrameTape::new_chunk(int rows) {
  const int from = chunks.empty() ? 0 : chunks.back().from + chunks.back().rows;
  const int block = static_cast<int>(blocks.size());
  return chunks.emplace_back(Chunk{from, rows, block, block});
}

void FrameTape::add_update(const std::vector<RowBlock>& measured, const Eigen::Ref<const Eigen::MatrixXd>& factor,
                           const Panels& Z_rows, const Eigen::Ref<const Eigen::VectorXd>& innovation) {
  if (w.size() == 0) return;
  Chunk& chunk = new_chunk(static_cast<int>(innovation.size()));
  for (const RowBlock& block : measured) {
    if (block.rows == 0) continue;
    blocks.push_back({block.columns, block.rows, entries.size()});
    for (std::size_t c = 0; c < block.columns->size(); ++c) {
      const double* const column = &block.H(0, static_cast<Eigen::Index>(c));
      entries.insert(entries.end(), column, column + block.rows);
    }
  }
  chunk.end_block = static_cast<int>(blocks.size());
  L.topLeftCorner(chunk.rows, chunk.rows) = factor;
  Z.copy(Z_rows, chunk.rows);
  w.head(chunk.rows) = innovation;
}

void FrameTape::add_equality(const std::vector<int>& columns,
                             const Eigen::Ref<const Eigen::VectorXd, 0, Eigen::InnerStride<>>& a,
                             const Eigen::Ref<const Eigen::VectorXd>& Pa, double aPa, double missing) {
  if (w.size() == 0) return;
  Chunk& chunk = new_chunk(1);
  blocks.push_back({&columns, 1, entries.size()});
  for (const int column : columns) entries.push_back(a(column));
  ++chunk.end_block;
  const double root = std::sqrt(aPa);
  L(chunk.from, chunk.from) = root;
  Z.set_column(chunk.from, 1.0 / root, Pa);
  w(chunk.from) = missing / root;
}

}  // namespace dynakin
