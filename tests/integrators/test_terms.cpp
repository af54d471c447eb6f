// Terms and their sum: derivatives against differences, products against the assembled matrix, and
// that elements of all lengths find their blocks.
#include "elastic_bar.hpp"

#include <taut/core/potential/any_terms.hpp>
#include <taut/core/potential/stencil_term.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/time_stepper.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <array>
#include <cmath>
#include <random>
#include <vector>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// k/2 |sum_a w_a x_a|^2 + c/4 |sum_a w_a x_a|^4: not linear, convex, and sensible where an element
/// names an unknown twice.
template <int N>
struct Bend {
  static constexpr int vertices = N;
  double k = 30, c = 20;

  KOKKOS_FUNCTION static double weight(int a) { return a == 0 ? 1.0 : a == 1 ? -1.5 : 0.4 * a; }
  KOKKOS_FUNCTION static Vec3<double> bend(Vec3<double> const (&x)[N]) {
    Vec3<double> d{};
    for (int a = 0; a < N; ++a) d = d + weight(a) * x[a];
    return d;
  }
  KOKKOS_FUNCTION double value(int, Vec3<double> const (&x)[N]) const {
    double const d2 = dot(bend(x), bend(x));
    return 0.5 * k * d2 + 0.25 * c * d2 * d2;
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int, Vec3<double> const (&x)[N], int a) const {
    Vec3<double> const d = bend(x);
    return (weight(a) * (k + c * dot(d, d))) * d;
  }
  KOKKOS_FUNCTION Mat3<double> curvature(int, Vec3<double> const (&x)[N], int a, int b) const {
    Vec3<double> const d = bend(x);
    Mat3<double> const h = (k + c * dot(d, d)) * identity3<double>() + (2 * c) * outer(d, d);
    return (weight(a) * weight(b)) * h;
  }
};

using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;

/// A field of n random vectors.
template <class Field>
Field random_field(int n, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-size, size);
  Field const field("random", n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) field(i, c) = number(random);
  return field;
}
template <class A, class B>
double product_of(A const& a, B const& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.extent(0); ++i)
    for (int c = 0; c < 3; ++c) sum += a(i, c) * b(i, c);
  return sum;
}
template <class A, class B>
double largest_difference(A const& a, B const& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.extent(0); ++i)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a(i, c) - b(i, c)));
  return largest;
}
template <class Field>
Field moved(Field const& x, Field const& p, double alpha) {
  Field const y("moved", x.extent(0));
  for (std::size_t i = 0; i < x.extent(0); ++i)
    for (int c = 0; c < 3; ++c) y(i, c) = x(i, c) + alpha * p(i, c);
  return y;
}

/// Everything that an Objective says about itself, at x along p. Lengths near 1.
template <class E, class Field>
void check_derivatives(E& e, Field const& x, Field const& p, double unit) {
  int const n = e.size();
  Field const g("g", n), ahead("ahead", n), behind("behind", n), hp("hp", n), again("again", n);
  double const h = 1e-4;
  e.gradient(x, g);
  e.product(x, p, hp);

  CHECK_THAT(e.difference(x, p, 0.3),
             WithinAbs(e.value(moved(x, p, 0.3)) - e.value(x), 1e-10 * unit));
  // Fourth order: errors of h^4 and of round-off over h.
  auto const slope = [&](double a) { return e.difference(x, p, a) - e.difference(x, p, -a); };
  CHECK_THAT((8 * slope(h) - slope(2 * h)) / (12 * h), WithinAbs(product_of(g, p), 1e-9 * unit));
  e.gradient(moved(x, p, h), ahead);
  e.gradient(moved(x, p, -h), behind);
  double worst = 0;
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs((ahead(i, c) - behind(i, c)) / (2 * h) - hp(i, c)));
    }
  CHECK(worst < 1e-5 * unit);
  CHECK_THAT(e.quadratic_form(x, p), WithinRel(product_of(p, hp), 1e-10));

  auto matrix = e.pattern(x);
  e.assemble(x, matrix);
  product(matrix, p, again);
  CHECK(largest_difference(again, hp) < 1e-12 * unit);

  // Gradient after a step, with curvature, which on the diagonal is that of the matrix.
  Field const diagonal("diagonal", n);
  BlockField<double, typename E::Space> const blocks("blocks", n);
  auto const y = moved(x, p, 0.01);
  CHECK_THAT(e.gradient_after(y, p, 0.01, again, diagonal),
             WithinAbs(e.difference(x, p, 0.01), 1e-12 * unit));
  e.gradient(y, g, blocks);
  CHECK(largest_difference(g, again) == 0);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) CHECK_THAT(diagonal(i, c), WithinRel(blocks(i, c), 1e-12));
}

}  // namespace

