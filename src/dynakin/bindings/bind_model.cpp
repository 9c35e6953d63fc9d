#include <nanobind/eigen/dense.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "dynakin/model.hpp"
#include "module.hpp"

using namespace dynakin;

namespace {

template <class Items>
std::vector<std::string> names(const Items& items) {
  std::vector<std::string> list;
  for (const auto& item : items) list.push_back(item.name);
  return list;
}

}  // namespace

void bind_model(nb::module_& m) {
  nb::class_<StateLayout>(m, "StateLayout", "Named blocks of the state x (3).")
      .def_prop_ro("size", &StateLayout::size)
      .def_prop_ro("names", &StateLayout::names, nb::rv_policy::copy, "One name an element.")
      .def_prop_ro(
          "blocks",
          [](const StateLayout& layout) {
            nb::dict blocks;
            for (const Block& b : layout.blocks()) blocks[b.name.c_str()] = nb::make_tuple(b.offset, b.size);
            return blocks;
          },
          "Name -> (offset, size), in order.");

  nb::class_<Model>(
      m, "Model",
      "A checked, immutable model. Raises ValueError naming the key that is wrong; pickled by its ModelSpec.")
      .def(nb::init<const ModelSpec&>(), nb::arg("spec"))
      .def_prop_ro(
          "spec", [](const Model& model) { return ModelSpec(model.spec()); }, "A copy of the specification.")
      .def_prop_ro("layout", &Model::layout, nb::rv_policy::reference_internal)
      .def_prop_ro("coordinate_names", [](const Model& model) { return names(model.coordinates()); })
      .def_prop_ro("segment_names", [](const Model& model) { return names(model.segments()); })
      .def_prop_ro("marker_names", [](const Model& model) { return names(model.markers()); })
      .def("initial_state", &Model::initial_state, "The specification's values (n,); speeds and accelerations 0.")
      .def("__getstate__", [](const Model& model) { return nb::make_tuple(model.spec()); })
      .def("__setstate__",
           [](Model& self, const nb::tuple& state) { new (&self) Model(nb::cast<ModelSpec>(state[0])); });
}
