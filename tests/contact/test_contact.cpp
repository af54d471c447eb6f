// The contact term: against the serial sum over all pairs, against differences, and what it
// promises of fixed vertices, searches, bounds and repeatability.
#include "contact_scenes.hpp"

#include <support/threads.hpp>
#include <taut/contact/spatial_hash.hpp>
#include <taut/core/potential/any_terms.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <limits>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pressure = 1e4;

template <class Precision, class S = DefaultSpace, class Search = Bvh<S>,
          class Rule = GivenStiffness>
using ContactIn = Contact<PairEnergy<>, Search, AdditiveCcd, Rule, Precision, S>;

/// The squashed cubes with a contact term over them.
template <class Precision, class S = DefaultSpace, class Search = Bvh<S>>
struct Fixture {
  using Term = ContactIn<Precision, S, Search>;
  using Real = typename Precision::real;
  Squashed scene;
  Unknowns<Precision, S> unknowns;
  Term contact;
  typename Term::Positions x;
  typename Term::Vectors p, g, diagonal;
  typename Term::Blocks blocks;

  Fixture() : Fixture(Squashed()) {}
  explicit Fixture(Squashed const& s)
      : scene(s),
        unknowns(std::vector<double>(s.x.size(), 1), 0.5),
        contact(unknowns, s.surface, s.rest,
                {.dhat = Squashed::dhat, .start_share = 0, .stiffness = {.pressure = pressure}}),
        x(soups::to_field<typename Precision::position, S>(s.x)),
        p(soups::to_field<Real, S>(s.p)),
        g("g", s.size()),
        diagonal("diagonal", s.size()),
        blocks("blocks", s.size()) {}
  void clear() {
    assign(g, 0);
    assign(diagonal, 0);
    assign(blocks, 0);
  }
  Oracle oracle() const {
    return {scene.surface, scene.rest, to_points(x), Squashed::dhat, 0.5, pressure};
  }
};

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
double product_of(std::vector<Point> const& a, std::vector<Point> const& b) {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) r += a[i][c] * b[i][c];
  return r;
}

template <class Field>
void move(Field const& x, std::vector<Point> const& from, std::vector<Point> const& p, double by) {
  auto const host = Kokkos::create_mirror_view(x);
  for (std::size_t v = 0; v < from.size(); ++v)
    for (int c = 0; c < 3; ++c) {
      host(v, c) = static_cast<typename Field::non_const_value_type>(from[v][c] + by * p[v][c]);
    }
  assign(x, host);
}

/// All that the term computes, bit by bit.
template <class Precision, class S, class Search = Bvh<S>>
std::vector<double> everything() {
  Fixture<Precision, S, Search> f;
  std::vector<double> all{f.contact.value(f.x, 0.5), f.contact.change(f.x, f.p, 1e-3, 0.5),
                          f.contact.quadratic_form(f.x, f.p, 0.5),
                          f.contact.max_step(f.x, f.p, 1.0)};
  auto const add = [&](auto const& field) {
    for (Point const& v : to_points(field)) all.insert(all.end(), v.begin(), v.end());
  };
  all.push_back(f.contact.add_gradient_after(f.x, f.p, 1e-3, 0.5, f.unknowns.fixed, f.g, f.blocks));
  f.contact.add_gradient(f.x, 0.5, f.unknowns.fixed, f.g, f.diagonal);
  add(f.g);
  add(f.diagonal);
  add(f.blocks);
  f.contact.add_product(f.x, f.p, 0.5, f.unknowns.fixed, f.g);
  add(f.g);
  return all;
}

}  // namespace

TEST_CASE("the contact term is a term, chosen at compile time or at run time", "[contact]") {
  STATIC_REQUIRE(SweptTerm<Contact<>>);
  STATIC_REQUIRE(SweptTerm<ContactIn<Fp32, Left>>);
  Fixture<Mixed> f;
  AnySteppedTerms<> terms;
  terms.add(f.contact);
  CHECK(terms.value(f.x, 2.0) == f.contact.value(f.x, 2.0));
}

