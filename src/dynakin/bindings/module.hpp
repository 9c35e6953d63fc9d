// One bind_ function a concept; module.cpp calls them in the order in which their types depend on each other.
#pragma once

#include <nanobind/nanobind.h>

namespace nb = nanobind;

namespace dynakin {
class Filter;
}

void bind_spec(nb::module_& m);
void bind_model(nb::module_& m);
void bind_mechanics(nb::module_& m);
void bind_contacts(nb::module_& m);
void bind_threads(nb::module_& m);
void bind_filter(nb::module_& m);
void bind_run(nb::class_<dynakin::Filter>& filter);
void bind_score(nb::class_<dynakin::Filter>& filter);
void bind_fixed_lag(nb::module_& m);
