// What the tests of Newton's method share.
#pragma once

#include "toy_objectives.hpp"

#include <taut/integrators/direct.hpp>
#include <taut/integrators/newton.hpp>

#include <algorithm>
#include <cmath>

namespace taut::test {

template <class Bond, class P = Fp64>
using Chain = toy::Chain<Bond, P>;
template <template <class...> class Linear, template <class...> class M = BlockJacobi,
          class P = Fp64>
using Method = Newton<Linear, M, SufficientDecrease, DecrementWindow, P>;

using Exact = Method<Direct, Identity>;
using Assembled = Method<AssembledPcg>;
using MatrixFree = Method<MatrixFreePcg>;

/// Largest difference of two fields, m.
template <class X, class Y>
double distance(X const& a, Y const& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.extent(0); ++i)
    for (int c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(double(a(i, c)) - double(b(i, c))));
  return largest;
}

/// The minimum to round-off.
template <class E>
typename E::Positions minimum_of(E e) {
  auto const x = e.start();
  Exact::Params params;
  params.stop.tolerance = 0;
  Exact(params).minimise(e, x);
  return x;
}

}  // namespace taut::test