TEMPLATE_TEST_CASE("contact is the sum over all pairs", "[contact]", Fp64, Mixed, Fp32) {
  // Relative to the largest entry; what fp32 loses in the differences of positions, times the
  // steepness of the barrier.
  double const tolerance = std::is_same_v<typename TestType::real, double> ? 1e-11 : 2e-4;
  Fixture<TestType> f;
  Oracle const oracle = f.oracle();
  REQUIRE(oracle.contacts > 100);
  double const scale = 0.25;
  CHECK_THAT(f.contact.value(f.x, scale), WithinRel(scale * oracle.energy, tolerance));
  CHECK_THAT(f.contact.quadratic_form(f.x, f.p, scale),
             WithinRel(scale * oracle.form(to_points(f.p)), tolerance));
  std::vector<Point> expected = oracle.gradient;
  for (Point& v : expected)
    for (double& c : v) c *= scale;
  auto const near_oracle = [&] {
    return furthest(to_points(f.g), expected) <= tolerance * largest(expected);
  };
  f.contact.add_gradient(f.x, scale, f.unknowns.fixed, f.g);
  CHECK(near_oracle());
  f.clear();
  f.contact.add_gradient(f.x, scale, f.unknowns.fixed, f.g, f.blocks);
  CHECK(near_oracle());
  f.clear();
  f.contact.add_gradient_after(f.x, f.p, 1e-4, scale, f.unknowns.fixed, f.g, f.diagonal);
  CHECK(near_oracle());

  CHECK(curvature_error(f.diagonal, 3, oracle.hessian, scale) <= tolerance);
  f.contact.add_gradient(f.x, scale, f.unknowns.fixed, f.g, f.blocks);
  CHECK(curvature_error(f.blocks, 6, oracle.hessian, scale) <= tolerance);

  ContactReport const report = f.contact.report(f.x);
  if (std::is_same_v<typename TestType::real, double>) CHECK(report.contacts == oracle.contacts);
  CHECK(report.candidates > report.contacts);
  CHECK_THAT(report.smallest_gap, WithinRel(oracle.smallest_gap, tolerance));
}

TEST_CASE("contact marks the free vertices of what acts", "[contact]") {
  Fixture<Fp64> f;
  Oracle const oracle = f.oracle();
  Array<int, DefaultSpace> const marks("marks", oracle.acting.size());
  f.contact.mark_acting(f.x, f.unknowns.fixed, marks);
  bool same = true;
  int marked = 0;
  for (std::size_t v = 0; v < oracle.acting.size(); ++v) {
    same = same && marks(v) == (f.unknowns.fixed(v) ? 0 : oracle.acting[v]);
    marked += marks(v);
  }
  CHECK(same);
  CHECK(marked > 10);
  CHECK(marked < int(oracle.acting.size()));
}

TEST_CASE("energy, gradient, curvature and matrix belong together", "[contact]") {
  Fixture<Fp64> f;
  double const scale = 0.25, step = 1e-6;
  f.contact.add_gradient(f.x, scale, f.unknowns.fixed, f.g);
  double const slope = product_of(to_points(f.g), f.scene.p);
  auto const energy = [&](double by) {
    move(f.x, f.scene.x, f.scene.p, by);
    return f.contact.value(f.x, scale);
  };
  CHECK_THAT((energy(step) - energy(-step)) / (2 * step), WithinRel(slope, 1e-6));
  double const here = energy(0);

  for (double alpha : {1e-9, 1e-3, -1e-3}) {
    double const change = f.contact.change(f.x, f.p, alpha, scale);
    CHECK_THAT(change, WithinRel(energy(alpha) - here, alpha == 1e-9 ? 1e-3 : 1e-9));
    f.clear();
    CHECK_THAT(f.contact.add_gradient_after(f.x, f.p, alpha, scale, f.unknowns.fixed, f.g),
               WithinRel(change, 1e-9));
    energy(0);
  }
  CHECK_THAT(f.contact.change(f.x, f.p, 1e-13, scale), WithinRel(1e-13 * slope, 1e-7));

  f.clear();
  f.contact.add_product(f.x, f.p, scale, f.unknowns.fixed, f.g);
  double const form = f.contact.quadratic_form(f.x, f.p, scale);
  CHECK(form > 0);
  CHECK_THAT(product_of(to_points(f.g), f.scene.p), WithinRel(form, 1e-12));
  Potential potential(f.unknowns, f.contact);
  potential.begin_step(f.x, scale, 0.5, false);
  auto const matrix = potential.pattern(f.x);
  potential.assemble(f.x, matrix);
  CHECK(asymmetry(matrix) < 1e-12 * form);
  typename Fixture<Fp64>::Term::Vectors hp("hp", f.scene.size());
  product(matrix, f.p, hp);
  CHECK(furthest(to_points(hp), to_points(f.g)) < 1e-11 * largest(to_points(hp)));
}

