// The obstacle term: against the sum over vertices and faces in extended precision, against
// differences, and what it promises of fixed vertices, bounds, starts and repeatability.
#include "obstacle_scenes.hpp"

#include <support/threads.hpp>
#include <taut/core/math/symmetric_eigen.hpp>
#include <taut/core/potential/any_terms.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <limits>
#include <tuple>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pressure = 1e4;

template <class Shape, class Precision, class S = DefaultSpace,
          class Barrier = Normalised<LogBarrier>>
struct Fixture {
  using Term = Obstacle<Shape, Barrier, GivenStiffness, Precision, S>;
  using Real = typename Precision::real;
  using Position = typename Precision::position;
  Thrown<Shape> scene;
  Unknowns<Precision, S> unknowns;
  Term obstacle;
  typename Term::Positions x;
  typename Term::Vectors p, g, diagonal;
  typename Term::Blocks blocks;

  Fixture()
      : unknowns(std::vector<double>(scene.x.size(), 1), 0.5),
        obstacle(
            unknowns, scene.surface, scene.rest, scene.shape,
            {.dhat = Thrown<Shape>::dhat, .start_share = 0, .stiffness = {.pressure = pressure}},
            scene.pose),
        x(soups::to_field<Position, S>(scene.x)),
        p(soups::to_field<Real, S>(scene.p)),
        g("g", scene.size()),
        diagonal("diagonal", scene.size()),
        blocks("blocks", scene.size()) {}
  void move(double by) {
    auto const host = Kokkos::create_mirror_view(x);
    for (int v = 0; v < scene.size(); ++v)
      for (int c = 0; c < 3; ++c) {
        host(v, c) = static_cast<Position>(scene.x[v][c] + by * scene.p[v][c]);
      }
    assign(x, host);
  }
  typename Term::Vectors gradient() {
    typename Term::Vectors const to("gradient", scene.size());
    obstacle.add_gradient(x, 1, unknowns.fixed, to);
    return to;
  }
};

double product_of(std::vector<Point> const& a, std::vector<Point> const& b) {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) r += a[i][c] * b[i][c];
  return r;
}
double largest(std::vector<Point> const& v) {
  double r = 0;
  for (Point const& p : v)
    for (double c : p) r = std::max(r, std::abs(c));
  return r;
}
double furthest(std::vector<Point> const& a, std::vector<Point> const& b) {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) r = std::max(r, std::abs(a[i][c] - b[i][c]));
  return r;
}

/// All that the term computes, bit by bit.
template <class Shape, class Precision, class S>
std::vector<double> everything() {
  Fixture<Shape, Precision, S> f;
  auto const& fixed = f.unknowns.fixed;
  std::vector<double> all{f.obstacle.value(f.x, 0.5), f.obstacle.change(f.x, f.p, 1e-3, 0.5),
                          f.obstacle.quadratic_form(f.x, f.p, 0.5),
                          f.obstacle.max_step(f.x, f.p, 1.0)};
  auto const add = [&](auto const& field) {
    for (Point const& v : to_points(field)) all.insert(all.end(), v.begin(), v.end());
  };
  all.push_back(f.obstacle.add_gradient_after(f.x, f.p, 1e-3, 0.5, fixed, f.g, f.blocks));
  f.obstacle.add_gradient(f.x, 0.5, fixed, f.g, f.diagonal);
  f.obstacle.add_product(f.x, f.p, 0.5, fixed, f.g);
  add(f.g), add(f.diagonal), add(f.blocks);
  RigidPose to = f.scene.pose;
  to.rotation = turn_matrix({{0, 1, 0}, 0.2}) * to.rotation;
  f.obstacle.move_to(to);
  all.push_back(f.obstacle.motion_left(f.x));
  all.push_back(f.obstacle.max_advance(f.x, f.p, 1));
  auto const report = f.obstacle.report(f.x);
  all.insert(all.end(), {double(report.contacts), report.smallest_gap, report.force[0]});
  return all;
}

template <class Shape, class Barrier>
struct Case {
  using shape = Shape;
  using barrier = Barrier;
};
using Default = Normalised<LogBarrier>;

}  // namespace

