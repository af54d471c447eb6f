// Dense linear algebra for oracles. Eigen's decompositions are compiled in dense.cpp alone: each
// costs every source that uses it seconds.
#pragma once

#include <Eigen/Core>

namespace taut::test {

using Dense = Eigen::MatrixXd;

struct Eigenpairs {
  Eigen::VectorXd values;  ///< ascending
  Dense vectors;           ///< columns
};

Eigenpairs eigenpairs(Dense const& symmetric);
/// A v = lambda B v with B positive definite; v'Bv = 1.
Eigenpairs eigenpairs(Dense const& symmetric, Dense const& b);

Dense inverse(Dense const& a);
/// By A's lower triangle.
Eigen::VectorXd solve_symmetric(Dense const& a, Eigen::VectorXd const& b);
Eigen::VectorXd solve(Dense const& a, Eigen::VectorXd const& b);

/// Of a symmetric matrix, by its eigenvalues above 1e-10 of the largest.
Dense pseudo_inverse(Dense const& symmetric);

}  // namespace taut::test
