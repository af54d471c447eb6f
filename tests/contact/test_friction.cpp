// The friction term: against the serial sum over all pairs, against differences, and what it
// promises of momentum, dissipation, fixed vertices and repeatability.
#include "friction_oracle.hpp"

#include <support/threads.hpp>
#include <taut/contact/friction.hpp>
#include <taut/contact/obstacle.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
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
constexpr double pressure = 1e4, time_step = 0.01, stick_speed = 0.1;
constexpr double length = stick_speed * time_step;  // e, m

template <class Precision, class S = DefaultSpace>
using TouchIn = Contact<PairEnergy<>, Bvh<S>, AdditiveCcd, GivenStiffness, Precision, S>;

template <class Field>
void fill(Field const& x, std::vector<Point> const& from, std::vector<Point> const& p, double by) {
  auto const host = Kokkos::create_mirror_view(x);
  for (std::size_t v = 0; v < from.size(); ++v)
    for (int c = 0; c < 3; ++c) {
      host(v, c) = static_cast<typename Field::non_const_value_type>(from[v][c] + by * p[v][c]);
    }
  assign(x, host);
}

/// The squashed cubes, each vertex moved by up to `slip` e since the step began.
template <class Precision, class S = DefaultSpace>
struct Fixture {
  using Term = Friction<Precision, S>;
  using Real = typename Precision::real;
  Squashed scene;
  Unknowns<Precision, S> unknowns;
  TouchIn<Precision, S> contact;
  Term friction;
  typename Term::Positions from, x;
  typename Term::Vectors p, g, diagonal;
  typename Term::Blocks blocks;

  explicit Fixture(double slip, FrictionCoefficients const& mu = 0.4)
      : unknowns(std::vector<double>(scene.x.size(), 1), 0.5),
        contact(unknowns, scene.surface, scene.rest,
                {.dhat = Squashed::dhat, .stiffness = {.pressure = pressure}}),
        friction(unknowns, scene.rest, {.stick_speed = stick_speed}),
        from(soups::to_field<typename Precision::position, S>(scene.x)),
        x("x", scene.size()),
        p("p", scene.size()),
        g("g", scene.size()),
        diagonal("diagonal", scene.size()),
        blocks("blocks", scene.size()) {
    friction.add(contact, mu);
    friction.begin_step({from, time_step, {}});
    std::mt19937 random(11);
    std::uniform_real_distribution<double> any(-1, 1);
    std::vector<Point> moved, direction;
    for (int v = 0; v < scene.size(); ++v) {
      moved.push_back({any(random), any(random), any(random)});
      direction.push_back({any(random), any(random), any(random)});
    }
    fill(x, to_points(from), moved, slip * length);
    fill(p, direction, direction, 0);
  }
  void clear() {
    assign(g, 0);
    assign(diagonal, 0);
    assign(blocks, 0);
  }
  template <class Mu>
  FrictionOracle oracle(Mu const& mu) const {
    return {scene.surface,  scene.rest, to_points(from), to_points(from), to_points(x),
            Squashed::dhat, 0.5,        pressure,        length,          mu};
  }
  FrictionOracle oracle() const {
    return oracle([](int, int) { return 0.4; });
  }
};

double largest(std::vector<Point> const& v) {
  double r = 0;
  for (Point const& p : v)
    for (double c : p) r = std::max(r, std::abs(c));
  return r;
}
double furthest(std::vector<Point> const& a, std::vector<Point> const& b, double scale = 1) {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) r = std::max(r, std::abs(a[i][c] - scale * b[i][c]));
  return r;
}
double product_of(std::vector<Point> const& a, std::vector<Point> const& b) {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) r += a[i][c] * b[i][c];
  return r;
}

