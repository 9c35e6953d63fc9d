// NumPy arrays that own their copy of the data.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <initializer_list>
#include <memory>
#include <vector>

template <class T>
nanobind::ndarray<nanobind::numpy, T> owned(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
  auto holder = std::make_unique<std::vector<T>>(std::move(values));
  nanobind::capsule owner(holder.get(), [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  T* data = holder.release()->data();
  return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner);
}
