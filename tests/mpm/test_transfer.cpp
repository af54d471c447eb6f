// Transfers between particles and grid: what they conserve and reproduce (F24), and what they make
// of places that no scene should have.
#include <taut/mpm/transfer.hpp>

#include "particle_scenes.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <support/threads.hpp>

#include <cmath>
#include <limits>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using S = DefaultSpace;

/// Particles, and their grid with masses and velocities.
template <class K, class P = Fp64, class Space = S, bool packed = Space::on_host>
struct Moving : test::OnGrid<K, P, Space> {
  using Base = test::OnGrid<K, P, Space>;
  using Positions = typename Base::Positions;
  double dx;
  GridTransfer<K, P, Space, packed> transfer;
  Moving(std::vector<Particle> const& list, double spacing, int team_size = 64)
      : Base(list, spacing), dx(spacing), transfer(team_size) {
    transfer.to_grid(this->particles, this->blocks, this->nodes(), dx);
  }
  /// The same velocities, changed by `kick(i)` at node i.
  template <class Kick, class T>
  void step(double h, T const& policy, Kick const& kick) {
    int const n = this->nodes();
    Positions const x("x", n), v("v", n);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        v(i, c) = transfer.velocity()(i, c) + kick(i)[c];
        x(i, c) = this->rest(i, c) + h * v(i, c);
      }
    transfer.to_particles(this->particles, this->blocks, x, this->rest, v, h, dx, policy, NoFlow{});
  }
};
auto const no_kick = [](int) { return Vec3<double>{}; };

Vec3<double> axial_of(Mat3<double> const& B) {
  return {B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1)};
}
struct Momentum {
  double mass = 0;
  Vec3<double> linear{}, angular{};
};
template <class K>
Momentum of_particles(std::vector<Particle> const& list, double dx) {
  Momentum sum;
  for (Particle const& p : list) {
    sum.mass += p.mass;
    sum.linear = sum.linear + p.mass * p.v;
    sum.angular = sum.angular + p.mass * (cross(p.x, p.v) + axial_of((K::inertia * dx * dx) * p.C));
  }
  return sum;
}
template <class Scene>
Momentum of_grid(Scene const& scene) {
  Momentum sum;
  for (int i = 0; i < scene.nodes(); ++i) {
    double const m = scene.transfer.mass()(i);
    Vec3<double> x, v;
    for (int c = 0; c < 3; ++c) {
      x[c] = scene.rest(i, c);
      v[c] = scene.transfer.velocity()(i, c);
    }
    sum.mass += m;
    sum.linear = sum.linear + m * v;
    sum.angular = sum.angular + m * cross(x, v);
  }
  return sum;
}
void check_same(Momentum const& a, Momentum const& b, bool angular, double eps = 1e-13) {
  CHECK_THAT(a.mass - b.mass, WithinAbs(0, eps * a.mass));
  CHECK_THAT(norm(a.linear - b.linear), WithinAbs(0, eps * a.mass));
  if (angular) CHECK_THAT(norm(a.angular - b.angular), WithinAbs(0, eps * a.mass));
}

TEMPLATE_TEST_CASE("transfers conserve momentum to round-off", "[mpm][transfer]", QuadraticSpline,
                   CubicSpline) {
  double const dx = 0.1, h = 0.02;
  auto const list = test::jittered_block(5, 2, dx, {-2.3, 5.2, 6.6});
  auto const check = [&](auto const& policy, bool angular) {
    Moving<TestType> scene(list, dx);
    Momentum const start = of_particles<TestType>(list, dx), grid = of_grid(scene);
    check_same(start, grid, true);
    scene.step(h, policy, no_kick);
    Momentum const end = of_particles<TestType>(scene.particles.read(), dx);
    check_same(grid, end, angular);
    // And the way back, from where the particles are now.
    check_same(end, of_grid(Moving<TestType>(scene.particles.read(), dx)), true);
  };
  check(Apic{}, true);
  check(Rpic{}, true);
  check(PicFlip{0.0}, false);
  check(PicFlip{0.95}, false);
}

