// How many threads smooth in this process, so that trials side by side do not take more than there are.
#pragma once

namespace dynakin {

// OMP_NUM_THREADS of the environment, else as many as the machine runs at a time.
int most_threads();

// A thread that is at work as long as this lives.
class AtWork {
 public:
  AtWork();                   // that there is already
  explicit AtWork(int most);  // one more, where fewer are at work: else this is false
  ~AtWork();
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;
  explicit operator bool() const { return counted_; }

 private:
  bool counted_ = true;
};

}  // namespace dynakin