TEST_CASE("a matrix made for other candidates is refused before it is written to", "[contact]") {
  Fixture<Fp64> f;
  std::vector<Point> apart = f.scene.x;
  for (std::size_t v = 0; v < apart.size(); ++v) {
    if (f.scene.surface.object[v] == 1) apart[v][1] += 1;
  }
  Potential potential(f.unknowns, f.contact);
  auto const at_apart = soups::to_field<double, DefaultSpace>(apart);
  potential.begin_step(at_apart, 1, 1, false);
  auto const version = potential.pattern_version(at_apart);
  auto const old = potential.pattern(at_apart);
  CHECK(potential.pattern_version(at_apart) == version);
  CHECK_THROWS_WITH(f.contact.add_to(old, f.x, 1, f.unknowns.fixed),
                    ContainsSubstring("make the pattern anew"));
  auto const blocks = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), old.block);
  bool written = false;
  for (std::size_t k = 0; k < blocks.extent(0); ++k)
    for (double a : blocks(k).a) written = written || a != 0;
  CHECK_FALSE(written);
  CHECK(potential.pattern_version(f.x) != version);
  auto const anew = potential.pattern(f.x);
  CHECK_NOTHROW(f.contact.add_to(anew, f.x, 1, f.unknowns.fixed));
}

TEST_CASE("a matrix holds for what comes to act before there is another search", "[contact]") {
  Fixture<Fp64> f;
  auto const at = [&](double up) {
    std::vector<Point> x = f.scene.rest;
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (f.scene.surface.object[v] == 1) x[v][1] += up;
    }
    return soups::to_field<double, DefaultSpace>(x);
  };
  // Where the cubes are just out of reach of each other.
  double acts = 0, free = 1;
  while (free - acts > 1e-3 * Squashed::dhat) {
    double const middle = 0.5 * (acts + free);
    (f.contact.report(at(middle)).contacts > 0 ? acts : free) = middle;
  }
  Potential potential(f.unknowns, f.contact);
  auto const apart = at(free + 0.005 * Squashed::dhat), close = at(acts - 0.01 * Squashed::dhat);
  potential.begin_step(apart, 1, 1, false);
  auto const version = potential.pattern_version(apart);
  auto const matrix = potential.pattern(apart);
  CHECK(f.contact.report(apart).contacts == 0);
  REQUIRE(f.contact.report(close).contacts > 0);
  REQUIRE(potential.pattern_version(close) == version);
  CHECK_NOTHROW(potential.assemble(close, matrix));
}

TEMPLATE_TEST_CASE("contact exerts no force and no moment in all", "[contact]", Fp64, Mixed) {
  double const tolerance = std::is_same_v<typename TestType::real, double> ? 1e-12 : 1e-4;
  Fixture<TestType> f;
  f.contact.add_gradient(f.x, 1, f.unknowns.fixed, f.g);
  Vec3<double> force{}, moment{};
  auto const g = to_points(f.g);
  for (std::size_t v = 0; v < g.size(); ++v) {
    Vec3<double> const gv{g[v][0], g[v][1], g[v][2]};
    force = force + gv;
    moment = moment + cross(Vec3<double>{f.scene.x[v][0], f.scene.x[v][1], f.scene.x[v][2]}, gv);
  }
  REQUIRE(largest(g) > 1);
  CHECK(norm(force) < tolerance * largest(g));
  CHECK(norm(moment) < tolerance * largest(g));
}

