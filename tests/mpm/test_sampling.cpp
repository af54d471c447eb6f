// Particles of bodies: how they are spread, what they weigh together, and what is inside of what.
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>
#include <taut/mpm/sampling.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <support/data.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

double mass_of(std::vector<Particle> const& list) {
  double sum = 0;
  for (Particle const& p : list) sum += p.mass;
  return sum;
}
std::vector<Particle> sample_one(Solid const& solid, double dx, double per_cell = 8) {
  ParticleBody const body{"it", solid, 700, per_cell, 2, {1, 2, 3}};
  return sample(std::vector{body}, dx);
}

/// A box as a surface, with vertices on a lattice of eighths: rays through edges and corners.
TriangleMesh box_surface(int n) {
  TriangleMesh mesh;
  auto const quad = [&](int axis, int side, int i, int j) {
    auto const base = static_cast<std::int32_t>(mesh.points.size());
    for (int k = 0; k < 4; ++k) {
      Point p;
      p[static_cast<std::size_t>(axis)] = side;
      p[static_cast<std::size_t>((axis + 1) % 3)] = double(i + (k == 1 || k == 2)) / n;
      p[static_cast<std::size_t>((axis + 2) % 3)] = double(j + (k > 1)) / n;
      mesh.points.push_back(p);
    }
    if (side == 1) {
      mesh.triangles.push_back({base, base + 1, base + 2});
      mesh.triangles.push_back({base, base + 2, base + 3});
    } else {
      mesh.triangles.push_back({base, base + 2, base + 1});
      mesh.triangles.push_back({base, base + 3, base + 2});
    }
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) quad(axis, side, i, j);
  // One vertex for each place.
  TriangleMesh welded;
  std::vector<std::int32_t> to(mesh.points.size());
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    auto const found = std::find(welded.points.begin(), welded.points.end(), mesh.points[v]);
    to[v] = static_cast<std::int32_t>(found - welded.points.begin());
    if (found == welded.points.end()) welded.points.push_back(mesh.points[v]);
  }
  for (Triangle t : mesh.triangles) {
    for (auto& v : t) v = to[static_cast<std::size_t>(v)];
    welded.triangles.push_back(t);
  }
  return welded;
}

TEST_CASE("blue noise keeps its distance, in all periods", "[mpm][sampling]") {
  BlueNoise const noise = blue_noise(500, 3);
  REQUIRE(noise.points.size() == 500);
  CHECK(500 * std::pow(noise.distance, 3) > 0.55);
  double least = 1;
  for (std::size_t a = 0; a < 500; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      double d2 = 0;
      for (int c = 0; c < 3; ++c) {
        double d = std::abs(noise.points[a][c] - noise.points[b][c]);
        d = std::min(d, 1 - d);
        d2 += d * d;
      }
      least = std::min(least, std::sqrt(d2));
    }
  CHECK(least >= noise.distance);
  // No octant is fuller than it may be by chance, nor the half of what random points show.
  int in[8] = {};
  for (auto const& x : noise.points) ++in[(x[0] < 0.5) + 2 * (x[1] < 0.5) + 4 * (x[2] < 0.5)];
  for (int const n : in) CHECK(std::abs(n - 62.5) < 12);
  auto const again = blue_noise(500, 3), other = blue_noise(500, 4);
  CHECK(norm(again.points[499] - noise.points[499]) == 0);
  CHECK(norm(other.points[499] - noise.points[499]) > 0);
  CHECK(blue_noise(1, 1).points.size() == 1);
}

