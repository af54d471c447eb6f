// The pairs of a contact term as friction sees them: at the lag point, pair k presses with
// lambda = -K m b'(d) along n on its vertices, in the proportions c of its closest points. What the
// mollifier of nearly parallel edges pulls otherwise is no normal force (Li et al. 2020).
#pragma once

#include <taut/contact/contact_kernels.hpp>
#include <taut/contact/friction_coefficients.hpp>
#include <taut/contact/lagged_contacts.hpp>

namespace taut::kernels {

template <class Pair, class Precision, class S>
struct LagPair {
  using Real = typename Precision::real;
  PairTable<Precision, S> pairs;
  VectorField<typename Precision::position, S> x;
  typename SurfaceViews<S>::Indices object;
  FrictionMatrix<S> mu;

  KOKKOS_FUNCTION bool operator()(int k, LaggedContact<Real>& to) const {
    return !pairs.idle(k) && lag(k, to);
  }
  [[gnu::noinline]] KOKKOS_FUNCTION bool lag(int k, LaggedContact<Real>& to) const {
    PairState<Real> s;
    if (!pairs.template acting<Pair>(k, x, s)) return false;
    double const coefficient = mu(object(pairs.vertex(k, 0)), object(pairs.vertex(k, 3)));
    to.limit = static_cast<Real>(coefficient) * -(s.m.value * s.b1);
    to.normal = s.n;
    for (int a = 0; a < 4; ++a) {
      to.vertex[a] = pairs.vertex(k, a);
      to.c[a] = s.at.c[a];
    }
    return to.limit > Real(0);
  }
};

}  // namespace taut::kernels
