// Boundaries of the grid: their shapes, and what bodies do that stick to them, slide along them,
// part from them and rub against them.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>
#include <taut/mpm/slip.hpp>

#include "particle_scenes.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <random>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using S = DefaultSpace;
using P = Fp64;
using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>, QuadraticSpline, P>;
using Minimiser = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>;

TEST_CASE("the distance to a boundary grows by one along its normal", "[mpm][boundary]") {
  std::mt19937 random(5);
  auto const unit = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
  for (auto const shape : {BoundaryShape::half_space, BoundaryShape::box, BoundaryShape::ball,
                           BoundaryShape::cylinder, BoundaryShape::torus})
    for (bool const outside : {false, true}) {
      Boundary b;
      b.shape = shape;
      b.outside = outside;
      b.size = shape == BoundaryShape::box ? Vec3<double>{1, 0.6, 0.8} : Vec3<double>{0.6, 0.3, 0};
      b.pose = {turn_matrix({{0.6, 0, 0.8}, 0.9}), {1, 2, 3}};
      int smooth = 0, held = 0;
      for (int n = 0; n < 300; ++n) {
        Vec3<double> const x = b.pose(Vec3<double>{unit(), unit(), unit()});
        Vec3<double> normal, unused;
        double const d = b.distance(x, normal), h = 1e-6;
        CHECK_THAT(norm(normal), WithinAbs(1, 1e-12));
        CHECK(b.holds(x) == (d <= 0));
        held += d <= 0;
        double const along =
            b.distance(x + h * normal, unused) - b.distance(x - h * normal, unused);
        CHECK(std::abs(along) <= 2 * h * (1 + 1e-6));
        // But for the edges inside of boxes and cylinders, and the middles of balls.
        smooth += std::abs(along / (2 * h) - 1) < 1e-5;
        if (std::abs(along / (2 * h) - 1) < 1e-5) {
          Vec3<double> const foot = x - d * normal;
          if (d > 0 && !outside) CHECK_THAT(b.distance(foot, unused), WithinAbs(0, 1e-9));
        }
      }
      CHECK(smooth > 290);
      CHECK(held > 5);
      CHECK(held < 295);
    }
}

struct Run {
  double dx = 0.1;
  Particles<P, S> particles;
  ParticleGrid<QuadraticSpline, P> grid{0.1};
  Potential<Inertia<P>, BodyForce<P>, Solid, Slip<P>> scene;
  ParticleStepper<ImplicitEuler<Minimiser>> stepper;
  BoundaryList<S> boundaries;
  double time = 0;
  int iterations = 0;

  Run(std::vector<Particle> const& list, std::vector<BoundarySpec> specs,
      Vec3<double> const& gravity, int passes = 1)
      : particles(list),
        scene(grid.unknowns(), Inertia<P>(grid.unknowns()), BodyForce<P>(grid.unknowns(), gravity),
              Solid({lame_parameters(1e5, 0.3)}), Slip<P>()),
        stepper(ImplicitEuler<Minimiser>({.stop = {.tolerance = 1e-5}}, {.passes = passes})),
        boundaries(std::move(specs)) {}
  std::vector<Particle> run(int steps, double h) {
    for (int n = 0; n < steps; ++n, time += h) {
      auto const report = stepper.step(scene, grid, particles, h, boundaries, time);
      CHECK(report.minimiser.converged());
      iterations += report.minimiser.iterations;
    }
    return particles.read();
  }
  /// Of the first boundary, N.
  Vec3<double> force() { return scene.term<Slip<P>>().force(stepper.nodes().x, 0); }
  /// How fast nodes move into the first boundary, mass-weighted rms, m/s.
  double intrusion() const {
    double sum = 0, mass = 0;
    for (int n = 0; n < grid.size(); ++n) {
      Vec3<double> const x{grid.rest()(n, 0), grid.rest()(n, 1), grid.rest()(n, 2)};
      Boundary const& b = boundaries.list()(0);
      Vec3<double> normal, v = -b.velocity_at(x);
      mass += grid.unknowns().mass(n);
      if (b.distance(x, normal) > 0) continue;
      for (int c = 0; c < 3; ++c) v[c] += stepper.nodes().v(n, c);
      double const across = std::min(dot(normal, v), 0.0);
      sum += grid.unknowns().mass(n) * across * across;
    }
    return std::sqrt(sum / mass);
  }
};
/// A cube of 0.3 m, or so many cells, on the plane y = 0, moving.
std::vector<Particle> cube(Vec3<double> const& v, int cells = 3) {
  auto list = test::jittered_block(cells, 2, 0.1, {0.2, 0, 0.2});
  for (Particle& p : list) {
    p.F = identity3<double>();
    p.C = 0.0 * identity3<double>();
    p.v = v;
    p.stiffness = 1;
  }
  return list;
}
Vec3<double> mean_velocity(std::vector<Particle> const& list) {
  Vec3<double> sum{};
  double mass = 0;
  for (Particle const& p : list) {
    sum = sum + p.mass * p.v;
    mass += p.mass;
  }
  return (1 / mass) * sum;
}
BoundarySpec floor_of(BoundaryContact contact, double friction = 0) {
  return {.name = "floor", .contact = contact, .friction = friction};
}