TEMPLATE_TEST_CASE("contact is bitwise the same on any number of threads and in both layouts",
                   "[contact]", Fp64, Mixed, Fp32) {
  auto const results =
      test::on_one_thread_and_all([] { return everything<TestType, DefaultSpace>(); });
  CHECK(results[0] == results[1]);
  // Neither does what a precision changes: once each is enough to compile.
  if constexpr (std::is_same_v<TestType, Fp64>) {
    CHECK(results[0] == everything<TestType, DefaultSpace, SpatialHash<DefaultSpace>>());
  }
  if constexpr (std::is_same_v<TestType, Mixed>) {
    CHECK(results[0] == everything<TestType, Left>());
  }
}

TEST_CASE("rows of fixed vertices are left alone, and pairs of them are none", "[contact]") {
  Fixture<Fp64> f;
  auto const mask = Kokkos::create_mirror_view(f.unknowns.fixed);
  for (int v = 0; v < f.scene.size(); ++v) mask(v) = f.scene.surface.object[v] == 0;
  assign(f.unknowns.fixed, mask);
  f.contact.begin_step({f.x, 1, {}});
  assign(f.g, 7);
  assign(f.blocks, 7);
  f.contact.add_gradient(f.x, 1, f.unknowns.fixed, f.g, f.blocks);
  f.contact.add_product(f.x, f.p, 1, f.unknowns.fixed, f.g);
  auto const g = to_points(f.g);
  bool alone = true, moved = false;
  for (int v = 0; v < f.scene.size(); ++v) {
    if (mask(v)) {
      alone = alone && g[v] == Point{7, 7, 7};
    } else {
      moved = moved || g[v] != Point{7, 7, 7};
    }
  }
  CHECK(alone);
  CHECK(moved);
  assign(f.unknowns.fixed, 1);
  f.contact.begin_step({f.x, 1, {}});
  CHECK(f.contact.value(f.x, 1) == 0);
  CHECK(f.contact.max_step(f.x, f.p, 100.0) == 100.0);
}

TEST_CASE("a body at rest is not in contact with itself, however fine", "[contact]") {
  Squashed s;
  Unknowns<Fp64> const unknowns(std::vector<double>(s.x.size(), 1), 0.5);
  // dhat is longer than the edges.
  ContactIn<Fp64> const contact(unknowns, s.surface, s.rest,
                                {.dhat = 2, .stiffness = {.pressure = pressure}});
  std::vector<Point> apart = s.rest;
  for (std::size_t v = 0; v < apart.size(); ++v) {
    if (s.surface.object[v] == 1) apart[v][1] += 5;
  }
  auto const x = soups::to_field<double, DefaultSpace>(apart);
  ContactIn<Fp64>::Vectors const g("g", s.size());
  CHECK(contact.value(x, 1) == 0);
  contact.add_gradient(x, 1, unknowns.fixed, g);
  CHECK(largest(to_points(g)) == 0);
  CHECK(contact.report(x).contacts == 0);
}

TEST_CASE("where nothing can touch nothing is searched or swept", "[contact]") {
  Fixture<Mixed> f;
  std::vector<Point> apart = f.scene.rest;
  for (std::size_t v = 0; v < apart.size(); ++v) {
    if (f.scene.surface.object[v] == 1) apart[v][1] += 5;
  }
  for (int k = 0; k < 10; ++k) {
    for (Point& v : apart) v[1] -= 1;  // free fall
    auto const x = soups::to_field<double, DefaultSpace>(apart);
    CHECK(f.contact.value(x, 1) == 0);
    CHECK(f.contact.add_gradient_after(x, f.p, 1e-4, 1, f.unknowns.fixed, f.g) == 0);
  }
  CHECK(f.contact.energy_counters().searches == 1);
  CHECK(f.contact.energy_counters().skipped == 20);
  CHECK(largest(to_points(f.g)) == 0);
}