/// All that the term computes, bit by bit.
template <class Precision, class S>
std::vector<double> everything() {
  Fixture<Precision, S> f(2.0);
  std::vector<double> all{f.friction.value(f.x, 0.5), f.friction.change(f.x, f.p, 1e-3, 0.5),
                          f.friction.quadratic_form(f.x, f.p, 0.5), f.friction.report(f.x).work};
  auto const add = [&](auto const& field) {
    for (Point const& v : to_points(field)) all.insert(all.end(), v.begin(), v.end());
  };
  all.push_back(
      f.friction.add_gradient_after(f.x, f.p, 1e-3, 0.5, f.unknowns.fixed, f.g, f.blocks));
  f.friction.add_gradient(f.x, 0.5, f.unknowns.fixed, f.g, f.diagonal);
  f.friction.add_product(f.x, f.p, 0.5, f.unknowns.fixed, f.g);
  add(f.g);
  add(f.diagonal);
  add(f.blocks);
  return all;
}

/// Points against obstacles that move: who knows such contacts writes a kernel like this.
struct MovingPlates {
  static constexpr double force = 20;  ///< N, on each
  struct Kernel {
    double coefficient;
    KOKKOS_FUNCTION bool operator()(int i, LaggedContact<double>& to) const {
      if (i % 2 == 1) return false;  // does not touch
      to.vertex[0] = i;
      to.c[0] = 1;
      to.normal = {0, 1, 0};
      to.limit = coefficient * force;
      to.motion = {0.01 * i, 7, 0};  // what is normal does not matter
      return coefficient > 0;
    }
  };
  int vertices;
  void lag(VectorField<double, DefaultSpace> const&,
           kernels::FrictionMatrix<DefaultSpace> const& mu,
           LaggedContacts<Fp64, DefaultSpace>& to) const {
    to.append("moving_plates", vertices, Kernel{mu(-1, -1)});
  }
};

}  // namespace

TEST_CASE("friction is a term that is told of steps", "[friction]") {
  STATIC_REQUIRE(SweptTerm<Friction<>>);
  STATIC_REQUIRE(SteppedTerm<Friction<>>);
  STATIC_REQUIRE(ChangingTerm<Friction<Fp32, Left>>);
  STATIC_REQUIRE(FrictionSource<Contact<>, Mixed, DefaultSpace>);
  STATIC_REQUIRE(FrictionSource<MovingPlates, Fp64, DefaultSpace>);
  STATIC_REQUIRE(!FrictionSource<Squashed, Mixed, DefaultSpace>);
}

TEMPLATE_TEST_CASE("friction is the sum over all pairs", "[friction]", Fp64, Mixed, Fp32) {
  bool const exact = std::is_same_v<typename TestType::real, double>;
  // What fp32 makes of the steep barrier at the lag point; and where positions are fp32, of slips.
  double const tolerance = exact ? 1e-10 : std::is_same_v<TestType, Fp32> ? 3e-3 : 3e-4;
  double const slip = GENERATE(0.0, 0.2, 1.5, 30.0), scale = 0.25;
  CAPTURE(slip);
  Fixture<TestType> f(slip);
  FrictionOracle const oracle = f.oracle();
  REQUIRE(oracle.contacts > 100);
  if (slip == 1.5) {
    REQUIRE(oracle.sliding > 30);
    REQUIRE(oracle.sliding < oracle.contacts - 30);
  }
  auto const near_energy = [&](double value, double expected) {
    return std::abs(value - expected) <= tolerance * std::abs(expected);
  };
  CHECK(near_energy(f.friction.value(f.x, scale), scale * oracle.energy));
  FrictionReport const report = f.friction.report(f.x);
  if (exact) {
    CHECK(report.contacts == oracle.contacts);
    CHECK(report.sliding == oracle.sliding);
  }
  CHECK(near_energy(report.work, oracle.work));

  auto const near_oracle = [&] {
    return furthest(to_points(f.g), oracle.gradient, scale) <=
           tolerance * scale * std::max(largest(oracle.gradient), 1e-3 * report.limit);
  };
  f.friction.add_gradient(f.x, scale, f.unknowns.fixed, f.g);
  CHECK(near_oracle());
  f.clear();
  f.friction.add_gradient(f.x, scale, f.unknowns.fixed, f.g, f.blocks);
  CHECK(near_oracle());
  f.clear();
  f.friction.add_gradient_after(f.x, f.p, 1e-4, scale, f.unknowns.fixed, f.g, f.diagonal);
  CHECK(near_oracle());
  f.friction.add_gradient(f.x, scale, f.unknowns.fixed, f.g, f.blocks);

  auto const p = to_points(f.p);
  std::size_t const n = p.size();
  double form = 0;
  std::vector<Point> hp(n);
  for (std::size_t i = 0; i < 3 * n; ++i)
    for (std::size_t j = 0; j < 3 * n; ++j) {
      double const h = oracle.curvature[3 * n * i + j];
      hp[i / 3][i % 3] += h * p[j / 3][j % 3];
      form += p[i / 3][i % 3] * h * p[j / 3][j % 3];
    }
  CHECK_THAT(f.friction.quadratic_form(f.x, f.p, scale), WithinRel(scale * form, tolerance));
  CHECK(curvature_error(f.diagonal, 3, oracle.curvature, scale) <= tolerance);
  CHECK(curvature_error(f.blocks, 6, oracle.curvature, scale) <= tolerance);
  f.clear();
  f.friction.add_product(f.x, f.p, scale, f.unknowns.fixed, f.g);
  CHECK(furthest(to_points(f.g), hp, scale) <= tolerance * scale * largest(hp));
}