TEST_CASE("a body slides along what slips, and rests on it", "[mpm][boundary]") {
  for (auto const contact : {BoundaryContact::slip, BoundaryContact::separate}) {
    auto const start = cube({1, 0, 0.5});
    Run run(start, {floor_of(contact)}, {0, -10, 0});
    auto const end = run.run(25, 0.01);
    Vec3<double> const v = mean_velocity(end);
    CHECK_THAT(v[0], WithinAbs(1, 1e-3));
    CHECK_THAT(v[2], WithinAbs(0.5, 1e-3));
    CHECK(std::abs(v[1]) < 0.1);
    double lowest = 1;
    for (Particle const& p : end) lowest = std::min(lowest, p.x[1]);
    CHECK(lowest > 0);
    CHECK(lowest < 0.05);
  }
}

TEST_CASE("a body leaves what separates, and not what slips", "[mpm][boundary]") {
  Run free(cube({0, 1, 0}), {floor_of(BoundaryContact::separate)}, {0, 0, 0});
  CHECK_THAT(mean_velocity(free.run(5, 0.01))[1], WithinAbs(1, 1e-3));
  Run held(cube({0, 1, 0}), {floor_of(BoundaryContact::slip)}, {0, 0, 0});
  CHECK(mean_velocity(held.run(12, 0.01))[1] < 0.6);
}

double total_mass(std::vector<Particle> const& list) {
  double mass = 0;
  for (Particle const& p : list) mass += p.mass;
  return mass;
}

TEST_CASE("a body that lands on what separates bounces and is let go", "[mpm][boundary]") {
  // 20 cm above the reach of the nodes that the floor holds, at 4 m/s.
  auto list = cube({0.5, -4, 0});
  for (Particle& p : list) p.x[1] += 0.2;
  Run run(list, {floor_of(BoundaryContact::separate)}, {0, 0, 0}, 8);
  double const mass = total_mass(list), h = 0.002;
  double before = -4, most = 0;
  bool touched = false;
  for (int n = 0; n < 150; ++n) {
    run.run(1, h);
    double const after = mean_velocity(run.particles.read())[1], force = run.force()[1];
    // It is the floor alone that changes the momentum, never downwards.
    CHECK_THAT(force * h / mass, WithinAbs(after - before, 2e-4));
    CHECK(force >= -1e-3 * mass / h);
    CHECK(run.intrusion() < 4e-3);
    touched = touched || force > 0;
    most = std::max(most, force);
    before = after;
  }
  CHECK(touched);
  CHECK(most > 2 * 4 * mass / (150 * h));
  CHECK(run.force()[1] == 0);  // it has left
  Vec3<double> const v = mean_velocity(run.particles.read());
  CHECK(v[1] > 1);
  CHECK(v[1] < 4);
  CHECK_THAT(v[0], WithinAbs(0.5, 1e-3));
}

