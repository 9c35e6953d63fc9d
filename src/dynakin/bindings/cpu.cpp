// Says what the core was compiled for and whether this processor has it. Compiled without vector flags itself, so that
// it can be asked before the core is loaded.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#if defined(_MSC_VER)
#include <intrin.h>
#endif

namespace nb = nanobind;

namespace {

bool has_avx2_and_fma() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#elif defined(_MSC_VER) && defined(_M_X64)
  int leaf1[4], leaf7[4];
  __cpuid(leaf1, 1);
  __cpuidex(leaf7, 7, 0);
  return (leaf1[2] & (1 << 12)) && (leaf7[1] & (1 << 5));
#else
  return false;
#endif
}

}  // namespace

NB_MODULE(_cpu, m) {
  m.attr("level") = DYNAKIN_LEVEL;
  m.def(
      "supported", [] { return std::string(DYNAKIN_LEVEL) == "baseline" || has_avx2_and_fma(); },
      "Whether this processor can run the core.");
}
