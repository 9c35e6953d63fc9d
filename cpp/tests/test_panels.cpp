// Panels give what Eigen gives, with any number of rows and columns left over in the last ones.
#include <Eigen/Cholesky>
#include <vector>

#include "check.hpp"
#include "dynakin/panels.hpp"

namespace {

using Eigen::MatrixXd;
constexpr int k_rows[] = {1, 7, 24, 25, 61, 96};
constexpr int k_columns[] = {1, 3, 8, 9, 29};

// L of a covariance, stored with room to the next multiple of eight.
MatrixXd factor(int columns) {
  const MatrixXd A = MatrixXd::Random(columns, columns);
  MatrixXd L = MatrixXd::Zero((columns + 7) / 8 * 8, columns);
  L.topRows(columns) = (A * A.transpose() + MatrixXd::Identity(columns, columns)).llt().matrixL();
  return L;
}

template <class Check>
void each_size(Check&& check) {
  std::srand(1);
  for (const int rows : k_rows)
    for (const int columns : k_columns) check(rows, columns);
}

}  // namespace

TEST(panels_divide_as_triangular_solves_do) {
  each_size([](int rows, int columns) {
    const MatrixXd Z = MatrixXd::Random(rows, columns), room = factor(columns), L = room.topRows(columns);
    MatrixXd found(rows, columns), back = MatrixXd::Zero(room.rows(), columns), turned(columns, rows);
    back.topRows(columns) = L.transpose();
    dynakin::Panels panels(rows, columns);
    panels.set(Z);
    panels.divide(room.topRows(columns), columns);
    panels.get(0, found);
    CHECK((found * L.transpose() - Z).norm() < 1e-12 * Z.norm());
    panels.get_transposed(turned);
    CHECK(turned == found.transpose());
    panels.set(Z);
    panels.divide_back(back.topRows(columns), columns);
    panels.get(0, found);
    CHECK((found * L - Z).norm() < 1e-12 * Z.norm());
  });
}

TEST(panels_take_their_square_symmetrically) {
  each_size([](int rows, int columns) {
    const MatrixXd Z = MatrixXd::Random(rows, columns), A = MatrixXd::Random(rows, rows), P = A * A.transpose();
    MatrixXd left = P.selfadjointView<Eigen::Lower>();
    Eigen::VectorXd x = Eigen::VectorXd::Ones(rows);
    dynakin::Panels panels(rows, columns);
    panels.set(Z);
    panels.take_square(columns, left);
    CHECK((left - (P - Z * Z.transpose())).norm() < 1e-13 * (P.norm() + Z.squaredNorm()));
    CHECK(left == left.transpose());
    const Eigen::VectorXd w = Eigen::VectorXd::Random(columns);
    panels.add_product(w, x);
    CHECK((x - Eigen::VectorXd::Ones(rows) - Z * w).norm() < 1e-13 * (1.0 + Z.norm()));
  });
}

TEST(panels_combine_the_columns_of_sparse_rows) {
  each_size([](int rows, int columns) {
    const std::vector<int> used = {4, 0, 2};
    const MatrixXd M = MatrixXd::Random(rows, 5), h = MatrixXd::Random(columns, 3);
    MatrixXd H = MatrixXd::Zero(columns, 5), found(rows, columns);
    for (int k = 0; k < 3; ++k) H.col(used[k]) = h.col(k);
    dynakin::Panels panels(rows, columns);
    for (const bool add : {false, true})
      for (Eigen::Index p = 0; p < panels.count(); ++p)
        panels.combine(p, 0, {used, h.data(), columns, 1, columns}, M, add);
    panels.get(0, found);
    CHECK((found - 2.0 * M * H.transpose()).norm() < 1e-13 * (1.0 + found.norm()));
  });
}

TEST(panels_multiply_with_panels) {
  static constexpr Eigen::Index depth = 5;
  each_size([](int rows, int columns) {
    const MatrixXd M = MatrixXd::Random(rows, columns), Z = MatrixXd::Random(columns, depth + 2);
    const std::vector<int> at = {columns - 1, 0};
    const MatrixXd h = MatrixXd::Random(depth, 2);
    MatrixXd H = MatrixXd::Zero(depth, columns), found(rows, depth), less(rows, columns);
    for (const int k : {0, 1}) H.col(at[k]) += h.col(k);
    dynakin::Panels m(rows, columns), z(columns, depth + 2), u(rows, depth), one(rows, 1);
    m.set(M);
    z.set(Z);
    for (Eigen::Index p = 0; p < m.count(); ++p) u.combine(p, 0, {at, h.data(), depth, 1, depth}, m);
    u.get(0, found);
    CHECK((found - M * H.transpose()).norm() < 1e-13 * (1.0 + found.norm()));
    for (Eigen::Index p = 0; p < m.count(); ++p)
      for (Eigen::Index t = 0; t < m.max_columns() / dynakin::Panels::width; ++t) m.take_product(p, t, u, z, 2, depth);
    m.get(0, less);
    CHECK((less - (M - found * Z.rightCols(depth).transpose())).norm() < 1e-13 * (1.0 + M.norm() * Z.norm()));
    CHECK(m.at(rows - 1, 0) == less(rows - 1, 0));
    const Eigen::VectorXd x = Eigen::VectorXd::Random(columns);
    Eigen::VectorXd y = Eigen::VectorXd::Ones(depth);
    z.add_dots(2, x, y);
    CHECK((y - (Eigen::VectorXd::Ones(depth) + Z.rightCols(depth).transpose() * x)).norm() < 1e-12);
    one.set_column(0, 2.0, M.col(0));
    CHECK(one.at(rows - 1, 0) == 2.0 * M(rows - 1, 0));
  });
}
