// The penalty that holds light nodes to the body: what it costs and what it leaves free, against
// its definition; its part in the operator and the matrices of particles; and what it is for.
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/integrators/admm.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/ghost_penalty.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/particle_splitting.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "cycle_on_kernel.hpp"
#include "particle_problem.hpp"

namespace taut {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::Field;

/// A strained block, and the penalty of its nodes, some of which are fixed.
template <class Precision, class Space>
struct Held {
  using C = test::Combination<FixedCorotated, FullProjection, QuadraticSpline, Precision, Space,
                              Space::on_host>;
  using Term = GhostPenalty<QuadraticSpline, Precision, Space>;
  using T = typename Precision::real;
  test::Problem<C> problem;
  Unknowns<Precision, Space> unknowns;
  Array<T, Space> resists;
  Term term;
  double scale = 0.01;

  explicit Held(GhostParams const& params = {.strength = 0.1, .share = 0.2, .ratio = 1})
      : unknowns(std::vector<double>(problem.scene.nodes(), 0.002), problem.dx),
        resists("resists", problem.scene.nodes()),
        term(params) {
    int const n = problem.scene.nodes();
    auto const fixed = Kokkos::create_mirror_view(unknowns.fixed);
    auto const stiff = Kokkos::create_mirror_view(resists);
    for (int i = 0; i < n; ++i) {
      fixed(i) = i % 17 == 3;
      stiff(i) = T(1 + i % 5);
    }
    assign(unknowns.fixed, fixed);
    assign(problem.fixed, fixed);
    assign(resists, stiff);
    auto const& scene = problem.scene;
    term.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
    term.hold(scene.rest, unknowns, BoundaryList<Space>(), 0.1);
    typename Term::Vectors const none("none", n);
    term.begin_step({scene.rest, 0.1, resists, none, 0.01, 0.002});
  }
  int nodes() const { return problem.scene.nodes(); }
};

/// The rows on the host.
struct Row {
  int own = -1;
  std::vector<int> node;
  std::vector<double> weight;
  double stiffness = 0;
};
template <class Space>
std::vector<Row> read_rows(GhostRows<Space> const& rows, int nodes) {
  auto const host = [](auto const& view) {
    return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  };
  auto const node = host(rows.node);
  auto const weight = host(rows.weight);
  auto const stiffness = host(rows.stiffness);
  auto const row = host(rows.row);
  std::vector<Row> list(rows.count);
  for (int r = 0; r < rows.count; ++r) {
    list[r].stiffness = stiffness(r);
    for (int k = 0; k < GhostRows<Space>::entries; ++k) {
      if (node(r, k) < 0) continue;
      list[r].node.push_back(node(r, k));
      list[r].weight.push_back(weight(r, k));
    }
  }
  for (int i = 0; i < nodes; ++i)
    if (row(i) >= 0) list[row(i)].own = i;
  return list;
}
Vec3<double> stretch(Row const& row, Field const& d) {
  Vec3<double> sum{};
  for (std::size_t k = 0; k < row.node.size(); ++k) sum = sum + row.weight[k] * d[row.node[k]];
  return sum;
}

template <class Precision, class Space>
void check_term(double eps) {
  Held<Precision, Space> const held;
  auto const& term = held.term;
  auto const& problem = held.problem;
  int const n = held.nodes();
  auto const rows = read_rows(term.rows(), n);
  Field const rest = test::read(problem.scene.rest);
  std::vector<double> volume(n, 0.0);
  for (Particle const& p : problem.list) {
    for (int i = 0; i < n; ++i) {
      double w = 1;
      for (int c = 0; c < 3; ++c) {
        double const d = std::abs(p.x[c] - rest[i][c]) / problem.dx;
        w *= d < 0.5 ? 0.75 - d * d : d < 1.5 ? 0.5 * (1.5 - d) * (1.5 - d) : 0;
      }
      volume[i] += w * p.volume;
    }
  }

  // Light are those that hold little, and what a row is made of is lighter than nothing else.
  auto const fixed = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), problem.fixed);
  std::vector<int> row_of(n, -1);
  for (std::size_t r = 0; r < rows.size(); ++r) row_of[rows[r].own] = static_cast<int>(r);
  int known = 0;
  for (int i = 0; i < n; ++i) {
    double most = 0;
    for (int j = 0; j < n; ++j) {
      bool near = true;
      for (int c = 0; c < 3; ++c) near &= std::abs(rest[i][c] - rest[j][c]) < 1.5 * problem.dx;
      if (near) most = std::max(most, volume[j]);
    }
    double const ratio = volume[i] / (0.2 * most);
    if (std::abs(ratio - 1) > 1e-4) CHECK((row_of[i] >= 0) == (ratio < 1 && fixed(i) == 0));
  }
  for (Row const& row : rows) {
    if (row.node.empty()) continue;
    ++known;
    double sum = 0;
    Vec3<double> first{};
    for (std::size_t k = 0; k < row.node.size(); ++k) {
      int const j = row.node[k];
      sum += row.weight[k];
      first = first + row.weight[k] * (rest[j] - rest[row.own]);
      if (j == row.own) CHECK(row.weight[k] == 1);
      CHECK((j == row.own || volume[j] > volume[row.own]));
      for (int c = 0; c < 3; ++c) CHECK(std::abs(rest[j][c] - rest[row.own][c]) < 2.5 * problem.dx);
    }
    // Linear functions are extrapolated as they are.
    CHECK_THAT(sum, WithinAbs(0, 1e-12));
    CHECK_THAT(norm(first), WithinAbs(0, 1e-12));
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < row.node.size(); ++k) {
      int const j = row.node[k];
      if (j == row.own || fixed(j) != 0 || row.weight[k] == 0) continue;
      double const resists = 1 + j % 5 - 0.002 / (0.1 * 0.1);
      least = std::min(least, resists / (row.weight[k] * row.weight[k]));
    }
    CHECK_THAT(row.stiffness, WithinRel(0.1 * least, 1e-6));
  }
  REQUIRE(known > 50);
  REQUIRE(known == term.light_nodes());

  // Energy, slope and curvature by their definitions.
  double const scale = held.scale;
  Field d(n), g(n), hp(n);
  std::vector<double> diagonal(n, 0.0);
  for (int i = 0; i < n; ++i) d[i] = problem.x_host[i] - rest[i];
  double value = 0, form = 0, slope = 0;
  for (Row const& row : rows) {
    Vec3<double> const s = stretch(row, d), t = stretch(row, problem.p_host);
    double const k = scale * row.stiffness;
    value += 0.5 * k * dot(s, s);
    slope += k * dot(s, t);
    form += k * dot(t, t);
    for (std::size_t m = 0; m < row.node.size(); ++m) {
      int const j = row.node[m];
      if (fixed(j) != 0) continue;
      g[j] = g[j] + k * row.weight[m] * s;
      hp[j] = hp[j] + k * row.weight[m] * t;
      diagonal[j] += k * row.weight[m] * row.weight[m];
    }
  }
  auto const& x = problem.x;
  auto const& p = problem.p;
  REQUIRE(value > 0);
  CHECK_THAT(term.value(x, scale), WithinRel(value, eps));
  CHECK_THAT(term.quadratic_form(x, p, scale), WithinRel(form, eps));
  CHECK_THAT(term.change(x, p, 0.3, scale), WithinRel(0.3 * slope + 0.045 * form, 10 * eps));
  using Vectors = typename GhostPenalty<QuadraticSpline, Precision, Space>::Vectors;
  Vectors const g1("g", n), g2("g", n), d2("d", n), g3("g", n), y("y", n);
  typename GhostPenalty<QuadraticSpline, Precision, Space>::Blocks const b3("b", n);
  term.add_gradient(x, scale, problem.fixed, g1);
  CHECK_THAT(term.add_gradient_after(x, p, 0.3, scale, problem.fixed, g2, d2),
             WithinRel(0.3 * slope - 0.045 * form, 10 * eps));
  term.add_gradient(x, scale, problem.fixed, g3, b3);
  term.add_product(x, p, scale, problem.fixed, y);
  CHECK(test::difference(test::read(g1), g) < eps * test::largest(g));
  CHECK(test::difference(test::read(g2), g) < eps * test::largest(g));
  CHECK(test::difference(test::read(g3), g) < eps * test::largest(g));
  CHECK(test::difference(test::read(y), hp) < eps * test::largest(hp));
  Field const found = test::read(d2);
  auto const blocks = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), b3);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      CHECK_THAT(found[i][c], WithinRel(diagonal[i], eps) || WithinAbs(0, 1e-300));
      CHECK(double(blocks(i, c)) == found[i][c]);
      CHECK(blocks(i, 3 + c) == 0);
    }
}