TEST_CASE("energy, force, curvature and matrix of friction belong together", "[friction]") {
  double const slip = GENERATE(0.0, 0.3, 1.5, 20.0), scale = 0.25;
  CAPTURE(slip);
  Fixture<Fp64> f(slip);
  auto const at = to_points(f.x), p = to_points(f.p);
  auto const energy = [&](double by) {
    fill(f.x, at, p, by);
    return f.friction.value(f.x, scale);
  };
  auto const force = [&](double by) {
    fill(f.x, at, p, by);
    f.clear();
    f.friction.add_gradient(f.x, scale, f.unknowns.fixed, f.g);
    return to_points(f.g);
  };
  double const step = 1e-5 * length;
  auto const g = force(0);
  double const slope = product_of(g, p), size = largest(force(1));
  CHECK_THAT((energy(step) - energy(-step)) / (2 * step),
             WithinRel(slope, 1e-6) || WithinAbs(0, 1e-4 * size));
  energy(0);
  f.clear();
  f.friction.add_product(f.x, f.p, scale, f.unknowns.fixed, f.g);
  auto const hp = to_points(f.g);
  double const form = f.friction.quadratic_form(f.x, f.p, scale);
  CHECK(form > 0);
  CHECK_THAT(product_of(hp, p), WithinRel(form, 1e-11));
  double const here = energy(0);
  for (double alpha : {1e-9, 1e-4, -1e-4, 1.0}) {
    CAPTURE(alpha);
    double const change = f.friction.change(f.x, f.p, alpha, scale);
    CHECK_THAT(change, WithinRel(energy(alpha) - here, alpha == 1e-9 ? 1e-3 : 1e-8) ||
                           WithinAbs(energy(alpha) - here, 1e-12 * here));
    f.clear();
    CHECK_THAT(f.friction.add_gradient_after(f.x, f.p, alpha, scale, f.unknowns.fixed, f.g),
               WithinRel(change, 1e-7));
    energy(0);
    // The quadratic model lies above the energy, however far.
    double const model = alpha * slope + square(alpha) * form / 2;
    CHECK(change <= model + 1e-12 * (std::abs(model) + here));
  }
  CHECK(f.friction.change(f.x, f.p, 0, scale) == 0);
  if (slip > 0) {
    CHECK_THAT(f.friction.change(f.x, f.p, 1e-14, scale), WithinRel(1e-14 * slope, 1e-5));
  }
  CHECK(f.friction.max_step(f.x, f.p, 3.0) == 3.0);
  CHECK(f.friction.max_prescribed_step(f.x, f.p, 3.0) == 3.0);

  Potential potential(f.unknowns, f.friction);
  potential.begin_step(f.from, scale, time_step, false);
  auto const matrix = potential.pattern(f.x);
  potential.assemble(f.x, matrix);
  CHECK(asymmetry(matrix) < 1e-12 * form);
  typename Fixture<Fp64>::Term::Vectors product_with_matrix("hp", f.scene.size());
  product(matrix, f.p, product_with_matrix);
  CHECK(furthest(to_points(product_with_matrix), hp) < 1e-11 * largest(hp));
}