// A device may round x / dx otherwise in one kernel than in another (fused or not), so that a
// particle on the border of two cells would be sorted into one and weighed as if in the other.
TEMPLATE_TEST_CASE("a particle is weighed from the cell that it was sorted into", "[mpm][transfer]",
                   LinearSpline, QuadraticSpline, CubicSpline) {
  double const dx = 0.1;
  Particle p;
  double const border = 7 + TestType::start;
  p.x = {dx * border, 5.3 * dx, 6.7 * dx};
  while (base_node<TestType>(p.x[0] * (1 / dx)) >= 7) p.x[0] = std::nextafter(p.x[0], 0.0);
  p.v = {1, 2, 3};
  p.mass = p.volume = 1;
  Moving<TestType> scene({p}, dx);
  REQUIRE(scene.blocks.cells()(0, 0) == 6);
  while (base_node<TestType>(scene.particles.x(0, 0) * (1 / dx)) < 7)
    scene.particles.x(0, 0) = std::nextafter(scene.particles.x(0, 0), 1.0);
  scene.transfer.to_grid(scene.particles, scene.blocks, scene.nodes(), dx);
  double centre = 0, mass = 0;
  for (int i = 0; i < scene.nodes(); ++i) {
    mass += scene.transfer.mass()(i);
    centre += scene.transfer.mass()(i) * scene.rest(i, 0);
  }
  CHECK_THAT(mass, WithinAbs(1, 1e-12));
  CHECK_THAT(centre, WithinAbs(scene.particles.x(0, 0), 1e-12));
}

TEST_CASE("transfers of mixed and single precision conserve momentum to their round-off",
          "[mpm][transfer]") {
  auto const list = test::jittered_block(4, 2, 0.1, {-2.3, 5.2, 6.6});
  Moving<QuadraticSpline, Mixed> mixed(list, 0.1);
  check_same(of_particles<QuadraticSpline>(list, 0.1), of_grid(mixed), true);
  Moving<QuadraticSpline, Fp32> single(list, 0.1);
  check_same(of_particles<QuadraticSpline>(list, 0.1), of_grid(single), true, 1e-5);
}

TEMPLATE_TEST_CASE("what a transfer can represent comes back as it was", "[mpm][transfer]",
                   LinearSpline, QuadraticSpline, CubicSpline) {
  double const dx = 0.1, h = 0.01;
  Mat3<double> const A{{0.3, -2, 0.4, 1, 0.7, -0.6, 0.2, 1.5, -0.9}};
  Mat3<double> const spin = 0.5 * (A - transpose(A));
  auto list = test::jittered_block(4, 2, dx, {-2.3, 5.2, 6.6});
  auto const start = [&](Mat3<double> const& field) {
    for (Particle& p : list) {
      p.v = Vec3<double>{1, -2, 3} + field * p.x;
      p.C = field;
    }
  };
  auto const check = [&](auto const& policy, Mat3<double> const& field) {
    start(field);
    Moving<TestType> scene(list, dx);
    scene.step(h, policy, no_kick);
    auto const end = scene.particles.read();
    Mat3<double> const F = identity3<double>() + h * field;
    for (std::size_t p = 0; p < list.size(); ++p) {
      CHECK_THAT(norm(end[p].v - list[p].v), WithinAbs(0, 1e-12));
      CHECK_THAT(norm(end[p].x - (list[p].x + h * list[p].v)), WithinAbs(0, 1e-13));
      Mat3<double> const C = end[p].C - field, strain = end[p].F - F * list[p].F;
      CHECK_THAT(contract(C, C), WithinAbs(0, 1e-20));
      CHECK_THAT(contract(strain, strain), WithinAbs(0, 1e-24));
    }
  };
  check(Apic{}, A);
  check(Rpic{}, spin);
  // Pure FLIP keeps every velocity that the grid does not change.
  list = test::jittered_block(4, 2, dx, {-2.3, 5.2, 6.6});
  Moving<TestType> scene(list, dx);
  scene.step(h, PicFlip{1.0}, [](int) { return Vec3<double>{0, 0, 0.5}; });
  auto const end = scene.particles.read();
  for (std::size_t p = 0; p < list.size(); ++p) {
    CHECK_THAT(norm(end[p].v - list[p].v - Vec3<double>{0, 0, 0.5}), WithinAbs(0, 1e-12));
  }
}

