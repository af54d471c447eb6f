// The curvature filters: positive semi-definite, and each what it says.
#include "samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <limits>

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

namespace {

/// Where sums of singular values vanish, F repeats its singular values or is no deformation at all.
template <class Model>
std::vector<Mat3<double>> degenerate() {
  std::mt19937 rng(41);
  std::vector<Mat3<double>> all = {with_stretches(rng, 1.3, 1.3, 0.7),
                                   with_stretches(rng, 0.9, 0.6, 0.6),
                                   with_stretches(rng, 0.8, 0.8, 0.8)};
  if (!Model::allows_inversion) return all;
  Mat3<double> const axes = {{1.5, 0, 0, 0, 0, 0, 0, 0, 0}};
  all.insert(all.end(),
             {Mat3<double>{}, axes, with_stretches(rng, 2.0, 0.0, 0.0),
              with_stretches(rng, 1.2, 0.7, 0.0), with_stretches(rng, 0.7, 0.7, 0.0),
              with_stretches(rng, 1, 1, -1), with_stretches(rng, 0.6, 0.6, -0.6),
              with_stretches(rng, 1.4, 0.5, 1e-5 - 0.5), with_stretches(rng, 1.4, 1e-5, 0.0),
              with_stretches(rng, 1e-5, 0.0, 0.0), with_stretches(rng, 2.0, 1.0, -0.8)});
  return all;
}

template <class T>
constexpr double eps = std::numeric_limits<T>::epsilon();

/// Largest entry and smallest over largest eigenvalue of a filtered block.
template <class T>
void check_block(Sym3<T> const& block, double bound) {
  Sym3<double> wide;
  for (int k = 0; k < 6; ++k) {
    wide.s[k] = block.s[k];
    CHECK(std::abs(wide.s[k]) <= bound);
  }
  SymmetricEigen<double> const e = symmetric_eigen(wide);
  CHECK(e.values[2] >= -32 * eps<T> * e.values[0]);
}

template <class Model, class T>
void check_degenerate() {
  INFO(Model::name);
  std::mt19937 rng(43);
  Lame<T> const p = {static_cast<T>(lame.mu), static_cast<T>(lame.lambda)};
  for (Mat3<double> const& wide : degenerate<Model>()) {
    Mat3<T> F, dF;
    for (int k = 0; k < 9; ++k) F.a[k] = static_cast<T>(wide.a[k]);
    for (int repeat = 0; repeat < 20; ++repeat) {
      Mat3<double> const random = random_matrix(rng);
      for (int k = 0; k < 9; ++k) dF.a[k] = static_cast<T>(random.a[k]);
      Vec3<T> const b = dF.column(0);
      auto const state = evaluate<Model>(p, F);
      // A vertex's block without its negative parts is at most 2 d2 |b|^2 + d33 |C b|^2 and so on:
      // of the order of the moduli, whatever the curvature of the rotation.
      double const size = 1 + contract(wide, wide), b2 = dot(b, b);
      double const bound = 20 * (lame.mu + lame.lambda) * size * size * b2;
      check_block(ClampElement::block<Model>(state, b), bound);
      check_block(LimitLambda::block<Model>(state, b), bound);
      check_block(FullProjection::block<Model>(state, b), bound);
      for (double form : {double(ClampElement::quadratic<Model>(state, dF)),
                          double(LimitLambda::quadratic<Model>(state, dF)),
                          double(FullProjection::quadratic<Model>(state, dF))}) {
        CHECK(form >= 0);
        CHECK(form <= 10 * bound * contract(random, random) / b2);
      }
      for (Vec3<T> const& d :
           {ClampElement::diagonal<Model>(state, b), LimitLambda::diagonal<Model>(state, b),
            FullProjection::diagonal<Model>(state, b)}) {
        for (int k = 0; k < 3; ++k) {
          CHECK(d[k] >= 0);
          CHECK(d[k] <= bound);
        }
      }
    }
  }
}

/// A model whose derivatives are what no energy of this library has: all negative.
struct Concave {
  static constexpr char const* name = "concave";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d3 = true, .d22 = true};
  template <class T>
  static InvariantDerivatives<T> derivatives(Lame<T> const&, Invariants<T> const&) {
    return {.d1 = T(0), .d2 = T(-1), .d3 = T(2), .d11 = T(0), .d22 = T(-1), .d33 = T(-1)};
  }
};

/// And one whose rotation bends more than its stretch can bear.
struct Bent {
  static constexpr char const* name = "bent";
  static constexpr bool allows_inversion = true;
  static constexpr InvariantUse use{.d1 = true, .d11 = true};
  template <class T>
  static InvariantDerivatives<T> derivatives(Lame<T> const&, Invariants<T> const&) {
    return {.d1 = T(-10), .d2 = T(1), .d3 = T(0), .d11 = T(-1), .d22 = T(0), .d33 = T(0)};
  }
};

}  // namespace

TEMPLATE_TEST_CASE("filters hold where singular values meet and vanish", "[materials]", Arap,
                   FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  check_degenerate<TestType, double>();
  check_degenerate<TestType, float>();
}

TEMPLATE_TEST_CASE("filters hold for any model", "[materials]", Concave, Bent) {
  check_degenerate<TestType, double>();
}

TEMPLATE_TEST_CASE("the projected frame is the projected 9x9 matrix", "[materials]", Arap,
                   FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018) {
  using Model = TestType;
  auto all = deformations<Model>();
  auto const more = degenerate<Model>();
  all.insert(all.end(), more.begin(), more.end());
  for (Mat3<double> const& F : all) {
    auto const state = evaluate<Model>(lame, F);
    SquareMatrix<double, 9> H;
    for (int q = 0; q < 9; ++q) {
      Mat3<double> e{};
      e.a[q] = 1;
      Mat3<double> const column = stress_change(state, e);
      for (int r = 0; r < 9; ++r) H(r, q) = column.a[r];
    }
    double size = 0;
    for (int q = 0; q < 9; ++q)
      for (int r = 0; r < q; ++r) {
        // Symmetric to rounding.
        H(r, q) = H(q, r) = 0.5 * (H(r, q) + H(q, r));
      }
    for (double entry : H.a) size = std::max(size, std::abs(entry));
    SquareMatrix<double, 9> const projected = project_psd(H);
    auto const frame = singular_frame<Model>(state);
    double worst = 0;
    for (int q = 0; q < 9; ++q) {
      Mat3<double> e{};
      e.a[q] = 1;
      Mat3<double> const column = frame.apply(e);
      for (int r = 0; r < 9; ++r) {
        worst = std::max(worst, std::abs(column.a[r] - projected(r, q)));
      }
    }
    // The error of F's smallest stretch is that of F, and J amplifies it.
    CHECK(worst < 200 * eps<double> * (size + lame.lambda * (1 + contract(F, F))));
  }
}
