#include "dynakin/state_layout.hpp"

#include <stdexcept>

namespace dynakin {

void StateLayout::append(const std::string& block, const std::vector<std::string>& element_names) {
  blocks_.push_back({block, size(), static_cast<int>(element_names.size())});
  names_.insert(names_.end(), element_names.begin(), element_names.end());
}

const Block& StateLayout::block(const std::string& name) const {
  for (const Block& b : blocks_)
    if (b.name == name) return b;
  throw std::invalid_argument("state layout has no block '" + name + "'");
}

}  // namespace dynakin