TEST_CASE("what separates bears the weight of a body at rest, which does not sink",
          "[mpm][boundary]") {
  for (auto const contact : {BoundaryContact::slip, BoundaryContact::separate}) {
    auto const list = cube({0, 0, 0});
    Run run(list, {floor_of(contact)}, {0, -10, 0}, 8);
    run.run(60, 0.02);
    CHECK_THAT(run.force()[1], WithinRel(10 * total_mass(list), 2e-3));
    CHECK(std::abs(run.force()[0]) < 1e-12);
    CHECK(std::abs(mean_velocity(run.particles.read())[1]) < 2e-5);
    CHECK(run.intrusion() < 2e-5);
  }
}

TEST_CASE("a wall that comes pushes what separates, and one that goes leaves it behind",
          "[mpm][boundary]") {
  auto const moving = [](double speed) {
    BoundarySpec wall = floor_of(BoundaryContact::separate);
    wall.motion = [=](double t) {
      return BoundaryMotion{{identity3<double>(), {0, speed * t, 0}}, {0, speed, 0}, {}};
    };
    return wall;
  };
  Run pushed(cube({0, 0, 0}), {moving(0.5)}, {0, 0, 0}, 8);
  CHECK(mean_velocity(pushed.run(30, 0.01))[1] > 0.49);
  CHECK(pushed.intrusion() < 5e-4);
  Run left(cube({0, 0, 0}), {moving(-0.5)}, {0, 0, 0}, 8);
  CHECK_THAT(norm(mean_velocity(left.run(10, 0.01))), WithinAbs(0, 1e-6));
}

TEST_CASE("what separates takes about as many iterations as what sticks", "[mpm][boundary]") {
  auto const iterations = [](BoundaryContact contact) {
    Run run(cube({0.3, -2, 0}), {floor_of(contact)}, {0, -10, 0}, 8);
    run.run(25, 0.01);
    return run.iterations;
  };
  int const sticks = iterations(BoundaryContact::sticky);
  CHECK(iterations(BoundaryContact::slip) <= 1.5 * sticks);
  CHECK(iterations(BoundaryContact::separate) <= 2 * sticks);
}

TEST_CASE("friction slows a body down by mu g, and holds it where that is enough",
          "[mpm][boundary]") {
  Run sliding(cube({2, 0, 0}), {floor_of(BoundaryContact::slip, 0.3)}, {0, -10, 0}, 3);
  sliding.run(10, 0.01);  // it lands
  double const before = mean_velocity(sliding.particles.read())[0];
  double const after = mean_velocity(sliding.run(30, 0.01))[0];
  CHECK_THAT((before - after) / 0.3, WithinRel(3.0, 0.05));
  // On a slope of 0.2 with a friction of 0.5: gravity is turned instead of the plane.
  Run resting(cube({0, 0, 0}), {floor_of(BoundaryContact::slip, 0.5)}, {2, -10, 0}, 3);
  CHECK(std::abs(mean_velocity(resting.run(30, 0.01))[0]) < 0.05);
}

TEST_CASE("a step says whether the passes were enough for what lags", "[mpm][boundary]") {
  // It lands, and slides.
  auto const unsettled = [](int passes) {
    Run run(cube({2, -1, 0}), {floor_of(BoundaryContact::separate, 0.3)}, {0, -10, 0}, passes);
    int sum = 0;
    for (int n = 0; n < 3; ++n) {
      sum += run.stepper.step(run.scene, run.grid, run.particles, 0.01, run.boundaries).unsettled;
    }
    return sum;
  };
  CHECK(unsettled(1) > 0);
  CHECK(unsettled(20) == 0);
}

