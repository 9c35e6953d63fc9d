// NumPy arrays in, and arrays that own their copy of the data out.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynakin/measurement.hpp"

using Array1 = nanobind::ndarray<const double, nanobind::ndim<1>, nanobind::c_contig, nanobind::device::cpu>;
using Array2 = nanobind::ndarray<const double, nanobind::ndim<2>, nanobind::c_contig, nanobind::device::cpu>;
using Array3 = nanobind::ndarray<const double, nanobind::ndim<3>, nanobind::c_contig, nanobind::device::cpu>;

// A (M, 3) row-major array is a (3, M) column-major matrix.
inline Eigen::Map<const dynakin::MarkerMatrix> marker_map(const Array2& markers, const dynakin::Model& model) {
  const std::size_t n = model.markers().size();
  if (markers.shape(0) != n || markers.shape(1) != 3)
    throw std::invalid_argument("markers: expected (" + std::to_string(n) + ", 3), found (" +
                                std::to_string(markers.shape(0)) + ", " + std::to_string(markers.shape(1)) + ")");
  return {markers.data(), 3, static_cast<Eigen::Index>(n)};
}

template <class T>
nanobind::ndarray<nanobind::numpy, T> owned(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
  auto holder = std::make_unique<std::vector<T>>(std::move(values));
  nanobind::capsule owner(holder.get(), [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  T* data = holder.release()->data();
  return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner);
}
