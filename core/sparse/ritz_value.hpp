// What Lanczos' method knows of the largest eigenvalue of a matrix, from the tridiagonal matrix
// that it reduces it to.
#pragma once

#include <vector>

namespace taut {

/// The largest eigenvalue of the symmetric tridiagonal matrix with these diagonals, by bisection;
/// `beside` has one entry less.
double largest_tridiagonal(std::vector<double> const& diagonal, std::vector<double> const& beside);

struct RitzValue {
  double value = 1;     ///< from below
  double residual = 0;  ///< an eigenvalue lies within this of it
};
/// After as many steps, one or more, as there are entries in both; all of `beside` but the last are
/// above 0.
RitzValue largest_ritz_value(std::vector<double> const& diagonal,
                             std::vector<double> const& beside);

/// Lanczos' method in the form of conjugate gradients (Saad 2003, section 6.7.3): their step
/// lengths alpha and factors beta make the tridiagonal matrix.
class LanczosByConjugates {
public:
  /// The Ritz value after a further step, alpha > 0, of which the residual is beta >= 0 times the
  /// one before it, both squared in the metric of the preconditioner. With beta = 0 it is the last.
  RitzValue add(double alpha, double beta);

private:
  std::vector<double> diagonal_, beside_;
  double alpha_ = 1, beta_ = 0;  ///< of the step before
};

}  // namespace taut