TEST_CASE("a corner of three planes holds a body in all of them", "[mpm][boundary]") {
  // Planes that are not at right angles, and a body that is pushed into their corner.
  std::vector<BoundarySpec> specs;
  for (auto const& [axis, angle] :
       {std::pair{Vec3<double>{1, 0, 0}, 0.3}, std::pair{Vec3<double>{0, 0, 1}, -1.3},
        std::pair{Vec3<double>{1, 0, 0}, 1.3}}) {
    specs.push_back({.name = "wall",
                     .contact = BoundaryContact::slip,
                     .motion = at_rest({turn_matrix({axis, angle}), {0.25, 0.1, 0.25}})});
  }
  Run run(cube({-1, -1, -1}), specs, {-5, -10, -5});
  run.run(3, 0.01);
  auto const& state = run.stepper.nodes();
  auto const& rest = run.grid.rest();
  int triple = 0;
  for (int n = 0; n < run.grid.size(); ++n) {
    Vec3<double> const x{rest(n, 0), rest(n, 1), rest(n, 2)};
    int held = 0;
    for (int k = 0; k < 3; ++k) {
      Vec3<double> normal;
      if (run.boundaries.list()(k).distance(x, normal) > 0) continue;
      ++held;
      double across = 0;
      for (int c = 0; c < 3; ++c) across += normal[c] * state.v(n, c);
      CHECK(std::abs(across) < 0.02);
    }
    triple += held == 3;
  }
  CHECK(triple > 0);
}

/// What moves at a constant velocity.
BoundarySpec moving_ball(Vec3<double> const& centre, Vec3<double> const& velocity) {
  return {
      .name = "ball", .shape = BoundaryShape::ball, .size = {0.15, 0, 0}, .motion = [=](double t) {
        return BoundaryMotion{{identity3<double>(), centre + t * velocity}, velocity, {}};
      }};
}

TEST_CASE("a fast boundary pushes particles that rest instead of passing them", "[mpm][boundary]") {
  double const frame = 0.3;
  Run run(cube({0, 0, 0}, 1), {moving_ball({-0.2, 0.05, 0.07}, {3, 0, 0})}, {0, 0, 0});
  int steps = 0;
  while (run.time < frame) {
    double const left = frame - run.time;
    double const h = run.stepper.cfl_step(run.particles, run.dx, left, run.boundaries, run.time);
    auto const report =
        run.stepper.step(run.scene, run.grid, run.particles, h, run.boundaries, run.time);
    run.time = report.time_step < left ? run.time + report.time_step : frame;
    ++steps;
  }
  CHECK(mean_velocity(run.particles.read())[0] > 1.5);
  CHECK(steps < 40);
}

TEST_CASE("steps are shortened by boundaries that are near and move", "[mpm][boundary]") {
  // Particles see 2.6 cells far, and may go one: what is 5 m away has room for most of that.
  auto const step_with = [](BoundarySpec const& spec, double longest) {
    Run run(cube({0, 0, 0}), {spec}, {0, 0, 0});
    return run.stepper.cfl_step(run.particles, run.dx, longest, run.boundaries, 0);
  };
  Vec3<double> const near{0.17, 0.15, 0.17}, far{-5, 0.15, 0.17};
  CHECK_THAT(step_with(moving_ball(near, {10, 0, 0}), 1), WithinRel(0.006, 1e-12));
  CHECK(step_with(moving_ball(near, {0, 0, 0}), 1) == 1);
  CHECK(step_with(moving_ball(far, {10, 0, 0}), 0.2) == 0.2);
  double const met = step_with(moving_ball(far, {10, 0, 0}), 10);
  CHECK(met > 0.4);
  CHECK(met < 0.5);
  // Turning about its middle, 0.26 m from the farthest particle at most.
  BoundarySpec turning = moving_ball(near, {0, 0, 0});
  turning.motion = [=](double) {
    return BoundaryMotion{{identity3<double>(), near}, {0, 0, 0}, {0, 10, 0}};
  };
  double const turned = step_with(turning, 1);
  CHECK(turned > 0.06 / (10 * 0.3));
  CHECK(turned < 0.06 / (10 * 0.15));
  // One that begins to move late in the step.
  BoundarySpec late = moving_ball(near, {0, 0, 0});
  late.motion = [=](double t) {
    return BoundaryMotion{{identity3<double>(), near}, {t > 0.8 ? 10.0 : 0.0, 0, 0}, {}};
  };
  CHECK_THAT(step_with(late, 1), WithinRel(0.006, 1e-12));
}