TEMPLATE_TEST_CASE("stencils of three, also where they name an unknown twice", "", DefaultSpace,
                   Left) {
  using S = TestType;
  using Term = StencilTerm<Bend<3>, Fp64, S>;
  std::vector<double> const mass{1, 2, 1.5, 1, 3};
  Unknowns<Fp64, S> const unknowns(mass, 1);
  unknowns.fixed(4) = 1;
  Term const term({}, {{0, 1, 2}, {2, 1, 2}, {3, 3, 0}, {1, 4, 3}, {4, 4, 4}}, 5);
  Potential<Inertia<Fp64, S>, Term> e(unknowns, Inertia<Fp64, S>(unknowns), term);
  using Field = VectorField<double, S>;
  auto const x = random_field<Field>(5, 1, 1), p = random_field<Field>(5, 1, 2);
  for (int c = 0; c < 3; ++c) p(4, c) = 0;
  e.begin_step(x, 0.25, 0.5, true);
  check_derivatives(e, x, p, 100);

  // The curvature of a term, block for block.
  BlockField<double, S> const blocks("blocks", 5);
  Field const g("g", 5);
  e.gradient(x, g, blocks);
  auto matrix = e.pattern(x);
  e.assemble(x, matrix);
  for (int i = 0; i < 5; ++i) {
    Mat3<double> const h = matrix.block(matrix.find(i, i));
    double const expected[6] = {h(0, 0), h(1, 1), h(2, 2), h(0, 1), h(1, 2), h(0, 2)};
    for (int k = 0; k < 6; ++k) CHECK_THAT(blocks(i, k), WithinAbs(expected[k], 1e-12));
  }
  for (int c = 0; c < 3; ++c) CHECK(g(4, c) == 0);
}

TEST_CASE("local terms: change, gradient and curvature") {
  std::vector<double> const mass{2, 3};
  Unknowns<Fp64> const unknowns(mass, 1);
  Inertia<Fp64> inertia(unknowns);
  BodyForce<Fp64> force(unknowns, {1, -9.81, 0.5});
  inertia.target()(1, 0) = 0.3;
  inertia.target()(1, 2) = -0.2;
  VectorField<double, DefaultSpace> const extra("extra", 2);
  extra(1, 1) = 7;
  auto const check = [](auto const& kernel) {
    Vec3<double> const x{0.4, -1, 2}, s{0.1, 0.2, -0.3};
    double const change = kernel.value(1, x + s) - kernel.value(1, x);
    CHECK_THAT(kernel.change(1, x, s), WithinAbs(change, 1e-13));
    // Quadratic at most: the model is exact.
    Vec3<double> const model = kernel.gradient(1, x) + 0.5 * (kernel.curvature(1, x) * s);
    CHECK_THAT(dot(model, s), WithinAbs(change, 1e-13));
    return change;
  };
  double const on = check(inertia.kernel(0.1));
  CHECK(on != 0);
  CHECK(inertia.kernel(5).value(1, {1, 1, 1}) == inertia.kernel(0.1).value(1, {1, 1, 1}));
  inertia.switch_on(false);
  CHECK(check(inertia.kernel(0.1)) == 0);

  double const gravity = check(force.kernel(0.1));
  CHECK_THAT(gravity, WithinRel(-0.1 * 3 * (0.1 - 9.81 * 0.2 - 0.15), 1e-13));
  force.set_forces(extra);
  CHECK_THAT(check(force.kernel(0.1)) - gravity, WithinRel(-0.1 * 7 * 0.2, 1e-12));
  force.set_forces({});
  CHECK(check(force.kernel(0.1)) == gravity);
}

TEST_CASE("a whole potential: tets, elements of two and of four, inertia, forces, fixed rows") {
  Bar<Fp64> const bar({1, 0.4, 0.4}, 5, 1e3);
  int const n = bar.size();
  AnyTerms<Fp64> terms;
  terms.add(StencilTerm<Bend<4>, Fp64>({}, {{0, 5, 9, 13}, {1, 20, 3, 1}}, n));
  terms.add(BarTets<Fp64>(bar.rest, lame_parameters(bar.young, 0.3)));
  // The last one is the shortest, and couples what no tet does.
  terms.add(StencilTerm<Bend<2>, Fp64>({}, {{0, n - 1}, {2, n - 3}}, n));
  BodyForce<Fp64> const force(bar.unknowns, {0, -9.81, 0});
  Potential e(bar.unknowns, Inertia<Fp64>(bar.unknowns), force, terms);
  e.begin_step(bar.positions(), 0.01, 0.1, true);

  SECTION("its derivatives") {
    // Drawn out everywhere: nothing is projected then.
    auto const x = random_field<VectorField<double, DefaultSpace>>(n, 1e-3, 3);
    auto const p = random_field<VectorField<double, DefaultSpace>>(n, 1, 4);
    int free = 0;
    for (int i = 0; i < n; ++i) {
      free += !bar.unknowns.fixed(i);
      for (int c = 0; c < 3; ++c) {
        x(i, c) += 1.1 * bar.rest.points[i][c];
        if (bar.unknowns.fixed(i)) p(i, c) = 0;
      }
    }
    REQUIRE(free < n);
    check_derivatives(e, x, p, 10);
    VectorField<double, DefaultSpace> const g("g", n);
    e.gradient(x, g);
    double at_fixed = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) at_fixed += bar.unknowns.fixed(i) * std::abs(g(i, c));
    CHECK(at_fixed == 0);
  }
  SECTION("Newton on its assembled matrix") {
    State<Fp64> state(bar.positions());
    ImplicitEuler<Newton<AssembledPcg, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>>
        stepper;
    CHECK(stepper.step(e, state, 0.1).converged());
  }
}
