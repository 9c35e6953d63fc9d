#include "dynakin/reports.hpp"

#include <system_error>
#include <utility>

namespace dynakin {

Reports::Reports(StateRecord& record, ContactRecord* contacts, bool threaded, std::function<void()> first)
    : record_(record), contacts_(contacts) {
  if (!threaded || !record.deviation) return;
  open_ = true;
  try {
    thread_ = std::thread([this, begun = begun_, first = std::move(first)] {
      if (!begun->exchange(true)) help(first);  // else `this` is no more
    });
  } catch (const std::system_error&) {  // the system has no thread left: one does it all
    open_ = false;
  }
}

Reports::~Reports() { close(); }

void Reports::add(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  {
    std::unique_lock lock(queue_);
    std::vector<WaitingFrame>& waiting = record_.waiting;
    if (open_ && count_ < waiting.size()) {
      WaitingFrame& frame = waiting[(first_ + count_) % waiting.size()];
      lock.unlock();
      frame.k = k;
      frame.x = x;
      frame.P = P;
      lock.lock();
      ++count_;
      lock.unlock();
      changed_.notify_one();
      return;
    }
  }
  report(k, x, P);
}

void Reports::end() {
  while (report_next()) {
  }
  close();
  if (failed_) std::rethrow_exception(std::exchange(failed_, nullptr));
}

void Reports::help(const std::function<void()>& first) {
  try {
    if (first) first();
    do {
      std::unique_lock lock(queue_);
      changed_.wait(lock, [this] { return count_ > 0 || !open_; });
    } while (report_next());
  } catch (...) {
    const std::lock_guard lock(queue_);
    failed_ = std::current_exception();
    open_ = false;
    count_ = 0;
  }
}

void Reports::report(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  const std::lock_guard lock(reporting_);
  record_.report(k, x, P, contacts_);
}

// Whether there was one.
bool Reports::report_next() {
  const std::lock_guard one(reporting_);
  const WaitingFrame* frame = nullptr;
  {
    const std::lock_guard lock(queue_);
    if (count_ == 0) return false;
    frame = &record_.waiting[first_];
  }
  record_.report(frame->k, frame->x, frame->P, contacts_);
  const std::lock_guard lock(queue_);
  if (count_ > 0) {
    first_ = (first_ + 1) % record_.waiting.size();
    --count_;
  }
  return true;
}

void Reports::close() {
  {
    const std::lock_guard lock(queue_);
    open_ = false;
  }
  changed_.notify_one();
  if (thread_.joinable()) {
    if (begun_->exchange(true))
      thread_.join();
    else  // on a busy machine it may not have begun
      thread_.detach();
  }
}

}  // namespace dynakin