TEST_CASE("an obstacle is a term, chosen at compile time or at run time", "[obstacle]") {
  using Term = Obstacle<HalfSpace>;
  STATIC_REQUIRE(SweptTerm<Term>);
  STATIC_REQUIRE(SteppedTerm<Term>);
  STATIC_REQUIRE(MovingTerm<Term>);
  STATIC_REQUIRE(ObstructedTerm<Term>);
  STATIC_REQUIRE(SweptTerm<Obstacle<InsideBox, IpcBarrier, GivenStiffness, Fp32, Left>>);
  Fixture<InsideBall, Mixed> f;
  AnySteppedTerms<> terms;
  terms.add(f.obstacle);
  CHECK(terms.value(f.x, 2.0) == f.obstacle.value(f.x, 2.0));
}

TEMPLATE_TEST_CASE("an obstacle is the sum over vertices and faces", "[obstacle]",
                   (std::tuple<HalfSpace, Fp64>), (std::tuple<InsideBall, Fp64>),
                   (std::tuple<InsideBox, Fp64>), (std::tuple<InsideCylinder, Fp64>),
                   (std::tuple<InsideCylinder, Mixed>), (std::tuple<InsideCylinder, Fp32>)) {
  using Shape = std::tuple_element_t<0, TestType>;
  using Precision = std::tuple_element_t<1, TestType>;
  Fixture<Shape, Precision> f;
  std::vector<double> const area = shown_areas(f.scene.surface, f.scene.rest);
  std::vector<Point> const x = to_points(f.x);
  double energy = 0, gap = 1;
  int contacts = 0, corners = 0;
  for (int v : f.scene.surface.vertices) {
    int here = 0;
    for (long double d : face_distances(f.scene.shape, f.scene.pose, {x[v][0], x[v][1], x[v][2]})) {
      gap = std::min(gap, double(d) / Thrown<Shape>::dhat);
      if (!(double(d) < Thrown<Shape>::dhat)) continue;
      ++here;
      energy += pressure * area[v] / Thrown<Shape>::dhat *
                evaluate_barrier<Default>(double(d), Thrown<Shape>::dhat).value;
    }
    contacts += here;
    corners += here > 1;
  }
  REQUIRE(contacts > 20);
  if (Shape::max_faces > 1) REQUIRE(corners > 5);
  double const tolerance = std::is_same_v<typename Precision::real, double> ? 1e-12 : 1e-6;
  CHECK_THAT(f.obstacle.value(f.x, 0.25), WithinRel(0.25 * energy, tolerance));
  ObstacleReport const report = f.obstacle.report(f.x);
  CHECK(report.contacts == contacts);
  CHECK_THAT(report.smallest_gap, WithinRel(gap, 1e-12));
  // What pushes the bodies is the gradient of all.
  Vec3<double> force{0, 0, 0};
  for (Point const& g : to_points(f.gradient())) force = force - Vec3<double>{g[0], g[1], g[2]};
  CHECK(norm(force - report.force) < (tolerance + 1e-14) * norm(force) * contacts);
}

