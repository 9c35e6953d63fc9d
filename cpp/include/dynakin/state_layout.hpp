// Named blocks of the state x (3): the one place that knows where a number stands.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <vector>

namespace dynakin {

struct Block {
  std::string name;
  int offset = 0;
  int size = 0;
};

class StateLayout {
 public:
  // Blocks are appended in their order of appearance; every element carries a unique name.
  void append(const std::string& block, const std::vector<std::string>& element_names) {
    blocks_.push_back({block, size(), static_cast<int>(element_names.size())});
    names_.insert(names_.end(), element_names.begin(), element_names.end());
  }

  int size() const { return static_cast<int>(names_.size()); }
  const std::vector<Block>& blocks() const { return blocks_; }
  const Block& block(const std::string& name) const {
    for (const Block& b : blocks_)
      if (b.name == name) return b;
    throw std::invalid_argument("state layout has no block '" + name + "'");
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<Block> blocks_;
  std::vector<std::string> names_;
};

// Every coordinate is a 1-DoF axis, so the state is a vector space; updates go through these two all the same,
// for the day a coordinate lives on a manifold.
inline void retract(Eigen::VectorXd& x, const Eigen::VectorXd& dx) { x += dx; }

}  // namespace dynakin
