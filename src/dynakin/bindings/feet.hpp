// The feet's loads as Python hands them in: segments by name.
#pragma once

#include <string>
#include <vector>

#include "dynakin/contact_record.hpp"

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Throws std::invalid_argument naming the segment that is not there, and those that are.
std::vector<int> segment_indices(const dynakin::Model& model, const std::vector<std::string>& names);

struct FootLoads {
  dynakin::FeetTrial of(const dynakin::Model& model) const {
    dynakin::FeetTrial out = trial;
    out.segments = segment_indices(model, names);
    return out;
  }
  std::vector<std::string> names;
  dynakin::FeetTrial trial;  // its segments still empty
};