TEST_CASE("a step in which boundaries would fold what they hold is halved", "[mpm][boundary]") {
  using Firm = ElasticParticles<Elastic<NeoHookean, FullProjection>, QuadraticSpline, P>;
  // Two jaws that hold all nodes between them, and close by two cells in the step.
  std::vector<BoundarySpec> jaws;
  for (double const side : {-1.0, 1.0}) {
    Vec3<double> const velocity{-5 * side, 0, 0};
    jaws.push_back(
        {.name = "jaw", .shape = BoundaryShape::box, .size = {1, 4, 4}, .motion = [=](double t) {
           return BoundaryMotion{
               {identity3<double>(), Vec3<double>{0.17 + 0.52 * side, 0, 0} + t * velocity},
               velocity,
               {}};
         }});
  }
  ParticleGrid<QuadraticSpline, P> grid(0.1);
  Potential<Inertia<P>, Firm> scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                                    Firm({lame_parameters(1e5, 0.3)}));
  ParticleStepper<ImplicitEuler<Minimiser>> stepper;
  Particles<P, S> const particles(cube({0, 0, 0}));
  BoundaryList<S> boundaries(jaws);
  auto const report = stepper.step(scene, grid, particles, 0.02, boundaries);
  CHECK(report.halvings > 0);
  for (Particle const& p : particles.read()) CHECK(determinant(p.F) > 0);
}

TEST_CASE("what sticks goes where the boundary goes, turning too", "[mpm][boundary]") {
  BoundarySpec plate{.name = "plate", .shape = BoundaryShape::cylinder, .size = {2, 0.2, 0}};
  plate.motion = [](double t) {
    return BoundaryMotion{
        {turn_matrix({{0, 1, 0}, 2 * t}), {0, 0.1 + 0.5 * t, 0}}, {0, 0.5, 0}, {0, 2, 0}};
  };
  Run run(cube({0, 0, 0}), {plate}, {0, 0, 0});
  run.run(1, 0.01);
  auto const& state = run.stepper.nodes();
  auto const& rest = run.grid.rest();
  int held = 0;
  for (int n = 0; n < run.grid.size(); ++n) {
    if (!run.grid.unknowns().fixed(n)) continue;
    ++held;
    CHECK(rest(n, 1) < 0.205 + 1e-9);
    CHECK_THAT(state.v(n, 0), WithinAbs(2 * rest(n, 2), 1e-6));
    CHECK_THAT(state.v(n, 1), WithinAbs(0.5, 1e-6));
    CHECK_THAT(state.v(n, 2), WithinAbs(-2 * rest(n, 0), 1e-6));
  }
  CHECK(held > 50);
}

