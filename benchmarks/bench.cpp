// Times a filter's steps and, between them, the bare dense update of the same size: n states, as many rows as that
// frame; and the bare products of a smoother's frame.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <Eigen/Cholesky>
#include <chrono>

#include "dynakin/filter.hpp"

namespace nb = nanobind;
using namespace dynakin;

namespace {

using clock_type = std::chrono::steady_clock;
using Array1 = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Array2 = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Array3 = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

double us_since(clock_type::time_point start) {
  return std::chrono::duration<double, std::micro>(clock_type::now() - start).count();
}

// x and P after one joint measurement with a dense H, written as one would with Eigen; workspace allocated once.
class DenseUpdate {
 public:
  DenseUpdate(int n, int m)
      : H_(Eigen::MatrixXd::Random(m, n)),
        P0_(Eigen::MatrixXd::Identity(n, n)),
        P_(n, n),
        HP_(m, n),
        S_(m, m),
        x_(n),
        v_(m) {}

  double time() {
    P_ = P0_;
    x_.setZero();
    v_.setOnes();
    const auto start = clock_type::now();
    HP_.noalias() = H_ * P_;
    S_.noalias() = HP_ * H_.transpose();
    S_.diagonal().array() += 0.1;
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S_);
    const auto L = S_.triangularView<Eigen::Lower>();
    L.solveInPlace(HP_);
    L.solveInPlace(v_);
    x_.noalias() += HP_.transpose() * v_;
    P_.noalias() -= HP_.transpose() * HP_;
    return us_since(start);
  }

 private:
  Eigen::MatrixXd H_, P0_, P_, HP_, S_;
  Eigen::VectorXd x_, v_;
};

// What smoothing a frame cannot do without, of d states that move and c constants (docs/derivations.md, section 9): S
// and V forwards, Lambda, W and the covariance backwards, and the constants' part of it.
class SmoothingProducts {
 public:
  SmoothingProducts(int d, int c, int rows)
      : S_(Eigen::MatrixXd::Identity(d, d)),
        X_(Eigen::MatrixXd::Random(d, d)),
        Z_(Eigen::MatrixXd::Random(d, rows)),
        V_(Eigen::MatrixXd::Random(c, d)),
        D_(Eigen::MatrixXd::Random(c, rows)),
        dd_(d, d),
        dm_(d, rows),
        cm_(c, rows) {}

  double time() {
    const auto start = clock_type::now();
    S_.selfadjointView<Eigen::Lower>().rankUpdate(Z_, -1e-9);
    V_.noalias() -= D_ * Z_.transpose();
    dm_.noalias() = X_ * Z_;
    cm_.noalias() = V_ * Z_;
    dd_.noalias() = S_ * X_;
    return us_since(start);
  }

 private:
  Eigen::MatrixXd S_, X_, Z_, V_, D_, dd_, dm_, cm_;
};

nb::tuple interleaved(Filter& filter, const Array1& time, const Array3& markers, const Array2& wrench, int rows) {
  const std::size_t frames = time.shape(0), m = 3 * filter.model().markers().size();
  DenseUpdate dense(filter.model().state_size(), rows);
  std::vector<double> step_us, dense_us;
  for (std::size_t k = 0; k < frames; ++k) {
    const Eigen::Map<const MarkerMatrix> z(markers.data() + k * m, 3, m / 3);
    const Vector6 w = Eigen::Map<const Vector6>(wrench.data() + 6 * k);
    const auto start = clock_type::now();
    if (k > 0) filter.predict(time.data()[k] - time.data()[k - 1]);
    const StepReport report = filter.update(z, w);
    step_us.push_back(us_since(start));
    if (report.diverged()) throw DivergenceError("the filter diverged at frame " + std::to_string(k));
    dense_us.push_back(dense.time());
  }
  return nb::make_tuple(step_us, dense_us);
}

}  // namespace

NB_MODULE(dynakin_bench, m) {
  const auto loaded = nb::cast<std::string>(nb::module_::import_("dynakin.bindings").attr("level"));
  if (loaded != DYNAKIN_LEVEL)  // what the two hand each other is laid out by level
    throw std::runtime_error("dynakin_bench is built for " DYNAKIN_LEVEL ", and the core that is loaded for " + loaded +
                             ": set DYNAKIN_VECTOR=" DYNAKIN_LEVEL);
  m.def("smoothing_products", [](int d, int c, int rows, int times) {
    SmoothingProducts products(d, c, rows);
    std::vector<double> us;
    for (int k = 0; k < times; ++k) us.push_back(products.time());
    return us;
  });
  nb::module_::import_("dynakin.bindings._core");  // registers Model and FilterSettings
  m.def(
      "interleaved",
      [](const Model& model, const FilterSettings& settings, const Eigen::VectorXd& x0, const Eigen::MatrixXd& P0,
         const Array1& time, const Array3& markers, const Array2& wrench, int rows) {
        Filter filter(model, settings, x0, P0);
        return interleaved(filter, time, markers, wrench, rows);
      },
      "Times (us) of each step and of a dense update of its size, taken in turn.");
}