TEMPLATE_TEST_CASE("no step that is allowed crosses or uses up the gap", "[contact]", Fp64, Mixed,
                   Fp32) {
  Fixture<TestType> f;
  auto const positions = to_points(f.x);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  int cut = 0;
  for (int trial = 0; trial < 40; ++trial) {
    double const size = std::pow(10.0, 3 * any(random));
    std::vector<Point> p;
    for (int v = 0; v < f.scene.size(); ++v) {
      bool const upper = f.scene.surface.object[v] == 1;
      p.push_back({size * any(random), size * (any(random) - (upper ? 3 : 0)), size * any(random)});
    }
    auto const field = soups::to_field<typename TestType::real, DefaultSpace>(p);
    double const at_most = trial % 4 == 0 ? infinity : 2;
    double const alpha = f.contact.max_step(f.x, field, at_most);
    REQUIRE(alpha > 0);
    CHECK(alpha <= at_most);
    CHECK(std::isfinite(alpha));
    CHECK(f.contact.max_prescribed_step(f.x, field, at_most) == alpha);
    auto const limiting = f.contact.limiting_pair();
    CHECK(limiting.has_value() == (alpha < at_most));
    if (!limiting) continue;
    ++cut;
    CHECK(limiting->alpha == alpha);
    soups::Pair const pair{limiting->kind, limiting->vertices};
    move(f.x, positions, to_points(field), alpha);
    auto const after = to_points(f.x);
    CHECK(intersections(f.scene.surface, after) == 0);
    // What is left of the gap of the pair that limited is near what was to be kept.
    double const before = soups::distance(pair, positions);
    CHECK(soups::distance(pair, after) < 0.9 * before);
    bool kept = true;
    soups::all_pairs(f.scene.surface, [&](soups::Pair const& other) {
      kept = kept && soups::distance(other, after) >=
                         (0.5 - 1e-5) * std::min(soups::distance(other, positions), Squashed::dhat);
    });
    CHECK(kept);
    move(f.x, positions, p, 0);
  }
  CHECK(cut > 30);
}

TEST_CASE("a step of any length is proved in portions", "[contact]") {
  // The upper cube approaches from far away, or passes by.
  Fixture<Fp64> f;
  std::vector<Point> far = f.scene.rest;
  std::vector<Point> down(far.size(), Point{}), aside(far.size(), Point{});
  for (std::size_t v = 0; v < far.size(); ++v) {
    if (f.scene.surface.object[v] == 0) continue;
    far[v][1] += 100;
    down[v] = {0, -1, 0};
    aside[v] = {1, 0, 0};
  }
  auto const x = soups::to_field<double, DefaultSpace>(far);
  auto const p = soups::to_field<double, DefaultSpace>(down);
  double const alpha = f.contact.max_step(x, p, infinity);
  // A gap of 100 m and a little, but for what is left of dhat.
  CHECK(alpha > 99);
  CHECK(alpha < 101);
  move(f.x, far, down, alpha);
  auto const landed = f.contact.report(f.x);
  CHECK(landed.smallest_gap > 0.5);
  CHECK(landed.smallest_gap < 0.6);
  CHECK(f.contact.max_step(x, p, 10.0) == 10.0);
  CHECK_FALSE(f.contact.limiting_pair().has_value());
  double const free = f.contact.max_step(x, soups::to_field<double, DefaultSpace>(aside), infinity);
  CHECK(free > 1000);
  CHECK(f.contact.max_step(x, soups::to_field<double, DefaultSpace>(aside), 1e6) == 1e6);
}

TEST_CASE("a step that is not finite is refused", "[contact]") {
  Fixture<Mixed> f;
  std::vector<Point> p = f.scene.p;
  p[f.scene.surface.vertices.back()][1] = std::nan("");
  CHECK_THROWS_WITH(f.contact.max_step(f.x, soups::to_field<float, DefaultSpace>(p), 1),
                    ContainsSubstring("not finite"));
}

TEST_CASE("what touches allows no step, and is named", "[contact]") {
  // A point on a triangle, and that is all.
  std::vector<Point> const rest{{-1, 0, -1}, {1, 0, -1}, {0, 0, 1},
                                {0, 1, 0},   {1, 2, 0},  {0, 2, 1}};
  Surface const surface = make_surface({{0, 2, 1}, {3, 4, 5}}, {0, 0, 0, 1, 1, 1});
  Unknowns<Fp64> const unknowns(std::vector<double>(6, 1), 1);
  ContactIn<Fp64> const contact(unknowns, surface, rest, {.stiffness = {.pressure = 1}});
  std::vector<Point> x = rest, p(6, Point{});
  x[3][1] = 0;
  p[3][1] = -1;
  CHECK(contact.max_step(soups::to_field<double, DefaultSpace>(x),
                         soups::to_field<double, DefaultSpace>(p), 1) == 0);
  auto const limiting = contact.limiting_pair();
  REQUIRE(limiting.has_value());
  CHECK(limiting->alpha == 0);
  CHECK(limiting->kind == PairKind::point_triangle);
  CHECK(limiting->vertices[0] == 3);
}

