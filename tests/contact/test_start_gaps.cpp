// What starts closer than dhat: nothing acts where it starts, and what has once been further apart
// acts from further on; against all pairs, one by one.
#include "contact_scenes.hpp"
#include "obstacle_scenes.hpp"

#include <taut/core/potential/potential.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <limits>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;

namespace {

constexpr double share = 0.9, dhat = 0.15;
using Term =
    Contact<PairEnergy<>, Bvh<DefaultSpace>, AdditiveCcd, GivenStiffness, Fp64, DefaultSpace>;

/// Two uneven cubes, the upper one turned, with a gap.
struct TwoCubes {
  std::vector<Point> rest;
  Surface surface;
  Unknowns<Fp64> unknowns;

  explicit TwoCubes(double gap) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uneven(-0.02, 0.02);
    Boxes const boxes({{BoxShape{}, 2}, {BoxShape{{0.8, 0.8, 0.8}}, 2}}, [&](int b, Point x0) {
      for (double& c : x0) c += uneven(random);
      if (b == 0) return x0;
      Point const t = turned(x0, 0.3);
      return Point{t[0], t[1] + 0.94 + gap, t[2]};
    });
    rest = boxes.mesh.points;
    surface = boxes.surface();
    unknowns = Unknowns<Fp64>(std::vector<double>(rest.size(), 1), 0.5);
  }
  Term contact(double start_share = share) const {
    return Term(unknowns, surface, rest,
                {.dhat = dhat, .start_share = start_share, .stiffness = {.pressure = 1e4}});
  }
  /// With the upper cube this much further up.
  VectorField<double, DefaultSpace> at(double up) const {
    std::vector<Point> x = rest;
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (surface.object[v] == 1) x[v][1] += up;
    }
    return soups::to_field<double, DefaultSpace>(x);
  }
  /// Calls visit(distance, vertices) for all pairs of both cubes.
  template <class Visit>
  void for_each_pair(VectorField<double, DefaultSpace> const& field, Visit const& visit) const {
    auto const x = to_points(field);
    auto const look = [&](PairKind kind, std::array<int, 4> const& v) {
      if (surface.object[v[0]] == surface.object[v[3]]) return;
      Vec3<double> y[4];
      for (int a = 0; a < 4; ++a)
        for (int c = 0; c < 3; ++c) y[a][c] = x[v[a]][c];
      visit(closest_points(kind, y).distance, v);
    };
    for (int p : surface.vertices)
      for (Triangle const& t : surface.triangles)
        look(PairKind::point_triangle, {p, t[0], t[1], t[2]});
    for (std::size_t i = 0; i < surface.edges.size(); ++i)
      for (std::size_t j = i + 1; j < surface.edges.size(); ++j) {
        Edge const &a = surface.edges[i], &b = surface.edges[j];
        look(PairKind::edge_edge, {a[0], a[1], b[0], b[1]});
      }
  }
  std::vector<double> gaps(VectorField<double, DefaultSpace> const& x) const {
    std::vector<double> gap(rest.size(), std::numeric_limits<double>::infinity());
    for_each_pair(x, [&](double d, std::array<int, 4> const& v) {
      for (int vertex : v) gap[vertex] = std::min(gap[vertex], d);
    });
    return gap;
  }
};

void begin_step(Term const& contact, TwoCubes const& scene,
                VectorField<double, DefaultSpace> const& x) {
  Potential potential(scene.unknowns, contact);
  potential.begin_step(x, 1, 0.01, false);
}

std::vector<double> to_vector(Array<double, DefaultSpace> const& a) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a);
  return {host.data(), host.data() + host.extent(0)};
}

}  // namespace