TEST_CASE("a ghost penalty is what it is said to be", "[mpm][ghost]") {
  check_term<Fp64, test::RightOf<DefaultSpace>>(1e-11);
}
TEST_CASE("the same in float and in a device's layout", "[mpm][ghost]") {
  check_term<Mixed, test::LeftOf<DefaultSpace>>(1e-5);
}

TEST_CASE("nothing is held where waves cross few cells, nor of a grid that is gone",
          "[mpm][ghost]") {
  using S = test::RightOf<DefaultSpace>;
  Held<Fp64, S> held;
  auto& term = held.term;
  auto const& x = held.problem.x;
  int const light = term.light_nodes();
  CHECK(light > 50);
  CHECK(term.value(x, 1) > 0);
  auto const version = term.pattern_version(x);
  // Inertia alone, 0.2 N/m, and of nodes 11 and on a little more than that.
  auto const start = [&](double k) {
    int const n = held.nodes();
    for (int i = 0; i < n; ++i) held.resists(i) = i < 11 ? 0.2 : k;
    term.begin_step({held.problem.scene.rest, 0.1, held.resists,
                     GhostPenalty<QuadraticSpline, Fp64, S>::Vectors("none", n), 0.01, 0.002});
  };
  start(0.39);  // h^2 k / m is below 1
  CHECK(term.light_nodes() == 0);
  CHECK(term.value(x, 1) == 0);
  CHECK(term.pattern_version(x) != version);
  start(0.41);
  CHECK(term.light_nodes() > 0);
  CHECK(term.light_nodes() <= light);
  auto const& scene = held.problem.scene;
  term.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
  CHECK(term.light_nodes() == 0);
  CHECK(term.value(x, 1) == 0);
}

