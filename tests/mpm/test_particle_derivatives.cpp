// The elastic term over particles as a function: derivatives, the assembled matrix, the step bound.
#include <taut/materials/models.hpp>

#include "particle_problem.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

namespace taut {
namespace {

using namespace test;
using Catch::Matchers::WithinRel;

TEMPLATE_TEST_CASE(
    "the assembled Hessian of particles is their product", "[mpm][particles]",
    (Combination<FixedCorotated, FullProjection, QuadraticSpline, Fp64, RightOf<DefaultSpace>,
                 true>),
    (Combination<StableNeoHookean, ClampElement, CubicSpline, Fp64, LeftOf<DefaultSpace>, true>)) {
  using C = TestType;
  Problem<C> problem(1, 3);
  int const n = problem.scene.nodes();
  auto const host_fixed = Kokkos::create_mirror_view(problem.fixed);
  for (int i = 0; i < n; ++i) host_fixed(i) = i % 5 == 0;
  assign(problem.fixed, host_fixed);
  std::vector<Connectivity> kinds;
  problem.term.elements(kinds);
  typename C::Term::Matrix const matrix(pattern_from_elements(n, kinds));
  problem.term.add_to(matrix, problem.x, 0.3, problem.fixed);
  Field p = problem.p_host;
  for (int i = 0; i < n; i += 5) p[i] = Vec3<double>{};
  typename C::Term::Vectors const hp("hp", n);
  problem.term.add_product(problem.x, field_of<typename C::Term::Vectors>(p), 0.3, problem.fixed,
                           hp);
  auto const host = host_copy(matrix);
  Field product(n, Vec3<double>{});
  for (int i = 0; i < n; ++i)
    for (int k = host.row_begin(i); k < host.row_begin(i + 1); ++k) {
      product[i] = product[i] + host.block(k) * p[host.column(k)];
    }
  CHECK(difference(product, read(hp)) < 1e-12 * largest(product));
}

TEMPLATE_TEST_CASE(
    "value, gradient and product of particles are derivatives of each other", "[mpm][particles]",
    (Combination<FixedCorotated, FullProjection, QuadraticSpline, Fp64, RightOf<DefaultSpace>,
                 true>),
    (Combination<StableNeoHookean, ClampElement, CubicSpline, Fp64, LeftOf<DefaultSpace>, true>)) {
  using C = TestType;
  Problem<C> problem(1, 3);
  int const n = problem.scene.nodes();
  auto const& term = problem.term;
  using Vectors = typename C::Term::Vectors;
  auto const at = [&](double t) {
    Field moved(problem.x_host);
    for (int i = 0; i < n; ++i) moved[i] = moved[i] + t * problem.p_host[i];
    return field_of<typename C::Term::Positions>(moved);
  };
  auto const gradient = [&](double t) {
    Vectors const g("g", n);
    term.add_gradient(at(t), 1, problem.fixed, g);
    return read(g);
  };
  double const h = 1e-3;
  Field const g = gradient(0), up = gradient(h), down = gradient(-h);
  double slope = 0;
  for (int i = 0; i < n; ++i) slope += dot(g[i], problem.p_host[i]);
  CHECK_THAT((term.value(at(h), 1) - term.value(at(-h), 1)) / (2 * h), WithinRel(slope, 1e-6));
  CHECK_THAT(term.change(at(-h), problem.p, 2 * h, 1) / (2 * h), WithinRel(slope, 1e-6));

  // The product is that of the projected Hessian, which is the Hessian in p'Hp if nothing was
  // negative; here the strain is small enough.
  Vectors const hp("hp", n);
  term.add_product(problem.x, problem.p, 1, problem.fixed, hp);
  Field const product = read(hp);
  double curvature = 0, form = 0;
  for (int i = 0; i < n; ++i) {
    curvature += dot(up[i] - down[i], problem.p_host[i]) / (2 * h);
    form += dot(product[i], problem.p_host[i]);
  }
  CHECK(form >= curvature * (1 - 1e-6));
  CHECK(curvature > 0.5 * form);
}

TEST_CASE("a step bound of particles keeps them from inverting", "[mpm][particles]") {
  using C =
      Combination<NeoHookean, ClampElement, QuadraticSpline, Mixed, RightOf<DefaultSpace>, true>;
  Problem<C> problem;
  auto const& term = problem.term;
  int const n = problem.scene.nodes();
  // A collapse along x: det F = 0 where 1 + t du/dx vanishes.
  Field squeeze(n);
  auto const places = problem.scene.places();
  for (int i = 0; i < n; ++i) {
    squeeze[i] = {-problem.dx * places[i][0], 0.05 * problem.dx * places[i][1], 0};
  }
  auto const p = field_of<typename C::Term::Vectors>(squeeze);
  double const inf = std::numeric_limits<double>::infinity();
  double const bound = term.max_step(problem.x, p, inf), first = bound / C::Term::margin;
  auto const smallest_J = [&](double t) {
    double least = inf;
    Field u = problem.oracle.displacements(problem.x_host);
    for (int i = 0; i < n; ++i) u[i] = u[i] + t * squeeze[i];
    for (Particle const& q : problem.list) {
      least = std::min(least, determinant(q.F + problem.oracle.change_of_F(q, u)));
    }
    return least;
  };
  CHECK(first > 0.5);
  CHECK(first < 1.5);
  CHECK(smallest_J(0.999 * first) > 0);
  CHECK(smallest_J(1.001 * first) < 0);
  CHECK(term.max_step(problem.x, p, 0.25) == 0.25);
  CHECK(term.max_prescribed_step(problem.x, p, inf) == bound);
  // What p'Hp certifies on the way is valid, and not much less than there is.
  double certified = inf;
  term.quadratic_form(problem.x, p, 1, certified);
  CHECK(certified <= first);
  CHECK(certified > 0.2 * first);
  CHECK(smallest_J(certified) > 0);
  CHECK(smallest_J(-certified) > 0);
  // A material that tolerates inversion asks for nothing; prescribed motion still may not fold.
  Problem<Combination<FixedCorotated, ClampElement, QuadraticSpline, Mixed, RightOf<DefaultSpace>,
                      true>>
      tolerant;
  CHECK(tolerant.term.max_step(tolerant.x, p, inf) == inf);
  CHECK(tolerant.term.max_prescribed_step(tolerant.x, p, inf) == bound);
}

}  // namespace
}  // namespace taut