TEST_CASE("bodies of analytic shapes have their volume, mass and number of particles",
          "[mpm][sampling]") {
  double const pi = std::numbers::pi;
  RigidPose const pose{turn_matrix({{0, 0.6, 0.8}, 0.7}), {5, -3, 2}};
  struct Case {
    Solid solid;
    double volume;
  };
  for (Case const& one : {Case{solid_box({0.5, 0.3, 0.4}), 0.06},
                          Case{solid_ball(0.25), 4 * pi / 3 * 0.25 * 0.25 * 0.25},
                          Case{solid_cylinder(0.2, 0.5), pi * 0.2 * 0.2 * 0.5},
                          Case{solid_torus(0.3, 0.1), 2 * pi * pi * 0.3 * 0.1 * 0.1}}) {
    CHECK_THAT(one.solid.volume, WithinRel(one.volume, 1e-14));
    for (double const per_cell : {8.0, 12.5}) {
      double const dx = 0.04;
      auto const list = sample_one(placed(one.solid, pose), dx, per_cell);
      CHECK_THAT(mass_of(list), WithinRel(700 * one.volume, 1e-12));
      double const expected = one.volume / (dx * dx * dx) * per_cell;
      CHECK_THAT(double(list.size()), WithinRel(expected, 0.03));
      Vec3<double> middle{};
      for (Particle const& p : list) {
        CHECK(one.solid.holds(transpose_times(pose.rotation, p.x - pose.translation)));
        CHECK(p.material == 2);
        CHECK(p.object == 0);
        CHECK(p.v[2] == 3);
        CHECK(p.volume == list[0].volume);
        middle = middle + (1.0 / static_cast<double>(list.size())) * p.x;
      }
      CHECK_THAT(norm(middle - pose.translation), WithinAbs(0, 0.1 * dx));
    }
  }
  // A hole: twice the same body is no body.
  Solid const pipe = without(solid_cylinder(0.2, 0.5), solid_cylinder(0.1, 0.6));
  CHECK_THAT(pipe.volume, WithinRel(0.75 * pi * 0.2 * 0.2 * 0.5, 0.01));
  CHECK_THROWS_WITH(without(solid_ball(0.1), solid_ball(0.2)),
                    ContainsSubstring("nothing is left"));
}

TEST_CASE("points in a surface are those in the body, also where rays meet edges and corners",
          "[mpm][sampling]") {
  TriangleMesh const mesh = box_surface(4);
  Solid const solid = solid_in_surface(mesh, "box");
  CHECK_THAT(solid.volume, WithinRel(1, 1e-14));
  // On the lattice of the vertices and between.
  for (int i = -4; i <= 20; ++i)
    for (int j = -4; j <= 20; ++j)
      for (int k = -4; k <= 20; ++k) {
        int const at[3] = {i, j, k};
        bool inside = true, on = false;
        for (int const n : at) {
          inside &= n > 0 && n < 16;
          on |= n == 0 || n == 16;
        }
        if (on) continue;
        CHECK(solid.holds({i / 16.0, j / 16.0, k / 16.0}) == inside);
      }
  CHECK(!solid.holds({std::numeric_limits<double>::quiet_NaN(), 0.5, 0.5}));
  // Turned: nothing is along an axis.
  Mat3<double> const turn = turn_matrix({{0.36, 0.48, 0.8}, 1.1});
  TriangleMesh turned = mesh;
  for (Point& p : turned.points) {
    Vec3<double> const x = turn * Vec3<double>{p[0], p[1], p[2]};
    p = {x[0], x[1], x[2]};
  }
  Solid const other = solid_in_surface(turned, "turned");
  CHECK_THAT(other.volume, WithinRel(1, 1e-12));
  std::mt19937 random(1);
  for (int n = 0; n < 2000; ++n) {
    Vec3<double> x;
    for (int c = 0; c < 3; ++c) x[c] = double(random()) / 4294967296.0 * 1.4 - 0.2;
    bool inside = true;
    for (int c = 0; c < 3; ++c) inside &= x[c] > 0 && x[c] < 1;
    CHECK(other.holds(turn * x) == inside);
  }
  // Inside out, and with a small hole that is allowed.
  for (Triangle& t : turned.triangles) std::swap(t[0], t[1]);
  CHECK(solid_in_surface(turned, "inside out").holds(turn * Vec3<double>{0.5, 0.5, 0.5}));
  TriangleMesh open = mesh;
  open.triangles.erase(open.triangles.begin() + 7);
  CHECK_THROWS_WITH(solid_in_surface(open, "bag"),
                    ContainsSubstring("surface \"bag\" is open: 3 of its edges"));
  Solid const bag = solid_in_surface(open, "bag", 0.02);
  int wrong = 0;
  for (int n = 0; n < 2000; ++n) {
    Vec3<double> x;
    for (int c = 0; c < 3; ++c) x[c] = double(random()) / 4294967296.0 * 1.4 - 0.2;
    bool inside = true;
    for (int c = 0; c < 3; ++c) inside &= x[c] > 0 && x[c] < 1;
    wrong += bag.holds(x) != inside;
  }
  CHECK(wrong == 0);
  CHECK_THAT(bag.volume, WithinRel(1, 0.02));
}