TEMPLATE_TEST_CASE("energy, gradient and curvature of an obstacle belong together", "[obstacle]",
                   (Case<HalfSpace, Default>), (Case<InsideBall, Default>),
                   (Case<InsideBox, Default>), (Case<InsideCylinder, Default>),
                   (Case<InsideBall, IpcBarrier>), (Case<InsideCylinder, LogSquaredBarrier>),
                   (Case<InsideBall, CubicBarrier>)) {
  using Shape = typename TestType::shape;
  Fixture<Shape, Fp64, DefaultSpace, typename TestType::barrier> f;
  double const scale = 0.25, step = 1e-6;
  auto const& fixed = f.unknowns.fixed;
  f.obstacle.add_gradient(f.x, scale, fixed, f.g);
  double const slope = product_of(to_points(f.g), f.scene.p);
  auto const energy = [&](double by) {
    f.move(by);
    return f.obstacle.value(f.x, scale);
  };
  CHECK_THAT((energy(step) - energy(-step)) / (2 * step), WithinRel(slope, 1e-6));
  double const here = energy(0);
  for (double alpha : {1e-9, 1e-3, -1e-3}) {
    double const change = f.obstacle.change(f.x, f.p, alpha, scale);
    CHECK_THAT(change, WithinRel(energy(alpha) - here, alpha == 1e-9 ? 1e-3 : 1e-9));
    CHECK_THAT(f.obstacle.add_gradient_after(f.x, f.p, alpha, scale, fixed, f.g),
               WithinRel(change, 1e-9));
    energy(0);
  }
  CHECK_THAT(f.obstacle.change(f.x, f.p, 1e-13, scale), WithinRel(1e-13 * slope, 1e-7));

  // The Hessian is the exact one: where a vertex is not about to come into contact.
  f.move(step);
  std::vector<Point> const after = to_points(f.gradient());
  f.move(-step);
  std::vector<Point> difference = to_points(f.gradient());
  f.move(0);
  for (int v = 0; v < f.scene.size(); ++v)
    for (int c = 0; c < 3; ++c) {
      difference[v][c] = scale * (after[v][c] - difference[v][c]) / (2 * step);
    }
  assign(f.g, 0);
  f.obstacle.add_product(f.x, f.p, scale, fixed, f.g);
  std::vector<Point> const hp = to_points(f.g);
  CHECK(furthest(hp, difference) < 2e-6 * largest(hp));
  double const form = f.obstacle.quadratic_form(f.x, f.p, scale);
  CHECK(form > 0);
  CHECK_THAT(product_of(hp, f.scene.p), WithinRel(form, 1e-12));

  Potential potential(f.unknowns, f.obstacle);
  potential.begin_step(f.x, scale, 0.5, false);
  auto const matrix = potential.pattern(f.x);
  potential.assemble(f.x, matrix);
  typename decltype(f)::Term::Vectors assembled("hp", f.scene.size());
  product(matrix, f.p, assembled);
  CHECK(furthest(to_points(assembled), hp) < 1e-13 * largest(hp));
  f.obstacle.add_gradient(f.x, scale, fixed, f.g, f.blocks);
  f.obstacle.add_gradient(f.x, scale, fixed, f.g, f.diagonal);
  auto const blocks = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), f.blocks);
  auto const diagonal = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), f.diagonal);
  double error = 0, least = 0, stiffest = 0;
  for (int v = 0; v < f.scene.size(); ++v) {
    Sym3<double> h;
    for (int k = 0; k < 6; ++k) h.s[k] = blocks(v, k);
    Vec3<double> const y = h * Vec3<double>{f.scene.p[v][0], f.scene.p[v][1], f.scene.p[v][2]};
    for (int c = 0; c < 3; ++c) {
      error = std::max({error, std::abs(y[c] - hp[v][c]), std::abs(diagonal(v, c) - h.s[c])});
      stiffest = std::max(stiffest, h.s[c]);
    }
    least = std::min(least, symmetric_eigen(h).values[2]);
  }
  CHECK(error < 1e-13 * stiffest);
  CHECK(least > -1e-13 * stiffest);
}

TEMPLATE_TEST_CASE("an obstacle is bitwise the same on any number of threads and in both layouts",
                   "[obstacle]", (std::tuple<InsideBox, Fp64>), (std::tuple<InsideCylinder, Mixed>),
                   (std::tuple<InsideCylinder, Fp32>)) {
  using Shape = std::tuple_element_t<0, TestType>;
  using Precision = std::tuple_element_t<1, TestType>;
  auto const results =
      test::on_one_thread_and_all([] { return everything<Shape, Precision, DefaultSpace>(); });
  CHECK(results[0] == results[1]);
  CHECK(results[0] == everything<Shape, Precision, Left>());
}

