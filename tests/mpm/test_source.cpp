// What sources let out: its volume, its places and its order; and the fields of distances of
// boundaries that are files.
#include <taut/core/report/error.hpp>
#include <taut/mpm/source.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Host = Space<Kokkos::DefaultHostExecutionSpace>;

constexpr double never = std::numeric_limits<double>::infinity();

Boundary boundary_of(SourceSpec const& source) {
  Boundary boundary;
  boundary.shape = source.shape;
  boundary.size = source.size;
  return boundary;
}

/// A box with corners at -half and half, outward.
TriangleMesh box_surface(Vec3<double> const& half) {
  TriangleMesh mesh;
  for (int v = 0; v < 8; ++v) {
    mesh.points.push_back(
        {v & 1 ? half[0] : -half[0], v & 2 ? half[1] : -half[1], v & 4 ? half[2] : -half[2]});
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

std::vector<SourceSpec> some() {
  return {{"ball", BoundaryShape::ball, {0.3, 0, 0}, {0, -0.5, 0}},
          {"box", BoundaryShape::box, {0.4, 0.2, 0.7}, {0.3, -0.4, 1.1}},
          {"plate", BoundaryShape::box, {0.4, 0.01, 0.7}, {0, 2, 0}},
          {"cylinder", BoundaryShape::cylinder, {0.25, 0.6, 0}, {0, 0.7, 0}},
          {"tilted", BoundaryShape::cylinder, {0.25, 0.6, 0}, {0.5, 0.2, -0.4}},
          {"across", BoundaryShape::cylinder, {0.25, 0.6, 0}, {0, 0, 1}}};
}

}  // namespace

TEST_CASE("the shadow of a source is what lines along its flow meet", "[mpm][source]") {
  for (SourceSpec const& source : some()) {
    CAPTURE(source.name);
    double const speed = norm(source.velocity);
    // As many particles per volume as the cloud has, up to its noise at the rim.
    double const dx = 0.04, seconds = 1.3;
    Outflow const out = outflow(source, dx, seconds, 1);
    double const volume = shadow(source, (1 / speed) * source.velocity) * speed * seconds;
    CHECK_THAT(double(out.points.size()), WithinRel(volume / (dx * dx * dx) * 8, 0.05));
  }
}

TEST_CASE("a source that ends lets out its volume exactly", "[mpm][source]") {
  for (SourceSpec source : some()) {
    CAPTURE(source.name);
    source.start = 0.25;
    source.end = 1.15;
    double const speed = norm(source.velocity);
    double const area = shadow(source, (1 / speed) * source.velocity);
    Outflow const out = outflow(source, 0.06, 10, 3);
    CHECK_THAT(out.volume * double(out.points.size()), WithinRel(area * speed * 0.9, 1e-12));
    CHECK(out.points.front().time >= 0.25);
    CHECK(out.points.back().time < 1.15);
    // One that never ends lets out as much in each period of its cloud.
    source.end = never;
    double const period = 0.06 * std::cbrt(8192 / 8.0) / speed;
    Outflow const endless = outflow(source, 0.06, 0.25 + 3 * period * (1 - 1e-9), 3);
    CHECK_THAT(endless.volume * double(endless.points.size()),
               WithinRel(area * speed * 3 * period, 1e-12));
  }
}

TEST_CASE("particles leave a source on its surface, where the flow leads out", "[mpm][source]") {
  for (SourceSpec const& source : some()) {
    CAPTURE(source.name);
    Boundary const boundary = boundary_of(source);
    Outflow const out = outflow(source, 0.05, 1, 2);
    REQUIRE(!out.points.empty());
    double last = 0;
    for (Outflow::Point const& point : out.points) {
      Vec3<double> normal;
      CHECK_THAT(boundary.distance(point.place, normal), WithinAbs(0, 1e-12));
      Vec3<double> const later = point.place + 1e-6 * source.velocity,
                         before = point.place - 1e-6 * source.velocity;
      CHECK(boundary.distance(later, normal) > 0);
      CHECK(boundary.distance(before, normal) < 0);
      CHECK(point.time >= last);
      last = point.time;
    }
  }
}

TEST_CASE("what has come out is blue noise, whenever it did", "[mpm][source]") {
  SourceSpec const source{"box", BoundaryShape::box, {0.4, 0.2, 0.3}, {0.3, -0.4, 0.6}, 8, 0,
                          never};
  double const dx = 0.07, until = 1.1;
  Outflow const out = outflow(source, dx, until, 5);
  double const distance = blue_noise(8192, 5).distance * dx * std::cbrt(8192 / 8.0);
  std::vector<Vec3<double>> x;
  for (Outflow::Point const& p : out.points) {
    x.push_back(p.place + (until - p.time) * source.velocity);
  }
  REQUIRE(x.size() > 300);
  double nearest = never;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, norm(x[i] - x[j]));
  CHECK(nearest > distance * (1 - 1e-9));
}

TEST_CASE("a longer look at a source adds to a shorter one", "[mpm][source]") {
  SourceSpec source = some()[4];
  source.start = 0.1;
  Outflow const a = outflow(source, 0.05, 0.7, 1), b = outflow(source, 0.05, 1.9, 1);
  REQUIRE(a.points.size() < b.points.size());
  CHECK(a.volume == b.volume);
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    CHECK(a.points[k].time == b.points[k].time);
    CHECK(norm(a.points[k].place - b.points[k].place) == 0);
  }
  CHECK(outflow(source, 0.05, 0.05, 1).points.empty());  // it has not begun
}