TEST_CASE("a matrix made for other contacts is refused before it is written to", "[friction]") {
  Fixture<Fp64> f(0.5);
  std::vector<Connectivity> none;
  BlockCsr<DefaultSpace, double> const old(pattern_from_elements(f.scene.size(), none));
  CHECK_THROWS_WITH(f.friction.add_to(old, f.x, 1, f.unknowns.fixed),
                    ContainsSubstring("make the pattern anew"));
  auto const blocks = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), old.block);
  bool written = false;
  for (std::size_t k = 0; k < blocks.extent(0); ++k)
    for (double a : blocks(k).a) written = written || a != 0;
  CHECK_FALSE(written);
}

TEMPLATE_TEST_CASE("friction exerts no net force, opposes the slip and turns by its gap alone",
                   "[friction]", Fp64, Mixed) {
  double const tolerance = std::is_same_v<typename TestType::real, double> ? 1e-12 : 1e-4;
  Fixture<TestType> f(GENERATE(0.3, 10.0));
  FrictionOracle const oracle = f.oracle();
  f.friction.add_gradient(f.x, 1, f.unknowns.fixed, f.g);
  Vec3<double> force{}, moment{};
  auto const g = to_points(f.g), x = to_points(f.x), from = to_points(f.from);
  double work = 0, all = 0;
  for (std::size_t v = 0; v < g.size(); ++v) {
    Vec3<double> const gv{g[v][0], g[v][1], g[v][2]};
    force = force + gv;
    all += norm(gv);
    moment = moment + cross(Vec3<double>{from[v][0], from[v][1], from[v][2]}, gv);
    for (int c = 0; c < 3; ++c) work += gv[c] * (x[v][c] - from[v][c]);
  }
  REQUIRE(largest(g) > 1);
  CHECK(norm(force) < tolerance * all);
  CHECK(norm(moment - oracle.moment) < tolerance * all);
  // Against the slip of each contact, so that it takes out energy, all that report says.
  CHECK(work > 0);
  CHECK_THAT(f.friction.report(f.x).work, WithinRel(work, 1e-3 * tolerance + 1e-5));
  CHECK(f.friction.report(f.x).limit > 0);
}

TEMPLATE_TEST_CASE("friction is bitwise the same on any number of threads and in both layouts",
                   "[friction]", Fp64, Mixed) {
  auto const results =
      test::on_one_thread_and_all([] { return everything<TestType, DefaultSpace>(); });
  CHECK(results[0] == results[1]);
  CHECK(results[0] == everything<TestType, Left>());
}

TEST_CASE("rows of fixed vertices are left alone by friction", "[friction]") {
  Fixture<Fp64> f(1.0);
  auto const mask = Kokkos::create_mirror_view(f.unknowns.fixed);
  for (int v = 0; v < f.scene.size(); ++v) mask(v) = f.scene.surface.object[v] == 0;
  assign(f.unknowns.fixed, mask);
  assign(f.g, 7);
  assign(f.blocks, 7);
  f.friction.add_gradient(f.x, 1, f.unknowns.fixed, f.g, f.blocks);
  f.friction.add_product(f.x, f.p, 1, f.unknowns.fixed, f.g);
  auto const g = to_points(f.g);
  bool alone = true, moved = false;
  for (int v = 0; v < f.scene.size(); ++v) {
    (mask(v) ? alone : moved) =
        mask(v) ? alone && g[v] == Point{7, 7, 7} : moved || g[v] != Point{7, 7, 7};
  }
  CHECK(alone);
  CHECK(moved);
}