TEST_CASE("stiffness may follow what the vertices resist with", "[contact]") {
  Squashed s;
  Unknowns<Fp64> const unknowns(std::vector<double>(s.x.size(), 1), 0.5);
  ContactIn<Fp64, DefaultSpace, Bvh<>, ElasticInclusiveStiffness> contact(
      unknowns, s.surface, s.rest, {.dhat = Squashed::dhat});
  auto const x = soups::to_field<double, DefaultSpace>(s.x);
  CHECK_THROWS_WITH(contact.value(x, 1), ContainsSubstring("call begin_step"));
  Array<double, DefaultSpace> const field("stiffness", s.size());
  assign(field, 100);
  contact.begin_step({x, 1, field});
  double const one = contact.value(x, 1);
  CHECK(one > 0);
  assign(field, 300);  // copied: nothing changes within the step
  CHECK(contact.value(x, 1) == one);
  contact.begin_step({x, 1, field});
  CHECK_THAT(contact.value(x, 1), WithinRel(3 * one, 1e-12));
  // A fixed vertex is no measure.
  auto const mask = Kokkos::create_mirror_view(unknowns.fixed);
  auto const host = Kokkos::create_mirror_view(field);
  for (int v = 0; v < s.size(); ++v) {
    mask(v) = s.surface.object[v] == 0;
    host(v) = mask(v) ? 1e9 : 100;
  }
  assign(unknowns.fixed, mask);
  assign(field, host);
  contact.begin_step({x, 1, field});
  double const free = contact.value(x, 1);
  CHECK(free > 0);
  CHECK(free <= one * (1 + 1e-12));
  CHECK_THROWS_WITH(contact.begin_step({x, 1, Array<double, DefaultSpace>("short", 3)}),
                    ContainsSubstring("3 vertices"));
}

TEST_CASE("contact says what it cannot be made of", "[contact]") {
  Squashed s;
  Unknowns<Fp64> const unknowns(std::vector<double>(s.x.size(), 1), 0.5);
  using Term = ContactIn<Fp64>;
  Term::Params const good{.stiffness = {.pressure = 1}};
  auto const make = [&](Term::Params const& params) { Term(unknowns, s.surface, s.rest, params); };
  CHECK_NOTHROW(make(good));
  // A share of the edges of the body with the shorter ones.
  double sum[2] = {}, shortest = 1e300;
  int count[2] = {};
  for (Edge const& e : s.surface.edges) {
    Point const &a = s.rest[e[0]], &b = s.rest[e[1]];
    sum[s.surface.object[e[0]]] += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    ++count[s.surface.object[e[0]]];
  }
  for (int body : {0, 1}) shortest = std::min(shortest, sum[body] / count[body]);
  CHECK_THAT(Term(unknowns, s.surface, s.rest, good).dhat(), WithinRel(0.3 * shortest, 1e-12));
  CHECK_THROWS_WITH(make({}), ContainsSubstring("positive stiffness"));
  Term::Params bad = good;
  bad.dhat = -1;
  CHECK_THROWS_WITH(make(bad), ContainsSubstring("activation distance of -1"));
  bad = good;
  bad.cap = 1;
  CHECK_THROWS_AS(make(bad), Error);
  bad = good;
  bad.clearance.share = 1;
  CHECK_THROWS_WITH(make(bad), ContainsSubstring("share"));
  bad = good;
  bad.mollifier_threshold = 0;
  CHECK_THROWS_WITH(make(bad), ContainsSubstring("mollifier"));
  std::vector<Point> flat = s.rest;
  flat.pop_back();
  CHECK_THROWS_WITH(Term(unknowns, s.surface, flat, good), ContainsSubstring("as many"));
  CHECK_THROWS_AS(Term(unknowns, s.surface, std::vector<Point>(s.rest.size()), good), Error);
  CHECK_THROWS_WITH(Term(unknowns, make_surface({}, s.surface.object), s.rest, good),
                    ContainsSubstring("without edges"));
}
