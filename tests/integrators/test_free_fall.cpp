// A body that falls freely starts each step where it ends: all that is left is round-off.
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

using namespace taut;

TEMPLATE_TEST_CASE("a free fall takes one window of iterations and no backtracking", "", Fp64,
                   Mixed, Fp32) {
  using P = TestType;
  double const h = 0.01, gravity = 9.81;
  Body<P> const body(make_shape(BoxShape{{0.4, 0.4, 0.4}}, 3), 1000);
  Potential scene(body.unknowns, Inertia<P>(body.unknowns),
                  BodyForce<P>(body.unknowns, {0, -gravity, 0}),
                  ElasticTets<Elastic<StableNeoHookean>, P>(body.rest, lame_parameters(3e5, 0.4)));
  ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>> stepper;
  State<P> state(body.positions());
  double fallen = 0;
  for (int n = 1; n <= 10; ++n) {
    auto const report = stepper.step(scene, state, h);
    CAPTURE(n, to_string(report.stop), report.iterations, report.backtracks);
    CHECK(report.converged());
    CHECK(report.iterations <= 8);
    CHECK(report.backtracks == 0);
    fallen += h * n * h * gravity;
  }
  auto const x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), state.x);
  double furthest = 0;
  for (std::size_t v = 0; v < x.extent(0); ++v)
    for (int c = 0; c < 3; ++c) {
      double const expected = body.rest.points[v][c] - (c == 1 ? fallen : 0);
      furthest = std::max(furthest, std::abs(double(x(v, c)) - expected));
    }
  CHECK(furthest < 10 * 4 * 10 * double(Kokkos::Experimental::epsilon_v<typename P::real>));
}

TEST_CASE("the paper's rules end a free fall, where neither a gradient nor a direction is left",
          "") {
  Body<> const body(make_shape(BoxShape{{0.4, 0.4, 0.4}}, 2), 1000);
  Potential scene(body.unknowns, Inertia(body.unknowns), BodyForce(body.unknowns, {0, -10, 0}),
                  ElasticTets<Elastic<StableNeoHookean>>(body.rest, lame_parameters(3e5, 0.4)));
  using Paper = Ncg<DaiKou, Jacobi, NewtonStep, EnergyDrop>;
  ImplicitEuler<Paper> stepper(Paper::Params{.safeguard = {.on = false}});
  State<> state(body.positions());
  for (int n = 1; n <= 3; ++n) {
    auto const report = stepper.step(scene, state, 0.01);
    CAPTURE(n, to_string(report.stop), report.iterations);
    CHECK(report.converged());
    CHECK(report.iterations <= 4);
  }
}