TEST_CASE("slip is the derivative of its energy, with friction", "[mpm][boundary]") {
  // Nodes around the edge of a ramp and a floor that part, slide and rub.
  std::vector<BoundarySpec> specs{floor_of(BoundaryContact::separate, 0.4)};
  specs.push_back(
      {.name = "ramp", .contact = BoundaryContact::slip, .friction = 0.2, .motion = [](double) {
         return BoundaryMotion{{turn_matrix({{0, 0, 1}, 0.5}), {0, 0, 0}}, {0.3, 0, 0}, {0, 0, 1}};
       }});
  BoundaryList<S> boundaries(specs);
  using Term = Slip<Fp64, S>;
  static_assert(LaggedTerm<Term>);
  int const n = 64;
  typename Term::Positions const rest("rest", n), x("x", n);
  typename Term::Vectors const p("p", n), g("g", n), hp("hp", n), diagonal("d", n);
  typename Term::Blocks const blocks("b", n);
  typename Term::Vectors const start("start", n);
  Array<double, S> const resists("resists", n);
  Unknowns<Fp64, S> const unknowns(std::vector<double>(n, 0.002), 0.1);
  FixedMask<S> const& fixed = unknowns.fixed;
  std::mt19937 random(9);
  auto const unit = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
  for (int i = 0; i < n; ++i) {
    resists(i) = 10 + unit();
    for (int c = 0; c < 3; ++c) {
      rest(i, c) = unit();
      x(i, c) = rest(i, c) + 0.01 * unit();
      p(i, c) = unit();
      start(i, c) = 0.001 * unit();
    }
  }
  Term term({.steepness = 100, .stick_speed = 0.3});
  double const h = 0.02;
  term.hold(rest, unknowns, boundaries, h);
  term.begin_step({rest, h, resists, start, h * h, 0.002});
  CHECK(term.relag(x));
  auto const moved = [&](double t) {
    typename Term::Positions const to("moved", n);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) to(i, c) = x(i, c) + t * p(i, c);
    return to;
  };
  double const scale = 0.7, t = 1e-7;
  double const exact = term.value(moved(0.003), scale) - term.value(x, scale);
  CHECK_THAT(term.change(x, p, 0.003, scale), WithinRel(exact, 1e-9));
  term.add_gradient(x, scale, fixed, g, blocks);
  double slope = 0;
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) slope += g(i, c) * p(i, c);
  CHECK_THAT((term.value(moved(t), scale) - term.value(moved(-t), scale)) / (2 * t),
             WithinRel(slope, 1e-5));
  // The forces are those of the gradient.
  Vec3<double> pushed{};
  for (int k = 0; k < 2; ++k) pushed = pushed + term.force(x, k);
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (int i = 0; i < n; ++i) sum -= g(i, c) / scale;
    CHECK_THAT(pushed[c], WithinAbs(sum, 1e-9 * norm(pushed)));
  }
  term.add_product(x, p, scale, fixed, hp);
  typename Term::Vectors const g_after("g", n);
  CHECK_THAT(term.add_gradient_after(x, p, 0.003, scale, fixed, g_after, diagonal),
             WithinRel(term.value(x, scale) - term.value(moved(-0.003), scale), 1e-9));
  double form = 0;
  for (int i = 0; i < n; ++i) {
    Sym3<double> block;
    for (int k = 0; k < 6; ++k) block.s[k] = blocks(i, k);
    Vec3<double> const pi{p(i, 0), p(i, 1), p(i, 2)}, hpi = block * pi;
    for (int c = 0; c < 3; ++c) {
      CHECK_THAT(hp(i, c), WithinAbs(hpi[c], 1e-9));
      CHECK(diagonal(i, c) == blocks(i, c));
      CHECK(g(i, c) == g_after(i, c));
      form += p(i, c) * hp(i, c);
    }
  }
  CHECK_THAT(term.quadratic_form(x, p, scale), WithinRel(form, 1e-12));
  CHECK(form > 0);
}

TEST_CASE("boundaries that cannot be are refused by name", "[mpm][boundary]") {
  CHECK_THROWS_WITH(BoundaryList<S>({{.name = "pebble", .shape = BoundaryShape::ball}}),
                    ContainsSubstring("boundary \"pebble\": a size of 0 m"));
  CHECK_THROWS_WITH(BoundaryList<S>({{.name = "ice", .friction = -1}}),
                    ContainsSubstring("boundary \"ice\": friction = -1"));
  BoundarySpec sheared{.name = "sheared"};
  sheared.motion = at_rest({Mat3<double>{{1, 1, 0, 0, 1, 0, 0, 0, 1}}, {}});
  CHECK_THROWS_WITH(BoundaryList<S>({sheared}), ContainsSubstring("its rotation is none"));
  CHECK_THROWS_WITH(Slip<>({.steepness = 1e9}), ContainsSubstring("slip: steepness = 1000000000"));
}

}  // namespace
}  // namespace taut