TEST_CASE("affine motions cost nothing, and no motion turns or pushes the body", "[mpm][ghost]") {
  using S = test::RightOf<DefaultSpace>;
  Held<Fp64, S> held;
  assign(held.problem.fixed, std::uint8_t(0));
  int const n = held.nodes();
  auto const& term = held.term;
  Field const rest = test::read(held.problem.scene.rest);
  Field affine(n);
  Mat3<double> const A{{1.3, 0.2, -0.4, 0.1, 0.7, 0.3, 0.5, -0.6, 1.1}};
  for (int i = 0; i < n; ++i) affine[i] = A * rest[i] + Vec3<double>{3, -2, 1};
  using Term = GhostPenalty<QuadraticSpline, Fp64, S>;
  double const some = term.value(held.problem.x, 1);
  CHECK(term.value(test::field_of<Term::Positions>(affine), 1) < 1e-18 * some * n * n);

  Term::Vectors const g("g", n);
  term.add_gradient(held.problem.x, 1, held.problem.fixed, g);
  Field const force = test::read(g);
  Vec3<double> push{}, torque{};
  double forces = 0, torques = 0;
  for (int i = 0; i < n; ++i) {
    push = push + force[i];
    torque = torque + cross(held.problem.x_host[i], force[i]);
    forces += norm(force[i]);
    torques += norm(cross(held.problem.x_host[i], force[i]));
  }
  REQUIRE(forces > 0);
  CHECK(norm(push) < 1e-13 * forces);
  CHECK(norm(torque) < 1e-13 * torques);
}

