// A matrix of few columns in panels of rows, each of which stays in the cache: P - Z Z' in one pass over P, at the
// speed of the processor's vectors, and nothing is allocated for it.
#pragma once

#include <Eigen/Core>
#include <span>

namespace dynakin {

class Panels {
 public:
  static constexpr Eigen::Index height = 24;  // three of the widest vectors
  static constexpr Eigen::Index width = 8;    // columns of one product

  Panels() = default;
  // Columns up to the next multiple of `width` can be written; panels end with rows of zero.
  Panels(Eigen::Index rows, Eigen::Index max_columns)
      : rows_(rows),
        columns_((max_columns + width - 1) / width * width),
        numbers_(Eigen::VectorXd::Zero((rows + height - 1) / height * height * columns_)) {}

  Eigen::Index count() const { return columns_ == 0 ? 0 : numbers_.size() / (height * columns_); }
  Eigen::Index max_columns() const { return columns_; }
  // The rows from p height on: columns one after the other, `height` numbers each.
  double* panel(Eigen::Index p) { return numbers_.data() + p * height * columns_; }
  const double* panel(Eigen::Index p) const { return numbers_.data() + p * height * columns_; }
  double& at(Eigen::Index row, Eigen::Index column) { return panel(row / height)[column * height + row % height]; }
  double at(Eigen::Index row, Eigen::Index column) const { return panel(row / height)[column * height + row % height]; }

  // A sensor's rows H, or some of them: `rows` of them, of entries h[r * row_step + k * column_step] at columns[k].
  struct Rows {
    std::span<const int> columns;
    const double* h;
    Eigen::Index rows, row_step, column_step;
  };

  // Columns of panel p from `at` on <- M H' (add: more of it), with M symmetric or whole, of as many rows as the
  // panels.
  void combine(Eigen::Index p, Eigen::Index at, const Rows& H, const Eigen::MatrixXd& M, bool add = false);
  void combine(Eigen::Index p, Eigen::Index at, const Rows& H, const Panels& M);
  // Z, the first columns of the panels.
  void set(const Eigen::Ref<const Eigen::MatrixXd>& Z);
  void set_column(Eigen::Index k, double factor, const Eigen::Ref<const Eigen::VectorXd>& column);
  void copy(const Panels& other, Eigen::Index columns);
  // Z's columns from that one on.
  void get(Eigen::Index from, Eigen::Ref<Eigen::MatrixXd> Z) const;
  // Z', as many rows of it: the columns of one panel, or all.
  void get_transposed(Eigen::Index p, Eigen::Ref<Eigen::MatrixXd> Zt) const;
  void get_transposed(Eigen::Ref<Eigen::MatrixXd> Zt) const;
  // Z <- Z L^-T, L (columns, columns) lower triangular, stored with max_columns() rows at least; of one panel, or all.
  void divide(Eigen::Index p, const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Index columns);
  void divide(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Index columns);
  // Z <- Z L^-1, of U = L' stored likewise.
  void divide_back(const Eigen::Ref<const Eigen::MatrixXd>& U, Eigen::Index columns);
  // x + Z w
  void add_product(const Eigen::Ref<const Eigen::VectorXd>& w, Eigen::VectorXd& x) const;
  // y + Z' x, of Z's columns from there on
  void add_dots(Eigen::Index from, const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> y) const;
  // Columns `width` t and on, as many as `width`, of panel p less U Z', Z of the rows of these numbers: of the first
  // `depth` columns of U and those of Z from there on.
  void take_product(Eigen::Index p, Eigen::Index t, const Panels& U, const Panels& Z, Eigen::Index from,
                    Eigen::Index depth);
  // P - Z Z', symmetric to the bit; the lower triangle of P is read, both are written. Of the rows of one panel up to
  // the diagonal, with their mirror image, or of all.
  void take_square(Eigen::Index p, Eigen::Index columns, Eigen::MatrixXd& P) const;
  void take_square(Eigen::Index columns, Eigen::MatrixXd& P) const;

 private:
  Eigen::Index rows_ = 0, columns_ = 0;
  Eigen::VectorXd numbers_;
};

}  // namespace dynakin