TEMPLATE_TEST_CASE("no step that an obstacle allows leaves it", "[obstacle]",
                   (std::tuple<HalfSpace, Fp64>), (std::tuple<InsideBall, Fp64>),
                   (std::tuple<InsideBox, Fp64>), (std::tuple<InsideCylinder, Mixed>),
                   (std::tuple<InsideCylinder, Fp32>)) {
  using Shape = std::tuple_element_t<0, TestType>;
  using Precision = std::tuple_element_t<1, TestType>;
  Fixture<Shape, Precision> f;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  auto const kept_of = [](auto gap) {
    return decltype(gap)(0.55) * std::min(gap, decltype(gap)(Thrown<Shape>::dhat));
  };
  int cut = 0;
  std::vector<Point> const start = f.scene.x = to_points(f.x);  // as it is stored
  for (int trial = 0; trial < 100; ++trial) {
    double const size = std::pow(10.0, 3 * any(random));
    for (Point& p : f.scene.p)
      for (double& c : p) c = size * any(random);
    auto const p = soups::to_field<typename Precision::real, DefaultSpace>(f.scene.p);
    f.scene.p = to_points(p);  // as it is stored
    double const at_most = trial % 4 == 0 ? infinity : 2;
    double const alpha = f.obstacle.max_step(f.x, p, at_most);
    REQUIRE(alpha > 0);
    CHECK(alpha <= at_most);
    CHECK(f.obstacle.max_prescribed_step(f.x, p, at_most) == alpha);
    CHECK(f.obstacle.max_advance(f.x, p, at_most) == alpha);
    auto const limiting = f.obstacle.limiting_vertex();
    CHECK(limiting.has_value() == (alpha < at_most));
    CHECK(f.obstacle.obstruction().has_value() == (alpha < at_most));
    if (!limiting) continue;
    ++cut;
    CHECK(limiting->alpha == alpha);
    f.move(alpha);
    std::vector<Point> const after = to_points(f.x);
    f.move(0);
    for (int v : f.scene.surface.vertices) {
      auto const before =
          face_distances(f.scene.shape, f.scene.pose, {start[v][0], start[v][1], start[v][2]});
      auto const then =
          face_distances(f.scene.shape, f.scene.pose, {after[v][0], after[v][1], after[v][2]});
      bool kept = true;
      for (std::size_t k = 0; k < then.size(); ++k)
        kept = kept && then[k] > kept_of(before[k]) * (1 - 1e-12L);
      CHECK(kept);
      if (v == limiting->vertex) {
        CHECK(double(then[limiting->face] / kept_of(before[limiting->face])) < 1 + 1e-3);
      }
    }
  }
  CHECK(cut > 60);
}

TEST_CASE("an obstacle leaves fixed vertices alone, but not their way", "[obstacle]") {
  Fixture<HalfSpace, Fp64> f;
  assign(f.unknowns.fixed, 7);
  CHECK(f.obstacle.value(f.x, 1) == 0);
  CHECK(f.obstacle.change(f.x, f.p, 1e-3, 1) == 0);
  CHECK(f.obstacle.quadratic_form(f.x, f.p, 1) == 0);
  CHECK(f.obstacle.report(f.x).contacts == 0);
  assign(f.g, 7);
  f.obstacle.add_gradient(f.x, 1, f.unknowns.fixed, f.g, f.blocks);
  f.obstacle.add_product(f.x, f.p, 1, f.unknowns.fixed, f.g);
  for (Point const& g : to_points(f.g)) CHECK(g == Point{7, 7, 7});
  CHECK(f.obstacle.max_prescribed_step(f.x, f.p, 100.0) < 1);
}

