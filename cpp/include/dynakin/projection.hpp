// Constraints by projection: the nearest state, in the metric of P^-1, that keeps bounds, equalities and physical
// consistency.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "dynakin/consistency.hpp"
#include "dynakin/frame_tape.hpp"
#include "dynakin/half_space.hpp"
#include "dynakin/settings.hpp"

namespace dynakin {

struct ProjectionReport {
  int active = 0;      // inequalities that hold the state back
  bool solved = true;  // false: no state within reach keeps all constraints. Bounds and consistency are kept all the
                       // same, one by one
};

// Dual active-set method (Goldfarb and Idnani 1983) for min (y - x)' P^-1 (y - x); it needs columns of P only, adds the
// worst violated constraint and drops those whose multiplier would turn negative. It starts from the constraints that
// were active the last time. Inequalities move the mean only; equalities condition P too
// (docs/derivations.md, section 12).
class Projection {
 public:
  struct Active {
    HalfSpace row;
    int kind;  // state column with its bound, or k_equality, k_cut
    double multiplier;
  };
  Projection(const Model& model, const FilterSettings& settings);

  // What the last frames left: the constraints to start from, and a state that kept them.
  void forget();
  // Equalities, then inequalities; what they do is written to the tape, if there is one.
  ProjectionReport apply(Eigen::VectorXd& x, Eigen::MatrixXd& P, FrameTape* tape = nullptr);
  // Inequalities alone. make: makes a column of P, where not all are there; each is asked for before it is used. The
  // diagonal and what one segment's inertia shares are there.
  using MakeColumn = std::function<void(int)>;
  ProjectionReport bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P, const MakeColumn& make = {});
  // What the next apply() depends on, besides its arguments.
  struct Memory {
    std::vector<Active> active;
    Eigen::VectorXd last;
  };
  void save(Memory& out) const;
  void restore(const Memory& memory);
  const Consistency& consistency() const { return consistency_; }

 private:
  bool keep_equalities(Eigen::VectorXd& x, Eigen::MatrixXd& P, FrameTape* tape);
  void warm_start(const Eigen::MatrixXd& P, const MakeColumn& make, Eigen::VectorXd& x);
  bool worst_violation(const Eigen::VectorXd& x, const Eigen::MatrixXd& P, Active& out) const;
  bool add(Active incoming, const Eigen::MatrixXd& P, const MakeColumn& make, Eigen::VectorXd& x);
  bool push(const Active& active, const Eigen::MatrixXd& P, const MakeColumn& make);
  void drop(int k);
  bool factor();
  void fall_back(Eigen::VectorXd& x) const;

  const FilterSettings& settings_;
  const Consistency consistency_;
  std::vector<Active> active_, before_;
  int capacity_;
  int k_ = 0;  // active constraints
  bool fell_back_ = false;
  std::vector<std::vector<int>> equality_columns_;  // of each equality, where its row is not zero
  Eigen::MatrixXd PN_;                              // (n, capacity): P a of each active constraint
  Eigen::MatrixXd gram_, chol_;                     // N' P N and its factor
  Eigen::VectorXd Pa_, step_, r_, wanted_, last_;
  const Eigen::VectorXd start_;
};

}  // namespace dynakin
