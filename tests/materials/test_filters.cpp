// The curvature filters: positive semi-definite, and each what it says.
#include "samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEMPLATE_TEST_CASE("filters give positive semi-definite curvature and agree where it is",
                   "[materials]", Arap, FixedCorotated, NeoHookean, StableNeoHookean,
                   StableNeoHookean2018) {
  using Model = TestType;
  std::mt19937 rng(19);
  for (Mat3<double> const& F : deformations<Model>()) {
    auto const state = evaluate<Model>(lame, F);
    auto const frame = singular_frame<Model>(state);
    double exact_min = 0;
    for (int k = 0; k < 200; ++k) {
      Mat3<double> const dF = random_matrix(rng);
      double const form = quadratic_form(state, dF), size = lame.lambda * contract(dF, dF) * 100;
      exact_min = std::min(exact_min, form);
      double const projected = contract(frame.apply(dF), dF);
      CHECK(projected >= std::max(form, 0.0) - 1e-10 * size);
      CHECK_THAT((FullProjection::quadratic<Model>(state, dF)), WithinAbs(projected, 1e-10 * size));
      CHECK((ClampElement::quadratic<Model>(state, dF)) == std::max(form, 0.0));
      CHECK((LimitLambda::quadratic<Model>(state, dF)) >= 0);
      Vec3<double> const b = dF.column(0), u = dF.column(1);
      auto const nonnegative = [&](Sym3<double> const& h) {
        return quadratic(h, u) >= -1e-10 * size * dot(b, b);
      };
      CHECK(nonnegative(ClampElement::block<Model>(state, b)));
      CHECK(nonnegative(LimitLambda::block<Model>(state, b)));
      CHECK(nonnegative(FullProjection::block<Model>(state, b)));
      Sym3<double> const full = FullProjection::block<Model>(state, b);
      CHECK_THAT(quadratic(full, u), WithinAbs(contract(frame.apply(outer(u, b)), outer(u, b)),
                                               1e-9 * size * (1 + dot(b, b))));
    }
  }
}