TEST_CASE("what holds light nodes is part of the operator and of all its matrices",
          "[mpm][ghost]") {
  using S = test::RightOf<DefaultSpace>;
  using Problem = Held<Fp64, S>;
  Problem const held;
  auto const& problem = held.problem;
  int const n = held.nodes();
  using Operator = ParticleOperator<QuadraticSpline, double, S>;
  using Vectors = Operator::Vectors;
  Operator to, without;
  BlockField<double, S> const local("local", n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) local(i, k) = 2;
  for (Operator* o : {&to, &without}) {
    problem.term.linearise(problem.x, held.scale, *o);
    o->set_local(local, problem.fixed);
  }
  held.term.linearise(problem.x, held.scale, to);

  // Products: those of the particles and the term's own.
  Vectors const p("p", n), expected("y", n), found("y", n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) p(i, c) = problem.fixed(i) ? 0 : problem.p(i, c);
  without.product(p, expected);
  Field const plain = test::read(expected);
  held.term.add_product(problem.x, p, held.scale, problem.fixed, expected);
  REQUIRE(test::difference(test::read(expected), plain) > 1e-5 * test::largest(plain));
  to.product(p, found);
  CHECK(test::difference(test::read(found), test::read(expected)) < 1e-13 * test::largest(plain));

  // The matrix, its diagonal, rows of it, and the one that Newton assembles.
  MatrixLevel<S, double, 2> level;
  level.resize(to.nodes(), to.fixed());
  to.matrix(level.matrix());
  level.finish();
  Vectors const by_matrix("y", n);
  level.product(p, by_matrix);
  CHECK(test::difference(test::read(by_matrix), test::read(expected)) <
        1e-13 * test::largest(plain));
  BlockField<double, S> const diagonal("diagonal", n);
  to.diagonal(diagonal);
  GridMatrix<S, double, 2> some;
  some.resize(to.nodes());
  set_zero(some);
  Kokkos::View<int*, S::memory> const row_of("row_of", n);
  for (int i = 0; i < n; ++i) row_of(i) = i % 3 == 0 ? i / 3 : -1;
  to.add_rows(some, row_of);
  double largest = 0, wrong = 0;
  for (int i = 0; i < n; ++i) {
    auto const own = symmetric_part(level.matrix().block(i, 0, 0, 0));
    for (int k = 0; k < 6; ++k) {
      largest = std::max(largest, std::abs(own.s[k]));
      wrong = std::max(wrong, std::abs(own.s[k] - diagonal(i, k)));
    }
    for (int e = 0; i % 3 == 0 && e < StencilRow<2>::numbers; ++e) {
      wrong = std::max(wrong, std::abs(some.entry(i / 3, e) - level.matrix().entry(i, e)));
    }
  }
  CHECK(wrong < 1e-13 * largest);
  std::vector<Connectivity> kinds;
  problem.term.elements(kinds);
  held.term.elements(kinds);
  BlockCsr<S, double> sparse(pattern_from_elements(n, kinds)), only(sparse);
  held.term.add_to(only, problem.x, held.scale, problem.fixed);
  Vectors const y1("y", n), y2("y", n);
  product(only, p, y1);
  held.term.add_product(problem.x, p, held.scale, problem.fixed, y2);
  CHECK(test::difference(test::read(y1), test::read(y2)) < 1e-13 * test::largest(test::read(y2)));

  // The coarse matrix, against P'AP of the fine one.
  auto const check_coarse = [&]<class Embedding, int R>(Embedding, GridMatrix<S, double, R>) {
    GridLevel<S> grid;
    LeafList all;
    auto const& nodes = to.nodes();
    for (int leaf = 0; leaf < nodes.leaves.count; ++leaf) {
      auto const& origin = nodes.leaves.origin;
      all.origin.push_back({origin(leaf, 0), origin(leaf, 1), origin(leaf, 2)});
      LeafMask& mask = all.mask.emplace_back();
      for (int x = 0; x < 8; ++x) mask[x] = nodes.mask(leaf, x);
    }
    grid.coarsen(all, Embedding::radius, nodes.dx);
    GridMatrix<S, double, R> at_once, by_galerkin;
    at_once.resize(grid.nodes());
    by_galerkin.resize(grid.nodes());
    to.template coarse_matrix<Embedding>(at_once);
    level.template coarse_matrix<Embedding>(by_galerkin);
    double most = 0, off = 0;
    for (int i = 0; i < at_once.size(); ++i)
      for (int e = 0; e < StencilRow<R>::numbers; ++e) {
        most = std::max(most, std::abs(by_galerkin.entry(i, e)));
        off = std::max(off, std::abs(by_galerkin.entry(i, e) - at_once.entry(i, e)));
      }
    REQUIRE(at_once.size() > 20);
    CHECK(off < 1e-13 * most);
  };
  check_coarse(LinearEmbedding(), GridMatrix<S, double, 2>());
}

/// Iterations of some steps of a ball of this stiffness that falls onto the ground, and how far
/// its particles are then.
struct Fall {
  int iterations = 0, light = 0, halvings = 0;
  double time = 0;  ///< s
  std::vector<Particle> start, particles;

