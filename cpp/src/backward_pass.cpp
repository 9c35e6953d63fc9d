#include "dynakin/backward_pass.hpp"

#include <stdexcept>
#include <string>

#include "dynakin/process.hpp"

namespace dynakin {

// The smoother undoes optimal gains; (7) restricts the gain, and a sigmoid bends the state between frames.
const FilterSettings& smoothable(const FilterSettings& settings) {
  const bool plain = settings.constraint == ConstraintKind::none || settings.constraint == ConstraintKind::projection;
  if (!plain && (settings.lower.array().isFinite().any() || settings.upper.array().isFinite().any()))
    throw std::invalid_argument(std::string("smoothing: bounds are kept by constraint '") +
                                (settings.constraint == ConstraintKind::gain ? "gain" : "sigmoid") +
                                "', which has no smoother, expected 'projection' or 'none'");
  return settings;
}

BackwardPass::BackwardPass(const Model& model, const FilterSettings& settings, int max_rows)
    : model_(model),
      settings_(smoothable(settings)),
      projection_(model, settings),
      lambda_(Eigen::VectorXd::Zero(model.state_size())),
      y_(Eigen::VectorXd::Zero(max_rows)) {}

void BackwardPass::undo(const FrameTape& tape, double dt) {
  if (tape.cut) {  // the frames before know nothing of those after
    start();
    return;
  }
  if (tape.pulled) lambda_ -= tape.pull;
  for (std::size_t c = tape.chunks.size(); c-- > 0;) undo_chunk(tape, tape.chunks[c]);
  if (tape.any_forgotten)
    for (int i = 0; i < model_.state_size(); ++i)
      if (tape.forgotten[i]) lambda_(i) = 0.0;
  transpose_transition(model_, settings_, dt, lambda_);
}

// lambda - H' L^-T (w + Z lambda); Z stands transposed on the tape.
void BackwardPass::undo_chunk(const FrameTape& tape, const FrameTape::Chunk& chunk) {
  auto y = y_.head(chunk.rows);
  y = tape.w.segment(chunk.from, chunk.rows);
  tape.Z.add_dots(chunk.from, lambda_, y);
  const auto L = tape.L.block(chunk.from, chunk.from, chunk.rows, chunk.rows);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(y);
  int row = 0;
  for (int b = chunk.first_block; b < chunk.end_block; ++b) {
    const Panels::Rows H = tape.rows_of(tape.blocks[b]);
    const double* h = H.h;
    for (const int column : H.columns)
      for (Eigen::Index r = 0; r < H.rows; ++r) lambda_(column) -= *h++ * y(row + r);
    row += static_cast<int>(H.rows);
  }
}

void BackwardPass::smooth(const Belief& filtered, Eigen::VectorXd& x) const {
  x = filtered.x;
  x.noalias() -= filtered.P * lambda_;
}

void BackwardPass::bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  if (settings_.constraint == ConstraintKind::projection) projection_.bound(x, P);
}

}  // namespace dynakin
