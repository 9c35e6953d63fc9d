// A second thread that takes a share of what the first does over and over, a few microseconds at a time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace dynakin {

// What it has not begun the first thread does: where a busy machine keeps it away, nobody waits for it.
class Helper {
 public:
  // threaded: whether there may be another thread (threads.hpp); else, or where the system has none, all is done alone.
  explicit Helper(bool threaded);
  ~Helper();
  Helper(const Helper&) = delete;
  Helper& operator=(const Helper&) = delete;

  // part(i) once for each i < count, the last ones first, by whoever comes first: no two parts may touch the same
  // numbers, so that these are the same to the last bit whoever does which.
  template <class Part>
  void share(int count, const Part& part) {
    do_all(count, [](const void* of, int i) { (*static_cast<const Part*>(of))(i); }, &part);
  }

 private:
  using Do = void (*)(const void*, int);
  void do_all(int count, Do part, const void* of);
  bool do_one();
  void help();
  void rouse();

  std::thread thread_;
  std::mutex sleeping_;
  std::condition_variable roused_;
  std::atomic<bool> asleep_{false}, closed_{false};
  // Of the present loop. left_: its number, above, and how many parts nobody has begun: whoever still takes it for the
  // loop before finds nothing left.
  std::atomic<std::uint64_t> left_{0};
  std::atomic<int> done_{0};
  Do part_ = nullptr;
  const void* of_ = nullptr;
  int alone_ = 0, pauses_ = 0;  // loops to come without the other, after one that waited for it; how many the last time
};

}  // namespace dynakin
