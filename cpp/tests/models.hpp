// Models and settings that several tests use.
#pragma once

#include "dynakin/measurement.hpp"
#include "dynakin/settings.hpp"

// Seven hinges about Z from the ground up, six lengths, 17 markers measured in x and y: the size of sagittal7.
dynakin::ModelSpec planar_chain();
// A branched tree in space: rotations and translations, chains of several axes, a weld, a curved and a scaled axis, a
// locked coordinate, a fixed length, all ten inertia numbers estimated.
dynakin::ModelSpec spatial_tree();

// The same with the six states of a contact.
dynakin::ModelSpec with_contact(dynakin::ModelSpec spec);

dynakin::FilterSettings settings_for(const dynakin::Model& model);
Eigen::MatrixXd prior_for(const dynakin::Model& model);
// Correlated errors, and effects of the contacts' states that are large compared with them.
dynakin::WrenchModel wrench_model_for(const dynakin::Model& model);
// Markers that the model itself would show at x.
Eigen::Matrix<double, 3, Eigen::Dynamic> markers_at(const dynakin::Model& model, const Eigen::VectorXd& x);