  double apart(Fall const& other) const {
    REQUIRE(particles.size() == other.particles.size());
    double most = 0;
    for (std::size_t p = 0; p < particles.size(); ++p) {
      most = std::max(most, norm(particles[p].x - other.particles[p].x));
    }
    return most;
  }
};
template <Spline K, class Minimiser>
Fall fall(double young, double strength, typename Minimiser::Params const& params, int steps = 3,
          double spin = 0) {
  using P = Fp64;
  using S = DefaultSpace;
  using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>, K, P>;
  constexpr double dx = 0.05, h = 0.01;
  std::vector<Particle> list;
  for (Particle p : test::jittered_block(8, 2, dx, {-4, 0, -4})) {
    Vec3<double> const at{p.x[0], p.x[1] - 0.2, p.x[2]};
    if (norm(at) > 0.2) continue;
    p.F = identity3<double>();
    p.C = {};
    p.v = {0.4, -1, 0};
    if (spin != 0) {  // off the ground, faster than it may go
      p.x[1] += 0.2;
      p.v = p.v + spin * Vec3<double>{at[1], -at[0], 0};
      p.C(0, 1) = spin;
      p.C(1, 0) = -spin;
    }
    p.stiffness = 1;
    p.material = 0;
    list.push_back(p);
  }
  Particles<P, S> const particles(list);
  ParticleGrid<K, P> grid(dx);
  GhostPenalty<K, P> const ghosts({.strength = strength});
  Potential scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                  BodyForce<P>(grid.unknowns(), {0, -9.81, 0}),
                  Solid({lame_parameters(young, 0.3)}), ghosts);
  ParticleStepper<ImplicitEuler<Minimiser>, K> stepper(ImplicitEuler<Minimiser>(params),
                                                       {.crossing = 0.5});
  BoundaryList<S> floor({{.name = "floor"}});
  Fall end;
  end.start = list;
  double const whole = steps * h;
  while (end.time < 0.999 * whole) {
    auto const report =
        stepper.step(scene, grid, particles, std::min(h, whole - end.time), floor, end.time);
    CHECK(report.minimiser.converged());
    end.time += report.time_step;
    end.halvings += report.halvings;
    end.iterations += report.minimiser.iterations;
    end.light = std::max(end.light, scene.template term<GhostPenalty<K, P>>().light_nodes());
  }
  end.particles = particles.read();
  return end;
}
template <Spline K = QuadraticSpline>
Fall fall(double young, double strength, int steps = 3, double spin = 0) {
  return fall<K, typename test::CycleOnKernel<K>::Minimiser>(
      young, strength, {.lbfgs = {.newton_step = false}, .stop = {.tolerance = 1e-5}}, steps, spin);
}

TEST_CASE("with light nodes held, a stiff body takes a few times the iterations of a soft one",
          "[mpm][ghost]") {
  Fall const soft = fall(1e5, 0.01), stiff = fall(1e9, 0.01), free = fall(1e9, 0);
  CAPTURE(soft.iterations, stiff.iterations, free.iterations, stiff.light);
  CHECK(stiff.light > 50);
  CHECK(free.light == 0);
  // 10,000 times as stiff: 54 and 21; 220 where light nodes are free.
  CHECK(stiff.iterations < 3 * soft.iterations);
  CHECK(3 * stiff.iterations < free.iterations);
  // What the body does is the same.
  double moved = 0;
  for (Particle const& p : stiff.particles) {
    moved = std::max(moved, norm(p.v - Vec3<double>{0.4, -1, 0}));
  }
  CHECK(moved > 0.5);
  CHECK(stiff.apart(free) < 1e-3);
  CHECK(stiff.halvings == 0);
}

TEST_CASE("light nodes are held with wider kernels, by ADMM and in steps that are halved",
          "[mpm][ghost]") {
  Fall const cubic = fall<CubicSpline>(1e9, 0.01, 1), free = fall<CubicSpline>(1e9, 0, 1);
  CAPTURE(cubic.iterations, free.iterations, cubic.light);
  CHECK(cubic.light > 50);
  CHECK(2 * cubic.iterations < free.iterations);
  CHECK(cubic.apart(free) < 1e-3);

  using Admm_ = Admm<ParticleSplitting<Fp64>, DecrementWindow, Fp64>;
  Fall const split = fall<QuadraticSpline, Admm_>(3e6, 0.01, {.stop = {.tolerance = 1e-4}}, 1),
             whole = fall(3e6, 0.01, 1);
  CAPTURE(split.iterations, split.light);
  CHECK(split.light > 50);
  CHECK(split.apart(whole) < 1e-3 * 0.05);

  Fall const halved = fall(1e9, 0.01, 1, 20);
  CAPTURE(halved.iterations);
  CHECK(halved.halvings > 0);
  CHECK(halved.light > 50);
  CHECK(halved.iterations < 400);
  Vec3<double> gained{};
  double mass = 0;
  for (std::size_t p = 0; p < halved.particles.size(); ++p) {
    Particle const &before = halved.start[p], &after = halved.particles[p];
    gained = gained + before.mass * (after.v - before.v);
    mass += before.mass;
  }
  CHECK(norm((1 / mass) * gained - Vec3<double>{0, -9.81 * halved.time, 0}) < 1e-6);
}

TEST_CASE("a penalty that cannot be is refused", "[mpm][ghost]") {
  using Catch::Matchers::ContainsSubstring;
  CHECK_THROWS_WITH(GhostPenalty<>({.strength = -1}),
                    ContainsSubstring("ghost penalty: strength = -1"));
  CHECK_THROWS_WITH(GhostPenalty<>({.share = 0}), ContainsSubstring("share = 0"));
  CHECK_THROWS_WITH(GhostPenalty<>({.ratio = -2}), ContainsSubstring("ratio = -2"));
}

}  // namespace
}  // namespace taut
