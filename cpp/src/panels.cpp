#include "dynakin/panels.hpp"

#include <algorithm>

namespace dynakin {
namespace {

using Eigen::Index;
using Packet = Eigen::internal::packet_traits<double>::type;
constexpr Index k_packet = Eigen::internal::packet_traits<double>::size;
constexpr Index k_part = 3 * k_packet;  // of a panel: as many vectors as leave registers for sums

// C (3 packets, N) -= A B', a column of A or B after the other: what is summed stays in registers.
template <int N>
inline void tile(const double* a, const double* b, Index b_stride, Index depth, double* c, Index c_stride) {
  using namespace Eigen::internal;
  Packet sum[N][3];
  for (int j = 0; j < N; ++j)
    for (int r = 0; r < 3; ++r) sum[j][r] = pset1<Packet>(0.0);
  for (Index k = 0; k < depth; ++k, a += Panels::height, b += b_stride) {
    const Packet x0 = ploadu<Packet>(a), x1 = ploadu<Packet>(a + k_packet), x2 = ploadu<Packet>(a + 2 * k_packet);
    for (int j = 0; j < N; ++j) {
      const Packet y = pset1<Packet>(b[j]);
      sum[j][0] = pmadd(x0, y, sum[j][0]);
      sum[j][1] = pmadd(x1, y, sum[j][1]);
      sum[j][2] = pmadd(x2, y, sum[j][2]);
    }
  }
  for (int j = 0; j < N; ++j)
    for (int r = 0; r < 3; ++r) {
      double* const to = c + j * c_stride + r * k_packet;
      pstoreu(to, psub(ploadu<Packet>(to), sum[j][r]));
    }
}

// C (height, width) -= A B'
void take_product(const double* a, const double* b, Index b_stride, Index depth, double* c, Index c_stride) {
  constexpr int wide = k_packet == 8 ? 8 : 4;  // as many sums as there are registers for
  for (Index j = 0; j < Panels::width; j += wide)
    for (Index i = 0; i < Panels::height; i += k_part)
      tile<wide>(a + i, b + j, b_stride, depth, c + j * c_stride + i, c_stride);
}

// Part of N columns of M H': a column of M is read once for all of them.
template <int N>
void take_rows(const Panels::Rows& H, Index row, const double* M, Index stride, bool add, double* out) {
  using Part = Eigen::Matrix<double, k_part, 1>;
  Part sum[N];
  for (int r = 0; r < N; ++r)
    if (add)
      sum[r] = Eigen::Map<const Part>(out + r * Panels::height);
    else
      sum[r].setZero();
  const double* h = H.h + row * H.row_step;
  for (const int column : H.columns) {
    const Eigen::Map<const Part> m(M + column * stride);
    for (int r = 0; r < N; ++r) sum[r] += h[r * H.row_step] * m;
    h += H.column_step;
  }
  for (int r = 0; r < N; ++r) Eigen::Map<Part>(out + r * Panels::height) = sum[r];
}

using Square = Eigen::Matrix<double, Panels::height, Panels::height>;

}  // namespace

void Panels::combine(Index p, Index at, const Rows& H, const Eigen::MatrixXd& M, bool add) {
  const Index first = p * height, rows = std::min(height, rows_ - first);
  double* const out = panel(p) + at * height;
  if (rows == height) {
    for (Index i = 0; i < height; i += k_part) {
      const double* const from = M.data() + first + i;
      Index r = 0;
      for (; r + 3 <= H.rows; r += 3) take_rows<3>(H, r, from, M.outerStride(), add, out + r * height + i);
      for (; r < H.rows; ++r) take_rows<1>(H, r, from, M.outerStride(), add, out + r * height + i);
    }
    return;
  }
  for (Index r = 0; r < H.rows; ++r) {  // below the end of a column stands the next one
    Eigen::Map<Eigen::VectorXd> column(out + r * height, rows);
    if (!add) column.setZero();
    for (std::size_t k = 0; k < H.columns.size(); ++k)
      column += H.h[r * H.row_step + static_cast<Index>(k) * H.column_step] * M.col(H.columns[k]).segment(first, rows);
  }
}

void Panels::combine(Index p, Index at, const Rows& H, const Panels& M) {
  for (Index i = 0; i < height; i += k_part) {
    const double* const from = M.panel(p) + i;
    double* const to = panel(p) + at * height + i;
    Index r = 0;
    for (; r + 3 <= H.rows; r += 3) take_rows<3>(H, r, from, height, false, to + r * height);
    for (; r < H.rows; ++r) take_rows<1>(H, r, from, height, false, to + r * height);
  }
}

void Panels::set(const Eigen::Ref<const Eigen::MatrixXd>& Z) {
  for (Index p = 0; p < count(); ++p) {
    const Index first = p * height, rows = std::min(height, rows_ - first);
    double* const to = panel(p);
    for (Index k = 0; k < Z.cols(); ++k) std::copy_n(Z.data() + k * Z.outerStride() + first, rows, to + k * height);
  }
}

void Panels::set_column(Index k, double factor, const Eigen::Ref<const Eigen::VectorXd>& column) {
  for (Index row = 0; row < rows_; ++row) at(row, k) = factor * column(row);
}

void Panels::copy(const Panels& other, Index columns) {
  for (Index p = 0; p < count(); ++p) std::copy_n(other.panel(p), columns * height, panel(p));
}

void Panels::get(Index from, Eigen::Ref<Eigen::MatrixXd> Z) const {
  for (Index p = 0; p < count(); ++p) {
    const Index first = p * height, rows = std::min(height, rows_ - first);
    const double* const at = panel(p) + from * height;
    for (Index k = 0; k < Z.cols(); ++k) std::copy_n(at + k * height, rows, &Z(first, k));
  }
}

void Panels::get_transposed(Index p, Eigen::Ref<Eigen::MatrixXd> Zt) const {
  using Wide = Eigen::Matrix<double, height, Eigen::Dynamic>;
  const Index first = p * height, rows = std::min(height, rows_ - first);
  const Eigen::Map<const Wide> Z(panel(p), height, Zt.rows());
  for (Index k = 0; k < Zt.rows(); k += width) {  // a tile and its mirror image stay in the cache
    const Index w = std::min(width, Zt.rows() - k);
    Zt.block(k, first, w, rows) = Z.block(0, k, rows, w).transpose();
  }
}

void Panels::get_transposed(Eigen::Ref<Eigen::MatrixXd> Zt) const {
  for (Index p = 0; p < count(); ++p) get_transposed(p, Zt);
}

void Panels::add_product(const Eigen::Ref<const Eigen::VectorXd>& w, Eigen::VectorXd& x) const {
  Eigen::Matrix<double, height, 1> sum;
  for (Index p = 0; p < count(); ++p) {
    const Index first = p * height, rows = std::min(height, rows_ - first);
    sum.setZero();
    for (Index k = 0; k < w.size(); ++k)
      sum += w(k) * Eigen::Map<const Eigen::Matrix<double, height, 1>>(panel(p) + k * height);
    x.segment(first, rows) += sum.head(rows);
  }
}

void Panels::add_dots(Index from, const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> y) const {
  using Part = Eigen::Matrix<double, 8, 1>;
  using Column = Eigen::Matrix<double, height, 1>;
  constexpr Index few = 16;  // columns whose sums stay near
  Column part;
  for (Index k = 0; k < y.size(); k += few) {
    const Index columns = std::min(few, y.size() - k);
    Part sums[few];
    for (Part& sum : sums) sum.setZero();
    for (Index p = 0; p < count(); ++p) {
      const Index first = p * height, rows = std::min(height, rows_ - first);
      part.setZero();
      part.head(rows) = x.segment(first, rows);
      const double* column = panel(p) + (from + k) * height;
      for (Index c = 0; c < columns; ++c, column += height) {
        const Eigen::Map<const Column> z(column);
        sums[c] += z.segment<8>(0).cwiseProduct(part.segment<8>(0)) + z.segment<8>(8).cwiseProduct(part.segment<8>(8)) +
                   z.segment<8>(16).cwiseProduct(part.segment<8>(16));
      }
    }
    for (Index c = 0; c < columns; ++c) y(k + c) += sums[c].sum();
  }
}

void Panels::take_product(Index p, Index t, const Panels& U, const Panels& Z, Index from, Index depth) {
  const Index row = t * width;
  const double* const b = Z.panel(row / height) + from * height + row % height;
  dynakin::take_product(U.panel(p), b, height, depth, panel(p) + row * height, height);
}

void Panels::divide(Index p, const Eigen::Ref<const Eigen::MatrixXd>& L, Index columns) {
  using Column = Eigen::Map<Eigen::Matrix<double, height, 1>>;
  double* const z = panel(p);
  for (Index first = 0; first < columns; first += width) {
    dynakin::take_product(z, L.data() + first, L.outerStride(), first, z + first * height, height);
    for (Index k = first, end = std::min(first + width, columns); k < end; ++k) {
      Column column(z + k * height);
      for (Index l = first; l < k; ++l) column -= L(k, l) * Column(z + l * height);
      column *= 1.0 / L(k, k);
    }
  }
}

void Panels::divide(const Eigen::Ref<const Eigen::MatrixXd>& L, Index columns) {
  for (Index p = 0; p < count(); ++p) divide(p, L, columns);
}

void Panels::divide_back(const Eigen::Ref<const Eigen::MatrixXd>& U, Index columns) {
  using Column = Eigen::Map<Eigen::Matrix<double, height, 1>>;
  for (Index p = 0; p < count(); ++p) {
    double* const z = panel(p);
    for (Index end = columns, first; end > 0; end = first) {
      first = (end - 1) / width * width;
      const Index stride = U.outerStride();
      if (end < columns)
        dynakin::take_product(z + end * height, U.data() + end * stride + first, stride, columns - end,
                              z + first * height, height);
      for (Index k = end; k-- > first;) {
        Column column(z + k * height);
        for (Index l = k + 1; l < end; ++l) column -= U(k, l) * Column(z + l * height);
        column *= 1.0 / U(k, k);
      }
    }
  }
}

void Panels::take_square(Index p, Index columns, Eigen::MatrixXd& P) const {
  Square edge;
  const Index i = p * height, rows = std::min(height, rows_ - i);
  for (Index q = 0; q <= p; ++q) {
    const Index j = q * height;
    if (rows == height) {
      for (Index k = 0; k < height; k += width)
        dynakin::take_product(panel(p), panel(q) + k, height, columns, &P(i, j + k), P.outerStride());
      if (p != q) P.block<height, height>(j, i) = P.block<height, height>(i, j).transpose();
      continue;
    }
    edge.setZero();
    const Index wide = std::min(height, rows_ - j);
    edge.topLeftCorner(rows, wide) = P.block(i, j, rows, wide);
    for (Index k = 0; k < height; k += width)
      dynakin::take_product(panel(p), panel(q) + k, height, columns, edge.data() + k * height, height);
    P.block(i, j, rows, wide) = edge.topLeftCorner(rows, wide);
    if (p != q) P.block(j, i, wide, rows) = edge.topLeftCorner(rows, wide).transpose();
  }
}

void Panels::take_square(Index columns, Eigen::MatrixXd& P) const {
  for (Index p = 0; p < count(); ++p) take_square(p, columns, P);
}

}  // namespace dynakin
