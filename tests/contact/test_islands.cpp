// Minimising by islands: what is far apart is solved as if it were alone, what comes to touch as if
// it had been one all along, and nothing that is left out is missed.
#include "contact_scenes.hpp"

#include "support/threads.hpp"

#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Elasticity = ElasticTets<Elastic<StableNeoHookean>, Fp64>;
using Touch =
    Contact<PairEnergy<>, Bvh<DefaultSpace>, AdditiveCcd, ElasticInclusiveStiffness, Fp64>;
using Terms = Potential<Inertia<Fp64>, BodyForce<Fp64>, Elasticity, Touch>;
using Stepper = ImplicitEuler<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>>;

struct Block {
  Point at;
  Point velocity;
  double young = 1e5;
  double side = 0.4;
};

/// Cubes in flight, each of a stiffness of its own.
struct Flight {
  static constexpr double dhat = 0.02, density = 1000;
  std::vector<Block> blocks;
  Boxes boxes;
  Body<Fp64> body;
  std::vector<int> object;
  Terms potential;
  State<Fp64> state;

  explicit Flight(std::vector<Block> const& b)
      : blocks(b),
        boxes(shapes(b),
              [&](int k, Point const& x) {
                Point const t = turned(x, 0.4 * k);
                return Point{t[0] + b[k].at[0], t[1] + b[k].at[1], t[2] + b[k].at[2]};
              }),
        body(boxes.mesh, density),
        potential(make()),
        state(body.positions()) {
    auto const v = Kokkos::create_mirror_view(state.v);
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; c < 3; ++c) v(i, c) = blocks[object[i]].velocity[c];
    assign(state.v, v);
  }
  /// Where the vertices of some blocks are, one block after the other, each in its own order.
  std::vector<Point> positions(std::vector<int> const& some) const {
    auto const x = to_points(state.x);
    std::vector<Point> all(x.size()), picked;
    for (std::size_t i = 0; i < x.size(); ++i) all[body.order.vertices[i]] = x[i];
    for (int k : some)
      for (std::size_t v = 0; v < all.size(); ++v) {
        if (boxes.object[v] == k) picked.push_back(all[v]);
      }
    return picked;
  }
  /// kg m/s
  Point momentum() const {
    Point sum{};
    for (std::size_t i = 0; i < object.size(); ++i)
      for (int c = 0; c < 3; ++c) sum[c] += body.unknowns.mass(i) * state.v(i, c);
    return sum;
  }
  /// |M^-1 g| over all unknowns at x, mass-weighted rms, m.
  double gradient_norm(Terms::Positions const& x) {
    Terms::Vectors const g("g", body.unknowns.size());
    potential.gradient(x, g);
    double sum = 0, mass = 0;
    for (std::size_t i = 0; i < object.size(); ++i) {
      mass += body.unknowns.mass(i);
      for (int c = 0; c < 3; ++c) sum += g(i, c) * g(i, c) / body.unknowns.mass(i);
    }
    return std::sqrt(sum / mass);
  }

private:
  static std::vector<std::pair<BoxShape, int>> shapes(std::vector<Block> const& blocks) {
    std::vector<std::pair<BoxShape, int>> all;
    for (Block const& b : blocks) all.push_back({BoxShape{{b.side, b.side, b.side}}, 2});
    return all;
  }
  Terms make() {
    for (int v : body.order.vertices) object.push_back(boxes.object[v]);
    std::vector<int> material;
    for (Tet const& t : body.rest.tets) material.push_back(object[t[0]]);
    std::vector<Lame<double>> lame;
    for (Block const& b : blocks) lame.push_back(lame_parameters(b.young, 0.3));
    Surface const surface = make_surface(boundary_faces(body.rest.tets), object);
    return Terms(body.unknowns, Inertia<Fp64>(body.unknowns), BodyForce<Fp64>(body.unknowns),
                 Elasticity(body.rest, lame, material),
                 Touch(body.unknowns, surface, body.rest.points, {.dhat = dhat}));
  }
};

Stepper stepper(bool by_islands, double tolerance = 1e-9) {
  return Stepper({.stop = {.tolerance = tolerance}, .splitting = {.by_islands = by_islands}});
}

/// The largest distance of two lists of points, m.
double apart(std::vector<Point> const& a, std::vector<Point> const& b) {
  REQUIRE(a.size() == b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a[i][c] - b[i][c]));
  return largest;
}

/// Two that meet slowly; two that meet fast, and stiff; and one that meets nobody.
std::vector<Block> const slow{{{0, 0, 0}, {1, 0, 0}}, {{0.62, 0.1, 0}, {0, 0, 0}, 1e4}};
std::vector<Block> const fast{{{9, 0, 0}, {0, 6, 0.1}, 1e6}, {{9.1, 0.65, 0}, {0, -3, 0}, 2e6}};
Block const lonely{{20, 0, 0}, {0.3, 0.2, 0.1}};

std::vector<Block> together() {
  std::vector<Block> all = slow;
  all.insert(all.end(), fast.begin(), fast.end());
  all.push_back(lonely);
  return all;
}

}  // namespace