TEMPLATE_TEST_CASE("threads of a particle each, in a device's layout, transfer what packs do",
                   "[mpm][transfer]", LinearSpline, QuadraticSpline, CubicSpline) {
  double const dx = 0.1, h = 0.02;
  // Cells with more and with fewer particles than others, so that rounds are of all lengths.
  auto list = test::jittered_block(5, 2, dx, {-2.3, 5.2, 6.6});
  auto const more = test::jittered_block(2, 3, dx, {-1.3, 6.2, 7.6}, 1, 0.1, 3);
  list.insert(list.end(), more.begin(), more.end());
  auto const kick = [](int i) { return Vec3<double>{0.1 * (i % 7), -0.2, 0.05 * (i % 3)}; };
  auto const check = [&](auto const& policy, int team) {
    CAPTURE(policy.flip, team);
    using Threads = Moving<TestType, Fp64, test::LeftOf<S>, false>;
    Moving<TestType> packs(list, dx);
    Threads threads(list, dx, team);
    REQUIRE(packs.nodes() == threads.nodes());
    for (int i = 0; i < packs.nodes(); ++i) {
      double const m = packs.transfer.mass()(i);
      CHECK_THAT(threads.transfer.mass()(i), WithinAbs(m, 1e-14));
      for (int c = 0; c < 3; ++c) {
        CHECK_THAT(m * threads.transfer.velocity()(i, c),
                   WithinAbs(m * packs.transfer.velocity()(i, c), 1e-14));
      }
    }
    // From one velocity on, for that of a node without mass is round-off.
    assign(threads.transfer.velocity(), packs.transfer.velocity());
    packs.step(h, policy, kick);
    threads.step(h, policy, kick);
    auto const a = packs.particles.read(), b = threads.particles.read();
    for (std::size_t p = 0; p < list.size(); ++p) {
      CHECK_THAT(norm(a[p].x - b[p].x), WithinAbs(0, 1e-13));
      CHECK_THAT(norm(a[p].v - b[p].v), WithinAbs(0, 1e-12));
      for (int c = 0; c < 9; ++c) {
        CHECK_THAT(a[p].C.a[c], WithinAbs(b[p].C.a[c], 1e-11));
        CHECK_THAT(a[p].F.a[c], WithinAbs(b[p].F.a[c], 1e-12));
      }
    }
  };
  for (int const team : test::team_sizes<S>()) {
    check(Apic{}, team);
    check(PicFlip{0.95}, team);
  }
}

TEST_CASE("transfers do not depend on the number of threads", "[mpm][transfer]") {
  auto const list = test::jittered_block(9, 2, 0.1, {-2.3, 5.2, 6.6});
  auto const runs = test::on_one_thread_and_all([&] {
    Moving<QuadraticSpline, Mixed> scene(list, 0.1);
    scene.step(0.01, Apic{}, [](int i) { return Vec3<double>{0.1 * (i % 7), 0, 0}; });
    return scene.particles.read();
  });
  REQUIRE(runs.size() == 2);
  for (std::size_t p = 0; p < list.size(); ++p)
    for (int c = 0; c < 9; ++c) {
      REQUIRE(runs[0][p].C.a[c] == runs[1][p].C.a[c]);
      REQUIRE(runs[0][p].F.a[c] == runs[1][p].F.a[c]);
      REQUIRE(runs[0][p].x[c % 3] == runs[1][p].x[c % 3]);
    }
}

TEST_CASE("nodes without mass have a velocity and a mass that change nothing", "[mpm][transfer]") {
  // Exactly between two nodes the weight of a third vanishes, and its slope with it.
  double const dx = 0.25;
  std::vector<Particle> list(2);
  for (int k = 0; k < 2; ++k) {
    list[k].x = {(3.5 + k) * dx, (-2.5) * dx, 1.5 * dx};
    list[k].v = {1, 2, 3};
    list[k].mass = 5;
    list[k].volume = 0.01;
  }
  list[1].x[1] = std::nextafter(list[1].x[1], 1);  // a weight of 1e-32 or so
  Moving<QuadraticSpline> scene(list, dx);
  int empty = 0;
  double total = 0;
  for (int i = 0; i < scene.nodes(); ++i) {
    double const m = scene.transfer.mass()(i);
    total += m;
    CHECK(m > 0);
    empty += m < 1e-20;
    for (int c = 0; c < 3; ++c) CHECK(std::isfinite(scene.transfer.velocity()(i, c)));
  }
  CHECK(empty > 10);
  CHECK_THAT(total, WithinAbs(10, 1e-14));
  scene.step(0.01, Apic{}, no_kick);
  for (Particle const& p : scene.particles.read()) {
    CHECK_THAT(norm(p.v - Vec3<double>{1, 2, 3}), WithinAbs(0, 1e-14));
  }
}

