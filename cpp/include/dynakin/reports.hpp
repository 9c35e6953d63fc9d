// What is reported of smoothed frames with their deviations: where another thread may be at work (threads.hpp), it does
// that while whoever finds the frames goes on. The numbers are the same to the last bit.
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "dynakin/run.hpp"

namespace dynakin {

// Of one thread, which adds and ends.
class Reports {
 public:
  // threaded: whether another thread may help, which it does if the record has deviations. It does `first` before;
  // where it does not, or has not begun when the reports end, nobody does.
  Reports(StateRecord& record, ContactRecord* contacts, bool threaded, std::function<void()> first = {});
  ~Reports();
  Reports(const Reports&) = delete;
  Reports& operator=(const Reports&) = delete;

  // Frame k, now or soon: x and P are copied.
  void add(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P);
  // All that was added is reported, and `first` is done where it was begun. Throws what either threw.
  void end();

 private:
  void help(const std::function<void()>& first);
  void report(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P);
  bool report_next();
  void close();

  StateRecord& record_;
  ContactRecord* const contacts_;
  std::thread thread_;
  const std::shared_ptr<std::atomic<bool>> begun_ = std::make_shared<std::atomic<bool>>(false);
  std::mutex reporting_;  // whoever reports: there is one place to do it
  std::mutex queue_;      // what follows
  std::condition_variable changed_;
  std::size_t first_ = 0, count_ = 0;  // of record_.waiting, a ring
  bool open_ = false;
  std::exception_ptr failed_;
};

}  // namespace dynakin