TEST_CASE("what starts beyond an obstacle is refused, unless it is held there", "[obstacle]") {
  Fixture<HalfSpace, Fp64> f;
  int const v = f.scene.surface.vertices[5];
  Point const n{0.3, 2, -0.4};
  Vec3<double> const normal = f.scene.pose.rotation * Vec3<double>{n[0], n[1], n[2]};
  double const length = norm(normal);
  StepStart<Fp64, DefaultSpace> start{f.x, 0.01, {}};
  CHECK_NOTHROW(f.obstacle.begin_step(start));
  CHECK(f.obstacle.held() == 0);
  Vec3<double> const at{f.scene.x[v][0], f.scene.x[v][1], f.scene.x[v][2]};
  double const gap = least_distance(f.scene.shape, f.scene.pose, at);
  auto const put = [&](double distance) {
    auto const host = Kokkos::create_mirror_view(f.x);
    for (int c = 0; c < 3; ++c) host(v, c) = at[c] + (distance - gap) * normal[c] / length;
    assign(f.x, host);
  };
  put(-0.01);
  CHECK_THROWS_WITH(f.obstacle.begin_step(start),
                    ContainsSubstring(fmt::format("vertex {} at", v)) &&
                        ContainsSubstring("is -0.01") && ContainsSubstring("half-space"));
  put(1e-17);
  CHECK_THROWS_AS(f.obstacle.begin_step(start), Error);
  put(1e-9);
  CHECK_NOTHROW(f.obstacle.begin_step(start));
  auto const host = Kokkos::create_mirror_view(f.x);
  assign(host, f.x);
  host(v, 1) = std::nan("");
  assign(f.x, host);
  CHECK_THROWS_AS(f.obstacle.begin_step(start), Error);

  // Pinned when it first meets it: held, and in nobody's way.
  put(-0.01);
  auto const mask = Kokkos::create_mirror_view(f.unknowns.fixed);
  mask(v) = 1;
  assign(f.unknowns.fixed, mask);
  CHECK_THROWS_AS(f.obstacle.begin_step(start), Error);  // it came in later
  f.obstacle.place(f.scene.pose);
  CHECK_NOTHROW(f.obstacle.begin_step(start));
  CHECK(f.obstacle.held() == 1);
  assign(f.p, 0);
  auto const p = Kokkos::create_mirror_view(f.p);
  p(v, 0) = 5;
  assign(f.p, p);
  CHECK(f.obstacle.max_prescribed_step(f.x, f.p, 1) == 1);
  // Once it has come out it may not go back, nor may it be let go inside.
  mask(v) = 0;
  assign(f.unknowns.fixed, mask);
  CHECK_THROWS_AS(f.obstacle.begin_step(start), Error);
  mask(v) = 1;
  assign(f.unknowns.fixed, mask);
  put(0.01);
  CHECK_NOTHROW(f.obstacle.begin_step(start));
  CHECK(f.obstacle.held() == 0);
}

TEST_CASE("energies beyond a face are infinite, whatever the barrier", "[obstacle]") {
  Fixture<HalfSpace, Fp64, DefaultSpace, CubicBarrier> f;
  f.scene.x[f.scene.surface.vertices[0]] = {0, -9, 0};
  f.move(0);
  CHECK(f.obstacle.value(f.x, 1) == infinity);
  CHECK(f.obstacle.max_step(f.x, f.p, 1) == 0);
  REQUIRE(f.obstacle.limiting_vertex().has_value());
  CHECK(f.obstacle.limiting_vertex()->vertex == f.scene.surface.vertices[0]);
}

TEST_CASE("a vertex shows what faces one way of the area around it", "[obstacle]") {
  // A block of two by two by two cells, the faces of each halved twice.
  TetMesh const mesh = make_shape(BoxShape{{2, 2, 2}}, 2);
  Surface const surface =
      make_surface(boundary_faces(mesh.tets), std::vector<int>(mesh.points.size(), 0));
  std::vector<double> const shown = shown_areas(surface, mesh.points);
  std::vector<double> const whole = vertex_areas(surface, mesh.points);
  double bottom = 0;
  for (int v : surface.vertices) {
    Point const& x = mesh.points[v];
    int ends = 0;
    for (double c : x) ends += std::abs(c) == 1;
    // A vertex within a face, of an edge, of a corner.
    CHECK_THAT(shown[v], WithinRel(whole[v] / ends, 1e-12));
    if (x[1] == -1) bottom += shown[v];
  }
  CHECK_THAT(bottom, WithinRel(4, 1e-12));
}

TEST_CASE("the stiffness of an obstacle may follow what the vertices resist with", "[obstacle]") {
  Fixture<InsideBall, Fp64> f;
  using Term = Obstacle<InsideBall, Default, ElasticInclusiveStiffness, Fp64>;
  Term const obstacle(f.unknowns, f.scene.surface, f.scene.rest, f.scene.shape,
                      {.dhat = 0.3, .start_share = 0}, f.scene.pose);
  CHECK_THROWS_WITH(obstacle.value(f.x, 1), ContainsSubstring("begin_step"));
  Array<double, DefaultSpace> const stiffness("stiffness", f.scene.size());
  assign(stiffness, 100);
  obstacle.begin_step({f.x, 0.01, stiffness});
  double const one = obstacle.value(f.x, 1);
  CHECK(one > 0);
  assign(stiffness, 300);  // copied: nothing changes within the step
  CHECK(obstacle.value(f.x, 1) == one);
  obstacle.begin_step({f.x, 0.01, stiffness});
  CHECK_THAT(obstacle.value(f.x, 1), WithinRel(3 * one, 1e-12));
  CHECK_THROWS_WITH(obstacle.begin_step({f.x, 0.01, Array<double, DefaultSpace>("short", 3)}),
                    ContainsSubstring("3 vertices"));
}