TEST_CASE("bodies that start close act below the share of each vertex's largest gap", "[contact]") {
  TwoCubes const scene(0.03);
  Term const contact = scene.contact();
  std::vector<double> expected(scene.rest.size(), 0.0);
  // Further apart, closer again, and far.
  for (double up : {0.0, 0.05, -0.01, 0.08, 1.0}) {
    CAPTURE(up);
    auto const x = scene.at(up);
    begin_step(contact, scene, x);
    auto const gap = scene.gaps(x);
    auto const found = to_vector(contact.activation());
    REQUIRE(found.size() == expected.size());
    int below = 0;
    for (std::size_t v = 0; v < expected.size(); ++v) {
      if (!std::binary_search(scene.surface.vertices.begin(), scene.surface.vertices.end(),
                              int(v))) {
        continue;
      }
      expected[v] = std::min(dhat, std::max(expected[v], share * gap[v]));
      CHECK_THAT(found[v], WithinRel(expected[v], 1e-12));
      below += found[v] < dhat;
    }
    CHECK((below > 0) == (up < 0.5));
  }
}

TEST_CASE("no pair of two bodies acts where it starts, and each does below that", "[contact]") {
  TwoCubes const scene(0.03);
  Term const contact = scene.contact(), usual = scene.contact(0);
  auto const x = scene.at(0);
  begin_step(contact, scene, x);
  begin_step(usual, scene, x);
  CHECK(contact.value(x, 1) == 0);
  CHECK(contact.report(x).contacts == 0);
  CHECK(usual.report(x).contacts > 0);
  auto const a = to_vector(contact.activation());
  auto const closer = scene.at(-0.015);
  int acting = 0;
  scene.for_each_pair(closer, [&](double d, std::array<int, 4> const& v) {
    acting += d < std::min({dhat, a[v[0]], a[v[1]], a[v[2]], a[v[3]]});
  });
  CHECK(acting > 0);
  CHECK(contact.report(closer).contacts == acting);
  CHECK(contact.value(closer, 1) > 0);
  // As from a checkpoint.
  Term const restored = scene.contact();
  restored.set_activation(contact.activation());
  begin_step(restored, scene, closer);
  CHECK(to_vector(restored.activation()) == a);
  CHECK(restored.value(closer, 1) == contact.value(closer, 1));
}

TEST_CASE("a vertex that starts close to an obstacle is acted on from closer", "[obstacle]") {
  TwoCubes const scene(0.5);
  double least = std::numeric_limits<double>::infinity();
  for (Point const& p : scene.rest) least = std::min(least, p[1]);
  HalfSpace const floor{{0, least - 0.02, 0}, {0, 1, 0}};
  using Ground = Obstacle<HalfSpace, Normalised<LogBarrier>, GivenStiffness, Fp64>;
  Ground const ground(scene.unknowns, scene.surface, scene.rest, floor,
                      {.dhat = dhat, .start_share = share, .stiffness = {.pressure = 1e4}});
  Ground const usual(scene.unknowns, scene.surface, scene.rest, floor,
                     {.dhat = dhat, .start_share = 0, .stiffness = {.pressure = 1e4}});
  Potential potential(scene.unknowns, ground, usual);
  std::vector<double> expected(scene.surface.vertices.size(), 0.0);
  for (double up : {0.0, 0.04, -0.01, 0.5}) {
    CAPTURE(up);
    std::vector<Point> moved = scene.rest;
    for (Point& p : moved) p[1] += up;
    auto const x = soups::to_field<double, DefaultSpace>(moved);
    potential.begin_step(x, 1, 0.01, false);
    auto const found = to_vector(ground.activation());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      double const gap = moved[scene.surface.vertices[i]][1] - floor.point[1];
      expected[i] = std::min(dhat, std::max(expected[i], share * gap));
      CHECK_THAT(found[i], WithinRel(expected[i], 1e-12));
    }
    if (up == 0) {
      CHECK(ground.value(x, 1) == 0);
      CHECK(usual.value(x, 1) > 0);
    }
    if (up < 0) CHECK(ground.report(x).contacts > 0);
  }
  for (double a : to_vector(ground.activation())) CHECK(a == dhat);
}

TEST_CASE("a share of the gap at the start is below 1", "[contact]") {
  TwoCubes const scene(0.03);
  CHECK_THROWS_WITH(scene.contact(1), ContainsSubstring("give a share from 0 on and below 1"));
}
