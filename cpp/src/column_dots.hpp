// Products of few columns with few columns, whose sums stay in registers.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace dynakin {

// out(i, j) + a_i' b_j of columns that are `length` long.
inline void add_dots(const std::vector<const double*>& a, const std::vector<const double*>& b, Eigen::Index length,
                     Eigen::MatrixXd& out) {
  using namespace Eigen::internal;
  using Packet = packet_traits<double>::type;
  constexpr Eigen::Index size = packet_traits<double>::size;
  constexpr std::size_t few = 3;
  const Eigen::Index whole = length / size * size;
  for (std::size_t i = 0; i < a.size(); i += few)
    for (std::size_t j = 0; j < b.size(); j += few) {
      const double *x[few], *y[few];  // the last ones again where there are fewer
      for (std::size_t k = 0; k < few; ++k) {
        x[k] = a[std::min(i + k, a.size() - 1)];
        y[k] = b[std::min(j + k, b.size() - 1)];
      }
      Packet sum[few][few];
      for (auto& row : sum)
        for (Packet& s : row) s = pset1<Packet>(0.0);
      for (Eigen::Index k = 0; k < whole; k += size) {
        const Packet y0 = ploadu<Packet>(y[0] + k), y1 = ploadu<Packet>(y[1] + k), y2 = ploadu<Packet>(y[2] + k);
        for (std::size_t r = 0; r < few; ++r) {
          const Packet xr = ploadu<Packet>(x[r] + k);
          sum[r][0] = pmadd(xr, y0, sum[r][0]);
          sum[r][1] = pmadd(xr, y1, sum[r][1]);
          sum[r][2] = pmadd(xr, y2, sum[r][2]);
        }
      }
      for (std::size_t r = 0; r < std::min(few, a.size() - i); ++r)
        for (std::size_t s = 0; s < std::min(few, b.size() - j); ++s) {
          double rest = predux(sum[r][s]);
          for (Eigen::Index k = whole; k < length; ++k) rest += x[r][k] * y[s][k];
          out(static_cast<Eigen::Index>(i + r), static_cast<Eigen::Index>(j + s)) += rest;
        }
    }
}

}  // namespace dynakin
