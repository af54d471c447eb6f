#include "support/dense.hpp"

#include <Eigen/Dense>

namespace taut::test {

Eigenpairs eigenpairs(Dense const& symmetric) {
  Eigen::SelfAdjointEigenSolver<Dense> const eigen(symmetric);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigenpairs eigenpairs(Dense const& symmetric, Dense const& b) {
  Eigen::GeneralizedSelfAdjointEigenSolver<Dense> const eigen(symmetric, b);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Dense inverse(Dense const& a) { return a.inverse(); }

Eigen::VectorXd solve_symmetric(Dense const& a, Eigen::VectorXd const& b) {
  return a.ldlt().solve(b);
}

Eigen::VectorXd solve(Dense const& a, Eigen::VectorXd const& b) {
  return a.partialPivLu().solve(b);
}

Dense pseudo_inverse(Dense const& symmetric) {
  auto const [values, vectors] = eigenpairs(symmetric);
  Eigen::VectorXd inverse = values;
  for (double& value : inverse) value = value > 1e-10 * values.maxCoeff() ? 1 / value : 0;
  return vectors * inverse.asDiagonal() * vectors.transpose();
}

}  // namespace taut::test
