#include "dynakin/threads.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <thread>

namespace dynakin {
namespace {

std::atomic<int> at_work{0};

}  // namespace

int most_threads() {
  const char* const asked = std::getenv("OMP_NUM_THREADS");
  const int threads = asked ? std::atoi(asked) : 0;
  return threads > 0 ? threads : std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
}

AtWork::AtWork() { ++at_work; }

AtWork::AtWork(int most) : counted_(++at_work <= most) {
  if (!counted_) --at_work;
}

AtWork::~AtWork() {
  if (counted_) --at_work;
}

}  // namespace dynakin