TEST_CASE("each pair of objects has its coefficient; nil ones are not even kept", "[friction]") {
  FrictionCoefficients mu(0.4);
  mu.set(0, 1, 0.1).set(1, 1, 0);
  Fixture<Fp64> f(1.5, mu);
  FrictionOracle const oracle = f.oracle([&](int a, int b) { return mu(a, b); });
  CHECK(oracle.contacts < f.oracle().contacts - 10);
  FrictionReport const report = f.friction.report(f.x);
  CHECK(report.contacts == oracle.contacts);
  CHECK_THAT(report.work, WithinRel(oracle.work, 1e-10));
  Fixture<Fp64> const none(1.5, 0.0);
  CHECK(none.friction.report(none.x).contacts == 0);
  CHECK(none.friction.value(none.x, 1) == 0);
}

TEST_CASE("any source of contacts has friction, and obstacles drag along", "[friction]") {
  int const vertices = 9;
  double const mu = 0.5;
  Unknowns<Fp64> const unknowns(std::vector<double>(vertices, 1), 1);
  std::vector<Point> rest(vertices);
  for (int v = 0; v < vertices; ++v) rest[v] = {0.3 * v, 0, 0.1};
  Friction<Fp64> const friction(unknowns, rest, {.stick_speed = stick_speed});
  MovingPlates const plates{vertices};
  auto terms = friction;
  terms.add(plates, mu);
  auto const from = soups::to_field<double, DefaultSpace>(rest);
  terms.begin_step({from, time_step, {}});
  CHECK(friction.report(from).contacts == 5);  // copies share their state
  CHECK(friction.report(from).sliding == 4);   // all but the plate that is at rest
  auto const gradient = [&](std::vector<Point> const& at) {
    Friction<Fp64>::Vectors const g("g", vertices);
    friction.add_gradient(soups::to_field<double, DefaultSpace>(at), 1, unknowns.fixed, g);
    return to_points(g);
  };
  auto at = rest;
  auto g = gradient(at);
  for (int v = 0; v < vertices; ++v) {
    bool const dragged = v > 0 && v % 2 == 0;  // the force is -g: with the plate
    CHECK_THAT(g[v][0], WithinAbs(dragged ? -mu * MovingPlates::force : 0, 1e-12));
    CHECK_THAT(g[v][1], WithinAbs(0, 1e-12));
  }
  // What goes with the plate feels nothing, what overtakes it by half of e sticks to it.
  for (int v = 0; v < vertices; ++v) at[v][0] += 0.01 * v + 0.5 * length;
  g = gradient(at);
  for (int v = 0; v < vertices; ++v) {
    CHECK_THAT(g[v][0], WithinAbs(v % 2 == 0 ? 0.75 * mu * MovingPlates::force : 0, 1e-9));
  }
}

TEST_CASE("contacts stay those of the lag point until they are lagged anew", "[friction]") {
  Fixture<Fp64> f(1.0);
  double const value = f.friction.value(f.x, 1);
  auto const version = f.friction.pattern_version(f.x);
  std::vector<Point> apart = f.scene.x;
  for (std::size_t v = 0; v < apart.size(); ++v) apart[v][1] += f.scene.surface.object[v];
  f.contact.value(soups::to_field<double, DefaultSpace>(apart), 1);
  CHECK(f.friction.value(f.x, 1) == value);
  CHECK(f.friction.pattern_version(f.x) == version);

  // At x: slip is still measured from where the step began.
  CHECK(f.friction.relag(f.x));
  CHECK(f.friction.pattern_version(f.x) > version);
  FrictionOracle const there(f.scene.surface, f.scene.rest, to_points(f.x), to_points(f.from),
                             to_points(f.x), Squashed::dhat, 0.5, pressure, length,
                             [](int, int) { return 0.4; });
  CHECK_THAT(f.friction.value(f.x, 1), WithinRel(there.energy, 1e-10));
  CHECK(std::abs(f.friction.value(f.x, 1) - value) > 1e-6 * value);

  for (std::size_t v = 0; v < apart.size(); ++v) apart[v] = f.scene.rest[v];
  for (std::size_t v = 0; v < apart.size(); ++v) apart[v][1] += 5 * f.scene.surface.object[v];
  auto const far = soups::to_field<double, DefaultSpace>(apart);
  CHECK(f.friction.relag(far));  // there were contacts
  CHECK_FALSE(f.friction.relag(far));
  CHECK(f.friction.value(f.x, 1) == 0);
}