TEST_CASE("an obstacle refuses a step that is not finite", "[obstacle]") {
  Fixture<InsideBox, Mixed> f;
  f.scene.p[f.scene.surface.vertices[3]][1] = std::nan("");
  auto const p = soups::to_field<float, DefaultSpace>(f.scene.p);
  CHECK_THROWS_WITH(f.obstacle.max_step(f.x, p, 1), ContainsSubstring("not finite"));
}

TEST_CASE("an obstacle says what it cannot be made of", "[obstacle]") {
  Thrown<InsideBall> s;
  Unknowns<Fp64> const unknowns(std::vector<double>(s.x.size(), 1), 0.5);
  auto const make = [&](auto const& shape, double dhat = 0.3, double share = 0.9, double p = 1,
                        RigidPose const& pose = {}) {
    using Term = Obstacle<std::decay_t<decltype(shape)>, Default, GivenStiffness, Fp64>;
    return Term(unknowns, s.surface, s.rest, shape,
                {.dhat = dhat, .stiffness = {.pressure = p}, .clearance = {.share = share}}, pose);
  };
  CHECK_NOTHROW(make(s.shape));
  CHECK_THROWS_WITH(make(HalfSpace{{0, 0, 0}, {0, 0, 0}}), ContainsSubstring("normal"));
  CHECK_THROWS_WITH(make(HalfSpace{{0, std::nan(""), 0}, {0, 1, 0}}), ContainsSubstring("point"));
  CHECK_THROWS_WITH(make(InsideBall{{0, 0, 0}, -1}), ContainsSubstring("radius"));
  CHECK_THROWS_WITH(make(InsideBall{{0, 0, 0}, 0.2}), ContainsSubstring("shorter than the radius"));
  CHECK_THROWS_WITH(make(InsideBox{{0, 0, 0}, {1, 0, 1}}), ContainsSubstring("size"));
  CHECK_THROWS_WITH(make(InsideCylinder{{0, 0, 0}, {0, 0, 0}}), ContainsSubstring("axis"));
  CHECK_THROWS_WITH(make(InsideCylinder{{0, 0, 0}, {0, 1, 0}, 1, 0}), ContainsSubstring("length"));
  CHECK_NOTHROW(make(InsideCylinder{{0, 0, 0}, {0, 1, 0}, 1, 0, false}));
  CHECK_THROWS_WITH(make(s.shape, -1), ContainsSubstring("activation distance"));
  CHECK_THROWS_WITH(make(s.shape, 0.3, 1), ContainsSubstring("share"));
  CHECK_THROWS_WITH(make(s.shape, 0.3, 0.9, 0), ContainsSubstring("positive stiffness"));
  RigidPose mirror;
  mirror.rotation(1, 1) = -1;
  CHECK_THROWS_WITH(make(s.shape, 0.3, 0.9, 1, mirror), ContainsSubstring("no rotation"));
  RigidPose far;
  far.translation[0] = infinity;
  CHECK_THROWS_WITH(make(s.shape, 0.3, 0.9, 1, far), ContainsSubstring("finite"));
  // Any normal and axis will do, however long.
  CHECK_NOTHROW(make(HalfSpace{{0, 0, 0}, {0, 1e-200, 0}}));
  CHECK_NOTHROW(make(InsideCylinder{{0, 0, 0}, {1e200, 1e200, 0}}));
  CHECK_THAT(norm(HalfSpace{{0, 0, 0}, {3e-200, 1e-200, 0}}.face(0).direction),
             WithinAbs(1, 1e-15));
}