TEST_CASE("surfaces and bodies that cannot be are refused in one sentence", "[mpm][sampling]") {
  TriangleMesh flat = box_surface(1);
  for (Point& p : flat.points) p[1] = 0;
  CHECK_THROWS_WITH(solid_in_surface(flat, "sheet"), ContainsSubstring("has no inside"));
  flat.points[2][0] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(solid_in_surface(flat, "sheet"), ContainsSubstring("vertex 2 is not finite"));
  CHECK_THROWS_WITH(solid_in_surface({}, "none"), ContainsSubstring("has no triangles"));
  CHECK_THROWS_WITH(solid_ball(-1), ContainsSubstring("a ball with a radius of -1 m"));
  CHECK_THROWS_WITH(solid_torus(1, 2), ContainsSubstring("section"));
  CHECK_THROWS_WITH(sample_one(solid_ball(0.01), 10), ContainsSubstring("\"it\" has no room"));
  CHECK_THROWS_WITH(sample_one(solid_ball(1), 1e-4),
                    ContainsSubstring("particles: give a coarser"));
  CHECK_THROWS_WITH(sample_one(solid_ball(1), 0), ContainsSubstring("a grid of spacing 0 m"));
  CHECK_THROWS_WITH(sample({}, 1), ContainsSubstring("no bodies"));
  // Bodies so thin that their boxes are nearly empty.
  Solid const needle =
      placed(solid_box({1e3, 1e-6, 1e-6}), {turn_matrix({{0.6, 0, 0.8}, 0.7}), {0, 0, 0}});
  CHECK_THROWS_WITH(sample_one(needle, 0.01),
                    ContainsSubstring("\"it\": the box around it reaches over more cells"));
  CHECK_THROWS_WITH(without(solid_torus(1, 1e-6), solid_ball(2)),
                    ContainsSubstring("a body so thin"));
  CHECK_THROWS_WITH(without(solid_ball(1), solid_ball(2)), ContainsSubstring("the hole covers it"));
  ParticleBody const a{"anvil", solid_box({1, 1, 1})};
  ParticleBody const b{"hammer", placed(solid_ball(0.3), {identity3<double>(), {0, 0.7, 0}})};
  CHECK_THROWS_WITH(sample(std::vector{a, b}, 0.1),
                    ContainsSubstring("\"anvil\" and \"hammer\" overlap"));
  CHECK(sample(std::vector{a, b}, 0.1, {.check_overlap = false}).size() > 8000);
  ParticleBody thin = a;
  thin.density = 0;
  CHECK_THROWS_WITH(sample(std::vector{thin}, 0.1),
                    ContainsSubstring("body \"anvil\": density = 0"));
}

TEST_CASE("bodies of files have the volume of their surfaces", "[mpm][sampling]") {
  auto const obj = test::data_file("meshes/hot/Armadillo.obj");
  Solid const surface = solid_in_surface(read_obj(obj), "Armadillo");
  CHECK_THAT(surface.volume, WithinRel(0.05130, 1e-3));
  Solid const field = solid_in_level_set(test::data_file("levelsets/Armadillo.vdb"));
  // The level set is of the same surface, up to its voxels of 3 mm.
  int same = 0, n = 0;
  std::mt19937 random(1);
  for (; n < 4000; ++n) {
    Vec3<double> x;
    for (int c = 0; c < 3; ++c) {
      double const t = double(random()) / 4294967296.0;
      x[c] = (1 - t) * surface.lowest[c] + t * surface.highest[c];
    }
    same += surface.holds(x) == field.holds(x);
  }
  CHECK(same > 0.98 * n);
  CHECK_THAT(field.volume, WithinRel(surface.volume, 0.02));
  auto const list = sample_one(field, 0.02);
  CHECK_THAT(mass_of(list), WithinRel(700 * field.volume, 1e-12));
  CHECK_THAT(double(list.size()), WithinRel(field.volume / 8e-6 * 8, 0.03));
  CHECK_THROWS_WITH(solid_in_level_set(obj), ContainsSubstring("is no OpenVDB file"));
  CHECK_THROWS_WITH(solid_in_level_set("no.vdb"), ContainsSubstring("there is no such file"));
}

}  // namespace
}  // namespace taut
