// Says which vector levels the core was compiled for and which of them this processor has. Compiled without vector
// flags itself, so that it can be asked before the core is loaded.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#if defined(_MSC_VER)
#include <intrin.h>
#endif

namespace nb = nanobind;

namespace {

#if defined(__x86_64__)
bool has_v3() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2");
}

bool has_v4() {
  return has_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
}
#elif defined(_MSC_VER) && defined(_M_X64)
bool has_v3() {
  int leaf1[4], leaf7[4];
  __cpuid(leaf1, 1);
  __cpuidex(leaf7, 7, 0);
  return (leaf1[2] & (1 << 12)) && (leaf7[1] & (1 << 5));
}

bool has_v4() { return false; }  // not built there
#else
bool has_v3() { return false; }

bool has_v4() { return false; }
#endif

bool has(const std::string& level) {
  if (level == "v4") return has_v4();
  if (level == "v3") return has_v3();
  return level == "baseline";
}

}  // namespace

NB_MODULE(_cpu, m) {
  m.def(
      "built", [] { return std::vector<std::string>{DYNAKIN_LEVELS}; },
      "The levels that the core was compiled for, widest first.");
  m.def("has", &has, nb::arg("level"),
        "Whether this processor can run a core compiled for 'v4' (AVX-512), 'v3' (AVX2) or 'baseline'.");
}
