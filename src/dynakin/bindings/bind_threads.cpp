#include <nanobind/nanobind.h>

#include <optional>

#include "dynakin/threads.hpp"
#include "module.hpp"

using namespace dynakin;

namespace {

class PyAtWork {
 public:
  PyAtWork& enter() {
    working_.emplace();
    return *this;
  }
  void exit(const nb::args&) { working_.reset(); }

 private:
  std::optional<AtWork> working_;
};

}  // namespace

void bind_threads(nb::module_& m) {
  nb::class_<PyAtWork>(m, "AtWork",
                       "Within it a thread of the caller's counts as one that is at work in this process: the core's "
                       "second threads keep off its processor (OMP_NUM_THREADS, else as many as the machine has).")
      .def(nb::init<>())
      .def("__enter__", &PyAtWork::enter, nb::rv_policy::reference)
      .def("__exit__", &PyAtWork::exit, nb::sig("def __exit__(self, *args: object) -> None"));
}