TEST_CASE("many particles in one cell, of many materials, are all counted", "[mpm][transfer]") {
  std::vector<Particle> list(1000);
  for (int k = 0; k < 1000; ++k) {
    list[k].x = {0.001 * (k % 10), 0.001 * (k / 10 % 10), 0.0001 * (k / 100)};
    list[k].mass = 1 + k % 3;
    list[k].volume = 1e-6;
    list[k].material = k % 5;
  }
  Particles<Fp64, S> const particles(list);
  ParticleBlocks<QuadraticSpline, S> blocks;
  blocks.sort(particles.x, particles.material, 1000, 5, 1.0);
  auto const& views = blocks.views();
  CHECK(views.patches == 5 * views.blocks);
  std::vector<int> seen(1000, 0);
  for (int patch = 0; patch < views.patches; ++patch) {
    CHECK(views.slot_begin(patch) % views.lanes == 0);
    for (int k = views.slot_begin(patch); k < views.slot_end(patch); ++k) {
      int const p = views.particle(k);
      CHECK((p >= 0) == (k < views.slot_begin(patch) + views.count(patch)));
      if (p < 0) continue;
      ++seen[p];
      CHECK(list[p].material == views.material(patch));
    }
  }
  CHECK(seen == std::vector<int>(1000, 1));
}

TEST_CASE("a grid far from the origin is the same grid", "[mpm][transfer]") {
  // Powers of two: nothing is rounded on the way there and back.
  double const dx = 0.125, far = 1 << 20;
  auto near = test::jittered_block(3, 2, dx, {0, 0, 0});
  for (Particle& p : near)
    for (int c = 0; c < 3; ++c) p.x[c] = std::round(p.x[c] * 1024) / 1024;
  auto away = near;
  for (Particle& p : away) p.x = p.x + Vec3<double>{far, -far, far};
  Moving<QuadraticSpline> here(near, dx), there(away, dx);
  REQUIRE(here.nodes() == there.nodes());
  here.step(0.0, Apic{}, no_kick);
  there.step(0.0, Apic{}, no_kick);
  auto const a = here.particles.read(), b = there.particles.read();
  for (std::size_t p = 0; p < near.size(); ++p) {
    CHECK_THAT(norm(a[p].v - b[p].v), WithinAbs(0, 1e-14));
    CHECK(norm(b[p].x - a[p].x - Vec3<double>{far, -far, far}) == 0);
  }
}

TEST_CASE("particles that are nowhere are named", "[mpm][transfer]") {
  auto const refuse = [](double x, std::string const& what) {
    auto const list = test::jittered_block(2, 2, 0.1, {0, 0, 0});
    Particles<Fp64, S> const particles(list);
    particles.x(5, 1) = x;
    ParticleBlocks<QuadraticSpline, S> blocks;
    CHECK_THROWS_WITH(blocks.sort(particles.x, particles.material, 64, 1, 0.1),
                      ContainsSubstring(what));
  };
  refuse(std::numeric_limits<double>::quiet_NaN(), "particle 5 is nowhere");
  refuse(-std::numeric_limits<double>::infinity(), "particle 5 is nowhere");
  refuse(1e9, "particle 5 is nowhere");
  Particle bad;
  bad.volume = 1;
  CHECK_THROWS_WITH((Particles<Fp64, S>({bad})), ContainsSubstring("particle 0: mass 0 kg"));
  bad.mass = 1;
  bad.v[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH((Particles<Fp64, S>({bad})), ContainsSubstring("not finite"));
  // Everywhere at once: more cells than a key can name.
  std::vector<Particle> list(2);
  for (int k = 0; k < 2; ++k) {
    list[k].mass = list[k].volume = 1;
    for (int c = 0; c < 3; ++c) list[k].x[c] = (k ? -1 : 1) * 4e8;
  }
  Particles<Fp64, S> const particles(list);
  ParticleBlocks<QuadraticSpline, S> blocks;
  CHECK_THROWS_WITH(blocks.sort(particles.x, particles.material, 2, 1, 1.0),
                    ContainsSubstring("spread over 2^27"));
  assign(particles.material, 3);
  CHECK_THROWS_WITH(blocks.sort(particles.x, particles.material, 2, 3, 10.0),
                    ContainsSubstring("particle 0 is of a material that is not one of the 3"));
  CHECK_THROWS_WITH(blocks.sort(particles.x, particles.material, 2, 9, 0.0),
                    ContainsSubstring("spacing 0 m"));
}

TEST_CASE("no particles make no grid", "[mpm][transfer]") {
  Moving<QuadraticSpline> scene({}, 0.1);
  CHECK(scene.nodes() == 0);
  CHECK(scene.blocks.views().patches == 0);
  scene.step(0.1, Apic{}, no_kick);
}

}  // namespace
}  // namespace taut
