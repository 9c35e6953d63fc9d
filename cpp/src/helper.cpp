#include "dynakin/helper.hpp"

#include <algorithm>
#include <chrono>
#include <system_error>

namespace dynakin {
namespace {

using clock = std::chrono::steady_clock;

constexpr std::uint64_t k_loop = std::uint64_t{1} << 32;
// One update's loops follow each other within this time. Who sleeps takes some 50 us to wake; who yields instead is put
// behind all others of a busy machine.
constexpr auto k_awake = std::chrono::microseconds(200);

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

}  // namespace

Helper::Helper(bool threaded) {
  if (!threaded) return;
  try {
    thread_ = std::thread([this] { help(); });
  } catch (const std::system_error&) {  // the system has no thread left: one does it all
  }
}

Helper::~Helper() {
  if (!thread_.joinable()) return;
  closed_ = true;
  rouse();
  thread_.join();
}

void Helper::rouse() {
  if (!asleep_) return;
  {
    const std::lock_guard lock(sleeping_);
  }  // it looks once more before it sleeps
  roused_.notify_one();
}

void Helper::do_all(int count, Do part, const void* of) {
  if (!thread_.joinable() || alone_ > 0) {
    alone_ = std::max(alone_ - 1, 0);
    for (int i = count; i-- > 0;) part(of, i);
    return;
  }
  part_ = part;
  of_ = of;
  done_ = 0;
  left_ = (left_ / k_loop + 1) * k_loop + static_cast<std::uint64_t>(count);
  rouse();
  while (do_one()) {
  }
  if (done_ == count) {
    pauses_ = 0;
    return;
  }
  const auto start = clock::now();
  while (done_ < count) clock::now() < start + k_awake ? pause() : std::this_thread::yield();
  // A part takes less: the machine took it off the processor with one begun.
  pauses_ = clock::now() < start + k_awake ? 0 : std::min(2 * pauses_ + 16, 1024);
  alone_ = pauses_;
}

// Whether there was one that nobody had begun.
bool Helper::do_one() {
  std::uint64_t left = left_;
  do {
    if (left % k_loop == 0) return false;
  } while (!left_.compare_exchange_weak(left, left - 1));
  part_(of_, static_cast<int>(left % k_loop) - 1);
  ++done_;
  return true;
}

void Helper::help() {
  auto until = clock::now() + k_awake;
  while (!closed_) {
    if (do_one()) {
      until = clock::now() + k_awake;
    } else if (clock::now() < until) {
      pause();
    } else {
      std::unique_lock lock(sleeping_);
      asleep_ = true;
      roused_.wait(lock, [this] { return left_ % k_loop > 0 || closed_; });
      asleep_ = false;
      until = clock::now() + k_awake;
    }
  }
}

}  // namespace dynakin