TEST_CASE("what turns with an obstacle does not slip, wherever its contacts are taken",
          "[friction]") {
  Squashed const scene;
  double const dhat = 0.05, angle = 0.3;
  Unknowns<Fp64> const unknowns(std::vector<double>(scene.x.size(), 1), 0.5);
  double lowest = std::numeric_limits<double>::infinity();
  for (Point const& x : scene.x) lowest = std::min(lowest, x[1]);
  // A plate that turns about an axis far from the bodies, and rises.
  Vec3<double> const axis{-3, lowest - 0.5 * dhat, 1}, along{0.2, 0.1, -0.1};
  Obstacle<HalfSpace, Normalised<LogBarrier>, GivenStiffness, Fp64> const plate(
      unknowns, scene.surface, scene.rest, HalfSpace{axis},
      {.dhat = dhat, .start_share = 0, .stiffness = {.pressure = pressure}});
  Friction<Fp64> friction(unknowns, scene.rest, {.stick_speed = stick_speed});
  friction.add(plate, 0.4);
  RigidPose pose{turn_matrix({{0, 1, 0}, angle})};
  pose.translation = axis + along - pose.rotation * axis;
  plate.move_to(pose);
  auto const from = soups::to_field<double, DefaultSpace>(scene.x);
  plate.begin_step({from, time_step, {}});
  friction.begin_step({from, time_step, {}});
  CHECK(friction.report(from).sliding > 0);
  std::vector<Point> turned;
  for (Point const& x : scene.x) {
    Vec3<double> const y = pose({x[0], x[1], x[2]});
    turned.push_back({y[0], y[1], y[2]});
  }
  auto const to = soups::to_field<double, DefaultSpace>(turned);
  auto const rests = [&] {
    FrictionReport const report = friction.report(to);
    CHECK(report.contacts > 0);
    CHECK(report.sliding == 0);
    CHECK_THAT(report.work, WithinAbs(0, 1e-12 * report.limit));
  };
  rests();
  plate.advance(0.4);
  plate.advance(1);
  CHECK(friction.relag(to));
  rests();
}

TEST_CASE("friction that has no size is refused", "[friction]") {
  Squashed const scene;
  Unknowns<Fp64> const unknowns(std::vector<double>(scene.x.size(), 1), 0.5);
  using Term = Friction<Fp64>;
  CHECK_THROWS_WITH(Term(unknowns, {}), ContainsSubstring("0 positions at rest"));
  CHECK_THROWS_WITH(Term(unknowns, scene.rest, {.stick_speed = 0.0}),
                    ContainsSubstring("creep at 0 m/s"));
  CHECK_THROWS_WITH(Term(unknowns, std::vector<Point>(scene.x.size(), Point{1, 2, 3})),
                    ContainsSubstring("all in one place"));
  Term const friction(unknowns, scene.rest);
  CHECK_THROWS_WITH(friction.begin_step({soups::to_field<double, DefaultSpace>(scene.x), 0, {}}),
                    ContainsSubstring("a step of 0 s"));
  double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1}, square = 0;
  for (Point const& x : scene.rest)
    for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], x[c]), high[c] = std::max(high[c], x[c]);
  for (int c = 0; c < 3; ++c) square += (high[c] - low[c]) * (high[c] - low[c]);
  CHECK_THAT(friction.stick_speed(), WithinRel(1e-3 * std::sqrt(square), 1e-12));
}