TEST_CASE("groups that are far apart in one scene move as in scenes of their own", "[islands]") {
  // Turned alike: the third and fourth of one are the first and second of the other.
  Flight all(together());
  Flight left(slow);
  std::vector<Block> behind = slow;  // far away, so that those of `fast` have their numbers
  for (Block& b : behind) b.at[2] += 500, b.velocity = {};
  behind.insert(behind.end(), fast.begin(), fast.end());
  Flight right(behind);
  Stepper by_islands = stepper(true), alone = stepper(false), other = stepper(false);
  int cuts = 0, most = 0, left_early = 0;
  double work = 0, iterations = 0;
  for (int step = 0; step < 25; ++step) {
    CAPTURE(step);
    auto const report = by_islands.step(all.potential, all.state, 0.01);
    auto const of_left = alone.step(left.potential, left.state, 0.01);
    auto const of_right = other.step(right.potential, right.state, 0.01);
    REQUIRE(report.converged());
    REQUIRE(of_left.converged());
    REQUIRE(of_right.converged());
    CHECK(report.bodies == 5);
    CHECK(report.islands >= 3);
    cuts += report.cuts;
    most = std::max(most, report.islands);
    left_early += report.left;
    work += report.active * report.iterations;
    iterations += report.iterations;
    CHECK(apart(all.positions({0, 1}), left.positions({0, 1})) < 2e-7);
    CHECK(apart(all.positions({2, 3}), right.positions({2, 3})) < 2e-7);
  }
  // All in free flight at first, touching later; and the work is less than all of it.
  CHECK(most == 5);
  CHECK(cuts > 0);
  CHECK(left_early > 0);
  CHECK(work < 0.8 * iterations);
  auto const x = all.positions({4});
  Flight const start(together());
  auto const from = start.positions({4});
  for (std::size_t i = 0; i < x.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      CHECK_THAT(x[i][c], WithinAbs(from[i][c] + 0.25 * lonely.velocity[c], 1e-9));
    }
}

TEST_CASE("with islands and without the same minimum is found, and momentum is kept", "[islands]") {
  Flight split(together()), whole(together());
  Stepper with = stepper(true), without = stepper(false);
  Point const before = split.momentum();
  for (int step = 0; step < 25; ++step) {
    CAPTURE(step);
    auto const a = with.step(split.potential, split.state, 0.01);
    auto const b = without.step(whole.potential, whole.state, 0.01);
    REQUIRE(a.converged());
    REQUIRE(b.converged());
    CHECK(b.islands == 1);
    CHECK(apart(split.positions({0, 1, 2, 3, 4}), whole.positions({0, 1, 2, 3, 4})) < 2e-7);
  }
  Point const after = split.momentum();
  for (int c = 0; c < 3; ++c) CHECK_THAT(after[c], WithinAbs(before[c], 1e-4));
}

TEST_CASE("an island that has ended is woken by what comes to touch it", "[islands]") {
  // A long step: the second flies free and ends at once, then the first arrives, and through both
  // the third hears of it.
  double const speed = GENERATE(3.0, 12.0);
  CAPTURE(speed);
  std::vector<Block> const row{{{0, 0, 0}, {speed, 0, 0}, 1e5},
                               {{0.8, 0.05, 0}, {0, 0, 0}, 1e5},
                               {{1.45, 0, 0.05}, {0, 0, 0}, 3e4}};
  Flight split(row), whole(row);
  Stepper with = stepper(true, 1e-8), without = stepper(false, 1e-8);
  int woken = 0;
  Point const before = split.momentum();
  for (int step = 0; step < 4; ++step) {
    CAPTURE(step);
    auto const a = with.step(split.potential, split.state, 0.1);
    auto const b = without.step(whole.potential, whole.state, 0.1);
    REQUIRE(a.converged());
    REQUIRE(b.converged());
    woken += a.woken;
    // Driven through each other by three times their size, they have several ways out.
    if (speed < 10) CHECK(apart(split.positions({0, 1, 2}), whole.positions({0, 1, 2})) < 1e-5);
    // Nothing is left out of the gradient where it ended, and no term is left asleep.
    CHECK(split.gradient_norm(with.reached()) < 1e-5);
  }
  if (speed > 10) CHECK(woken > 0);  // slower ones are joined from the start
  Point const after = split.momentum();
  for (int c = 0; c < 3; ++c) CHECK_THAT(after[c], WithinAbs(before[c], 1e-3));
}

TEST_CASE("islands depend on no number of threads", "[islands]") {
  auto const runs = test::on_one_thread_and_all([] {
    Flight scene(together());
    Stepper s = stepper(true, 1e-4);
    for (int step = 0; step < 16; ++step) s.step(scene.potential, scene.state, 0.01);
    return scene.positions({0, 1, 2, 3, 4});
  });
  CHECK(runs[0] == runs[1]);
}

TEST_CASE("one body is minimised bitwise as without islands", "[islands]") {
  auto const run = [](bool by_islands) {
    Flight scene(std::vector<Block>{{{0, 0, 0}, {1, 0, 0}}});
    for (std::size_t i = 0; i < scene.object.size(); ++i) {
      scene.state.v(i, 1) = 3 * scene.state.x(i, 0);  // shear
    }
    Stepper s = stepper(by_islands, 1e-4);
    int iterations = 0;
    for (int step = 0; step < 3; ++step) {
      iterations += s.step(scene.potential, scene.state, 0.01).iterations;
    }
    CHECK(iterations > 10);
    return scene.positions({0});
  };
  CHECK(run(true) == run(false));
}