TEST_CASE("sources that cannot be are refused in one sentence", "[mpm][source]") {
  SourceSpec good = some()[0];
  auto const refused = [&](SourceSpec const& bad, double dx, std::string const& sentence) {
    CHECK_THROWS_WITH(outflow(bad, dx, 1, 1), ContainsSubstring(sentence));
  };
  SourceSpec bad = good;
  bad.velocity = {};
  refused(bad, 0.1, "give a velocity that is not 0");
  bad = good;
  bad.shape = BoundaryShape::torus;
  refused(bad, 0.1, "no box, ball or cylinder");
  bad.shape = BoundaryShape::field;
  refused(bad, 0.1, "no box, ball or cylinder");
  bad = good;
  bad.size[0] = -1;
  refused(bad, 0.1, "a size of -1 m");
  bad = good;
  bad.end = bad.start;
  refused(bad, 0.1, "let it end after its start");
  refused(good, 0, "give both above 0");
  refused(good, 1e-5, "give a coarser grid");
  bad = good;
  bad.end = 1e-9;
  refused(bad, 0.1, "no room for a particle");
}

TEST_CASE("a field of distances is that of its surface", "[mpm][boundary]") {
  Vec3<double> const half{0.31, 0.17, 0.52};
  TriangleMesh surface = box_surface(half);
  surface.triangles.push_back({0, 0, 1});  // without area, and of no effect
  Solid const solid = solid_in_surface(box_surface(half), "box");
  double const spacing = 0.04, band = 0.15;
  auto const field =
      std::make_shared<DistanceField>(distance_field(surface, solid, spacing, band, "box"));
  Boundary exact;
  exact.shape = BoundaryShape::box;
  exact.size = 2.0 * half;
  Vec3<double> normal, other;
  std::size_t at = 0, inside = 0;
  for (int i = 0; i < field->n[0]; ++i)
    for (int j = 0; j < field->n[1]; ++j)
      for (int k = 0; k < field->n[2]; ++k) {
        Vec3<double> const x =
            field->lowest + spacing * Vec3<double>{double(i), double(j), double(k)};
        double const d = std::clamp(exact.distance(x, normal), -band, band);
        inside += d < 0;
        REQUIRE_THAT(double(field->values[at++]), WithinAbs(d, 1e-6));
      }
  CHECK(inside > 500);

  // As a boundary that is turned, and moves.
  RigidPose const pose{turn_matrix({{0.6, 0, 0.8}, 0.7}), {1, 2, 3}};
  std::vector<BoundarySpec> specs(2);
  for (BoundarySpec& spec : specs) {
    spec.name = "box";
    spec.motion = [&](double) { return BoundaryMotion{pose, {1, 0, 0}, {0, 0, 2}}; };
  }
  specs[0].shape = BoundaryShape::box;
  specs[0].size = exact.size;
  specs[1].shape = BoundaryShape::field;
  specs[1].field = field;
  BoundaryList<Host> const list(specs);
  std::mt19937 random(3);
  int near = 0;
  for (int n = 0; n < 20000; ++n) {
    Vec3<double> y;
    for (int c = 0; c < 3; ++c) {
      y[c] = (2 * double(random()) / 4294967296.0 - 1) * (half[c] + 2 * band);
    }
    Vec3<double> const x = pose(y);
    double const d = list.list()(0).distance(x, normal), e = list.list()(1).distance(x, other);
    CHECK(norm(list.list()(0).velocity_at(x) - list.list()(1).velocity_at(x)) == 0);
    // Between lattice points a distance is off by less than a part of a cell, and on flat parts not
    // at all.
    CHECK(std::abs(std::clamp(d, -band, band) - e) < 0.5 * spacing);
    if (std::abs(d) > spacing) CHECK((d <= 0) == list.list()(1).holds(x));
    bool flat = std::abs(d) < band - 2 * spacing;
    for (int c = 0; c < 3; ++c)
      flat &= std::abs(std::abs(y[c]) - half[c]) > 2 * spacing ||
              std::abs(transpose_times(pose.rotation, normal)[c]) > 0.99;
    int beyond = 0;
    for (int c = 0; c < 3; ++c) beyond += std::abs(y[c]) > half[c] - 2 * spacing - band;
    if (!flat || beyond != 1) continue;
    ++near;
    CHECK_THAT(e, WithinAbs(d, 1e-6));
    CHECK(norm(normal - other) < 1e-5);
  }
  CHECK(near > 100);
  // Deeper than the band there is no ascent, and no normal.
  specs[1].field =
      std::make_shared<DistanceField>(distance_field(surface, solid, spacing, 0.06, "box"));
  BoundaryList<Host> const narrow(specs);
  for (Vec3<double> const& y : {Vec3<double>{0.01, 0.013, 0.017}, Vec3<double>{9, 9, 9}}) {
    double const d = narrow.list()(1).distance(pose(y), other);
    CHECK_THAT(std::abs(d), WithinAbs(0.06, 1e-6));
    CHECK(norm(other) == 0);
  }
  CHECK_THROWS_WITH(distance_field(surface, solid, 0.1, 0.05, "box"), ContainsSubstring("band"));
  CHECK_THROWS_WITH(distance_field(surface, solid, 1e-4, 0.05, "box"),
                    ContainsSubstring("raise grid.spacing"));
  specs[1].field = nullptr;
  CHECK_THROWS_WITH(BoundaryList<Host>(specs), ContainsSubstring("go together"));
}

}  // namespace taut
