// A material by the edges of a tet against the same by its deformation gradient.
#include "samples.hpp"

#include <taut/materials/elastic.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;

// F, or its rotation, is needed there.
static_assert(!Elastic<Arap>::by_edges && !Elastic<FixedCorotated>::by_edges);
static_assert(!Elastic<NeoHookean, FullProjection>::by_edges);

namespace {

/// Inverse edges at rest, 1/m: of a good tet, of one numbered the other way round, of a flat one
/// and of one of a size of 1e-4 m.
std::vector<Mat3<double>> rest_shapes() {
  std::mt19937 rng(3);
  return {with_stretches(rng, 1, 1.3, 0.8), with_stretches(rng, 1, 1.2, -0.7),
          with_stretches(rng, 1, 1.5, 80), with_stretches(rng, 1.2e4, 8e3, 1e4)};
}

Mat3<double> inverse(Mat3<double> const& A) {
  return (1 / determinant(A)) * transpose(cofactor(A));
}

Vec3<double> corner_b(Mat3<double> const& B, int a) {
  Vec3<double> b{0, 0, 0};
  for (int c = 0; c < 3; ++c) b[c] = a < 3 ? B(a, c) : -(B(0, c) + B(1, c) + B(2, c));
  return b;
}

}  // namespace

TEMPLATE_TEST_CASE("edges of a tet give what its deformation gradient gives", "[materials]",
                   NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Law = Elastic<TestType>;
  static_assert(Law::by_edges);
  std::mt19937 rng(41);
  for (Mat3<double> const& B : rest_shapes()) {
    for (Mat3<double> const& F : deformations<TestType>()) {
      Mat3<double> const D = F * inverse(B), dF = random_matrix(rng, 0.02), d = dF * inverse(B);
      auto const byF = Law::evaluate(lame, F);
      auto const state = Law::evaluate_edges(lame, B, D);
      double const size = frobenius(F), shape = frobenius(B) * frobenius(inverse(B));
      double const round_off = 1e-13 * shape * shape, b2 = contract(B, B);
      double const stiffness = lame.lambda * (1 + std::pow(size, 4)) +
                               std::abs(byF.d.d33) * std::pow(size, 4) + std::abs(byF.d.d3) * size;
      CHECK_THAT(state.invariants.J,
                 WithinAbs(byF.invariants.J, round_off * (1 + size * size * size)));
      CHECK_THAT(state.invariants.I2, WithinAbs(byF.invariants.I2, round_off * size * size));
      Mat3<double> const P = Law::stress(byF);
      for (int a = 0; a < 4; ++a) {
        Vec3<double> const b = corner_b(B, a), f = P * b;
        auto const h = Law::block(byF, b), by_edges = Law::block(state, a);
        auto const diagonal = Law::diagonal(byF, b), diagonal_by_edges = Law::diagonal(state, a);
        for (int c = 0; c < 3; ++c) {
          double const accuracy = round_off * stiffness;
          if (a < 3)
            CHECK_THAT(Law::corner_stress(state, a)[c],
                       WithinAbs(f[c], accuracy * (1 + size) * std::sqrt(b2)));
          CHECK_THAT(diagonal_by_edges[c], WithinAbs(diagonal[c], accuracy * b2));
          CHECK_THAT(by_edges.s[c], WithinAbs(h.s[c], accuracy * b2));
          CHECK_THAT(by_edges.s[3 + c], WithinAbs(h.s[3 + c], accuracy * b2));
        }
      }
      double const step = frobenius(dF);
      CHECK_THAT(Law::quadratic(state, d),
                 WithinAbs(Law::quadratic(byF, dF), round_off * stiffness * step * step));
      if (TestType::allows_inversion || determinant(F - dF) > 1e-3) {
        CHECK_THAT(
            Law::change(lame, state, d),
            WithinAbs(Law::change(lame, byF, dF), round_off * stiffness * (1 + size) * step));
      }
    }
  }
}

TEST_CASE("a small step changes the energy by edges without cancellation in fp32", "[materials]") {
  // A step of 1e-6 of the edges: the difference of two energies in fp32 would be all round-off.
  using Law = Elastic<NeoHookean>;
  std::mt19937 rng(5);
  Mat3<double> const B = with_stretches(rng, 1, 1.3, 0.8), F = with_stretches(rng, 1.3, 1.1, 0.8);
  Mat3<double> const D = F * inverse(B), dF = random_matrix(rng, 1e-6), d = dF * inverse(B);
  Mat3<float> B32, D32, d32;
  for (int k = 0; k < 9; ++k) {
    B32.a[k] = float(B.a[k]);
    D32.a[k] = float(D.a[k]);
    d32.a[k] = float(d.a[k]);
  }
  auto const lame32 = Law::cast<float>(lame);
  double const exact = Law::change(lame, Law::evaluate_edges(lame, B, D), d);
  double const change = Law::change(lame32, Law::evaluate_edges(lame32, B32, D32), d32);
  double const size = frobenius(stress(evaluate<NeoHookean>(lame, F))) * frobenius(dF);
  CHECK_THAT(change, WithinAbs(exact, 1e-5 * size));
}
