// The contacts' loads as Python hands them in: segments by name.
#pragma once

#include <string>
#include <vector>

#include "dynakin/contact_record.hpp"

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Throws std::invalid_argument naming the segment that is not there, and those that are.
std::vector<int> segment_indices(const dynakin::Model& model, const std::vector<std::string>& names);

struct PyContactLoads {
  dynakin::ContactTrial of(const dynakin::Model& model) const {
    dynakin::ContactTrial out = trial;
    out.segments = segment_indices(model, names);
    return out;
  }
  std::vector<std::string> names;
  dynakin::ContactTrial trial;  // its segments still empty
};
