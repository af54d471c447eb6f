// The Hessian of particles without a matrix, the matrices that are assembled from it, and the
// cycles on either.
#include <taut/materials/models.hpp>
#include <taut/mpm/particle_multigrid.hpp>

#include "particle_problem.hpp"

namespace taut {
namespace {

using kernels::vector_of;

template <class Precision, class Space, bool packed>
using Of =
    test::Combination<FixedCorotated, FullProjection, QuadraticSpline, Precision, Space, packed>;

/// |a - b| / |b| over the nodes.
template <class A, class B>
double apart(A const& a, B const& b, int n, int numbers = 3) {
  double square = 0, all = 0;
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < numbers; ++c) {
      double const d = double(a(i, c)) - double(b(i, c));
      square += d * d;
      all += double(b(i, c)) * double(b(i, c));
    }
  return std::sqrt(square / all);
}

/// A problem, its operator at x, and blocks of single nodes.
template <class C>
struct Linearised {
  using S = typename C::Space;
  using T = typename C::Precision::real;
  using Operator = ParticleOperator<QuadraticSpline, T, S, C::packed>;
  using Matrix = MatrixLevel<S, T, 2>;
  test::Problem<C> problem;
  Operator to;
  int n;
  BlockField<T, S> local;

  explicit Linearised(int team = 0) : problem(team), n(problem.scene.nodes()), local("local", n) {
    for (int i = 0; i < n; ++i) problem.fixed(i) = i % 11 == 3;
    problem.term.linearise(problem.x, 0.01, to);
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 6; ++k) local(i, k) = T(k < 3 ? 2 + 0.1 * k + 0.01 * (i % 7) : 0.2 * k);
    to.set_local(local, problem.fixed);
  }
  VectorField<T, S> vectors() const { return VectorField<T, S>("vectors", n); }
  Matrix matrix() const {
    Matrix level;
    level.resize(to.nodes(), to.fixed());
    to.matrix(level.matrix());
    level.finish();
    return level;
  }
};

template <class C>
void check(double round_off, int team = 0) {
  Linearised<C> const l(team);
  int const n = l.n;
  auto const& problem = l.problem;
  int fixed = 0;
  for (int i = 0; i < n; ++i) fixed += problem.fixed(i);
  REQUIRE(fixed > 0);

  // The product, against the term's.
  auto const found = l.vectors(), expected = l.vectors(), by_matrix = l.vectors();
  auto const p = l.vectors();
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) p(i, c) = problem.p(i, c);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (problem.fixed(i)) p(i, c) = 0;
  problem.term.add_product(problem.x, p, 0.01, problem.fixed, expected);
  for (int i = 0; i < n; ++i) {
    Vec3<double> const own = kernels::block_times<double>(
        l.local, i, {double(p(i, 0)), double(p(i, 1)), double(p(i, 2))});
    for (int c = 0; c < 3; ++c) expected(i, c) += typename Linearised<C>::T(own[c]);
  }
  // What fixed nodes are given has no effect on free ones.
  for (int i = 0; i < n; ++i)
    if (problem.fixed(i)) {
      p(i, 0) = 1;
      for (int c = 0; c < 3; ++c) expected(i, c) = l.local(i, c == 0 ? 0 : c == 1 ? 3 : 5);
    }
  l.to.product(p, found);
  CHECK(apart(found, expected, n) < round_off);

  // The matrix, against the product; its diagonal.
  auto const level = l.matrix();
  level.product(p, by_matrix);
  CHECK(apart(by_matrix, expected, n) < round_off);
  BlockField<typename Linearised<C>::T, typename C::Space> const diagonal("diagonal", n),
      of_matrix("of_matrix", n);
  l.to.diagonal(diagonal);
  for (int i = 0; i < n; ++i) {
    auto const d = symmetric_part(level.matrix().block(i, 0, 0, 0));
    for (int k = 0; k < 6; ++k) of_matrix(i, k) = d.s[k];
  }
  CHECK(apart(diagonal, of_matrix, n, 6) < round_off);

  // The coarse matrix, against P'AP of the fine one.
  using Coarse = GridMatrix<typename C::Space, typename Linearised<C>::T, 2>;
  GridLevel<typename C::Space> grid;
  LeafList free;
  auto const& nodes = l.to.nodes();
  for (int leaf = 0; leaf < nodes.leaves.count; ++leaf) {
    auto const& origin = nodes.leaves.origin;
    free.origin.push_back({origin(leaf, 0), origin(leaf, 1), origin(leaf, 2)});
    LeafMask& mask = free.mask.emplace_back();
    for (int x = 0; x < 8; ++x) mask[x] = nodes.mask(leaf, x);
  }
  grid.coarsen(free, 1, nodes.dx);
  Coarse at_once, by_galerkin;
  at_once.resize(grid.nodes());
  by_galerkin.resize(grid.nodes());
  l.to.template coarse_matrix<LinearEmbedding>(at_once);
  level.template coarse_matrix<LinearEmbedding>(by_galerkin);
  REQUIRE(at_once.size() > 20);
  CHECK(apart(at_once.entry, by_galerkin.entry, at_once.size(), Coarse::Row::numbers) < round_off);
}

TEST_CASE("particles make their operator, its matrix and the coarser one", "[mpm][operator]") {
  check<Of<Fp64, test::RightOf<DefaultSpace>, true>>(1e-13);
}
TEST_CASE("the same in float, by threads of a particle each, in a device's layout",
          "[mpm][operator]") {
  check<Of<Mixed, test::LeftOf<DefaultSpace>, false>>(1e-5,
                                                      test::team_sizes<DefaultSpace>().back());
}

TEST_CASE("an operator of doubles takes its numbers from packs of floats", "[mpm][operator]") {
  using C = Of<Mixed, test::RightOf<DefaultSpace>, true>;
  Linearised<C> const l;
  ParticleOperator<QuadraticSpline, double, C::Space> wide;
  l.problem.term.linearise(l.problem.x, 0.01, wide);
  BlockField<double, C::Space> const local("local", l.n);
  for (int i = 0; i < l.n; ++i)
    for (int k = 0; k < 6; ++k) local(i, k) = double(l.local(i, k));
  wide.set_local(local, l.problem.fixed);
  auto const p = l.vectors(), expected = l.vectors();
  VectorField<double, C::Space> const p_wide("p", l.n), found("found", l.n);
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) p_wide(i, c) = double(p(i, c) = l.problem.p(i, c));
  l.to.product(p, expected);
  wide.product(p_wide, found);
  CHECK(apart(found, expected, l.n) < 1e-5);
}

TEST_CASE("a cycle without a fine matrix is that of the matrix", "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  using S = C::Space;
  Linearised<C> const l;
  auto const level = l.matrix();
  ActionLevel<Linearised<C>::Operator, S, double> action;
  action.resize(l.to.nodes(), l.to.fixed(), l.to);
  action.finish();
  auto const g = l.vectors(), by_action = l.vectors(), by_matrix = l.vectors();
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) g(i, c) = l.problem.fixed(i) ? 0 : std::sin(3.0 * i + c);
  Multigrid<decltype(action), Chebyshev, ForwardBackward, LinearEmbedding, double> free(
      {.direct_nodes = 20});
  free.build(action);
  free.apply(g, by_action);
  Multigrid<MatrixLevel<S, double, 2>, Chebyshev, ForwardBackward, LinearEmbedding, double> cycle(
      {.direct_nodes = 20});
  cycle.build(level);
  cycle.apply(g, by_matrix);
  CHECK(free.report().nodes == cycle.report().nodes);
  REQUIRE(free.report().nodes.size() > 2);
  CHECK(apart(by_action, by_matrix, l.n) < 1e-11);
}

TEST_CASE("the polynomial that smooths is positive where two grains are stiffer than all else",
          "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  using S = C::Space;
  double const dx = 0.05, step = 1.0 / 24;
  auto list = test::jittered_block(6, 2, dx, {-3.3, 5.2, 6.6}, 1, 0.0);
  for (int const grain : {6 * 144 + 6 * 12 + 6, 7 * 144 + 6 * 12 + 6}) list[grain].stiffness = 100;
  test::OnGrid<QuadraticSpline, Fp64, S> scene(list, dx);
  C::Term term({lame_parameters(5e5, 0.4)});
  term.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
  Linearised<C>::Operator to;
  term.linearise(scene.rest, step * step, to);
  int const n = scene.nodes();
  BlockField<double, S> const local("local", n);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) local(i, c) = 1000 * dx * dx * dx;
  to.set_local(local, FixedMask<S>("fixed", n));
  using Action = ActionLevel<Linearised<C>::Operator, S, double>;
  Action level;
  level.resize(to.nodes(), to.fixed(), to);
  level.finish();

  LevelVectors<double, S> v;
  v.resize(n);
  double const largest = largest_by_power(level, v, 400, 0);
  VectorField<double, S> const e("e", n), r("r", n), z("z", n);
  assign(e, Kokkos::subview(v.d, Kokkos::make_pair(0, n), Kokkos::ALL));
  level.product(e, r);
  // e'A S A e / e'A e of the smoother's pair S alone, in the stiffest direction.
  auto const positive = [&](Chebyshev::Params const& params) {
    Multigrid<Action, Chebyshev, ForwardBackward, LinearEmbedding, double> smoothing(
        {.max_levels = 1, .direct_nodes = 0, .fine = params});
    smoothing.build(level);
    REQUIRE(smoothing.report().nodes.size() == 1);
    smoothing.apply(r, z);
    double above = 0, below = 0;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        above += r(i, c) * z(i, c);
        below += r(i, c) * e(i, c);
      }
    return above / below;
  };
  Chebyshev by_default;
  by_default.setup(level, v);
  CHECK(by_default.largest() > largest);
  CHECK(by_default.largest() < 1.25 * largest);
  CHECK(positive({}) > 0.1);
  // What this is to catch: so short a look is indefinite here.
  CHECK(positive({.safety = 1, .steps = 3}) < -0.1);
}

TEST_CASE("cut cells are solved with by patches", "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  using S = C::Space;
  Linearised<C> const l;
  auto const matrix = l.matrix();
  GridNodes<S> const& nodes = l.to.nodes();
  PatchedLevel<Linearised<C>::Operator, S, double> level;
  level.resize(nodes, l.to.fixed(), l.to);
  CutCells const params{.ratio = 0.05};
  level.set(params);
  level.finish();
  auto const r = l.vectors(), expected = l.vectors();
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) r(i, c) = std::sin(2.0 * i + c);

  // Node k of 27 around i, if it is free.
  auto const around = [&](int i, int k) {
    int const j = nodes.node(nodes.ijk(i, 0) + k / 9 - 1, nodes.ijk(i, 1) + k / 3 % 3 - 1,
                             nodes.ijk(i, 2) + k % 3 - 1);
    return j >= 0 && !l.problem.fixed(j) ? j : -1;
  };
  auto const block = [&](int i, int j) {
    return matrix.matrix().block(i, nodes.ijk(j, 0) - nodes.ijk(i, 0),
                                 nodes.ijk(j, 1) - nodes.ijk(i, 1),
                                 nodes.ijk(j, 2) - nodes.ijk(i, 2));
  };
  std::vector<int> cut, held(l.n, 0);
  for (int i = 0; i < l.n; ++i) {
    if (l.problem.fixed(i)) continue;
    double most = 0;
    for (int k = 0; k < 27; ++k) {
      if (int const j = around(i, k); j >= 0) {
        most = std::max(most, contract(block(j, j), identity3<double>()));
      }
    }
    if (!(contract(block(i, i), identity3<double>()) < params.ratio * most)) continue;
    cut.push_back(i);
    for (int k = 0; k < 27; ++k)
      if (int const j = around(i, k); j >= 0) ++held[j];
  }
  REQUIRE(cut.size() > 3);
  CHECK(level.patches() == int(cut.size()));
  for (int i = 0; i < l.n; ++i) {
    if (held[i] > 0) continue;
    auto const z = kernels::block_times<double>(
        level.inverse(), i, {double(r(i, 0)), double(r(i, 1)), double(r(i, 2))});
    for (int c = 0; c < 3; ++c) expected(i, c) = z[c];
  }
  for (int const i : cut) {
    std::vector<double> a(81 * 81, 0.0);
    for (int v = 0; v < 81; ++v) a[82 * v] = 1;
    for (int v = 0; v < 27; ++v)
      for (int w = 0; w < 27; ++w) {
        int const from = around(i, v), to = around(i, w);
        if (from < 0 || to < 0) continue;
        bool near = true;
        for (int c = 0; c < 3; ++c)
          near = near && std::abs(nodes.ijk(from, c) - nodes.ijk(to, c)) <= 2;
        REQUIRE(near);
        Mat3<double> const b = block(from, to);
        for (int c = 0; c < 9; ++c) a[81 * (3 * v + c % 3) + 3 * w + c / 3] = b.a[c];
      }
    REQUIRE(invert_positive(a, 81, 1e-16) == 0);
    for (int v = 0; v < 81; ++v) {
      int const to = around(i, v / 3);
      if (to < 0) continue;
      for (int w = 0; w < 81; ++w) {
        int const from = around(i, w / 3);
        if (from < 0) continue;
        expected(to, v % 3) +=
            a[81 * v + w] * r(from, w % 3) / std::sqrt(double(held[to]) * held[from]);
      }
    }
  }
  CHECK(apart(level.preconditioned(r), expected, l.n) < 1e-9);

  // Jacobi's step is along M r as well.
  LevelVectors<double, S> v;
  v.resize(l.n);
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) {
      v.b(i, c) = r(i, c);
      expected(i, c) *= 0.25;
    }
  DampedJacobi const jacobi({.damping = 0.25});
  jacobi.first(level, v);
  CHECK(apart(v.x, expected, l.n) < 1e-9);
  // And the second adds the same of what is left.
  VectorField<double, S> const left = l.vectors();
  level.residual(v.b, v.x, left);
  auto const& z = level.preconditioned(left);
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) expected(i, c) += 0.25 * z(i, c);
  jacobi.second(level, v);
  CHECK(apart(v.x, expected, l.n) < 1e-9);

  // Without patches it is a level like others.
  level.set({.ratio = 0});
  level.finish();
  REQUIRE(level.patches() == 0);
  ActionLevel<Linearised<C>::Operator, S, double> plain;
  plain.resize(nodes, l.to.fixed(), l.to);
  plain.finish();
  auto const smoothed = [&](auto const& by) {
    Chebyshev chebyshev;
    chebyshev.setup(by, v);
    for (int i = 0; i < l.n; ++i)
      for (int c = 0; c < 3; ++c) v.b(i, c) = r(i, c);
    chebyshev.first(by, v);
    return std::vector<double>(v.x.data(), v.x.data() + 3 * l.n);
  };
  std::vector<double> const with = smoothed(level), without = smoothed(plain);
  for (std::size_t k = 0; k < with.size(); ++k)
    CHECK_THAT(with[k], Catch::Matchers::WithinRel(without[k], 1e-9));
}

TEST_CASE("the diagonal of an exact block is raised up to the last shift", "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  Linearised<C> const l;
  auto level = l.matrix();
  kernels::NodeIndices<C::Space> const part("part", l.n);
  for (int i = 0; i < l.n; ++i) part(i) = i == 5 ? 0 : -1;
  auto const factorizes = [&](double beside) {
    level.matrix().set(5, 0, 0, 0, Mat3<double>{{1, beside, 0, beside, 1, 0, 0, 0, 1}});
    ExactBlock<C::Space> block;
    bool const done = block.factorize(level.matrix(), part, 1, false, 1e-4);
    return std::pair(done, block.shift());
  };
  CHECK(factorizes(0.5) == std::pair(true, 0.0));
  // One shift of 1e-4 does, and the next would be above 1e-3.
  auto const [done, shift] = factorizes(1 + 5e-5);
  CHECK(done);
  CHECK(shift == 1e-4);
  CHECK_FALSE(factorizes(1.01).first);
}

TEST_CASE("nodes far away have numbers of their own to start from", "[mpm][operator]") {
  using S = test::RightOf<DefaultSpace>;
  GridNodes<S> nodes;
  nodes.ijk = decltype(nodes.ijk)("ijk", 2);
  // Eight times these is the same number of 32 bits.
  nodes.ijk(0, 0) = (1 << 29) - 64;
  nodes.ijk(1, 0) = -64;
  Vec3<double> const far = kernels::scattered_numbers(nodes, 0),
                     near = kernels::scattered_numbers(nodes, 1);
  CHECK(norm(far - near) > 0);
}

TEST_CASE("light nodes are solved with exactly, around a cycle", "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  using S = C::Space;
  using Vectors = VectorField<double, S>;
  Linearised<C> const l;
  auto const level = l.matrix();
  GridNodes<S> const& nodes = l.to.nodes();
  double const ratio = 0.05;
  LightNodes<S, double, 2> light;
  CHECK_FALSE(light.build(l.to, ratio, 3));
  CHECK(light.nodes() == 0);
  REQUIRE(light.build(l.to, ratio, l.n));

  // Which they are, from the diagonal of the matrix.
  auto const trace_of = [&](int i) {
    return contract(level.matrix().block(i, 0, 0, 0), identity3<double>());
  };
  std::vector<int> is_light(l.n, 0);
  int count = 0;
  for (int i = 0; i < l.n; ++i) {
    double most = 0;
    for (int k = 0; k < 27; ++k) {
      int const j = nodes.node(nodes.ijk(i, 0) + k / 9 - 1, nodes.ijk(i, 1) + k / 3 % 3 - 1,
                               nodes.ijk(i, 2) + k % 3 - 1);
      if (j >= 0 && !l.problem.fixed(j)) most = std::max(most, trace_of(j));
    }
    is_light[i] = !l.problem.fixed(i) && trace_of(i) < ratio * most;
    count += is_light[i];
  }
  REQUIRE(count > 10);
  REQUIRE(count < l.n / 2);
  CHECK(light.nodes() == count);

  auto const product = [&](Vectors const& x, Vectors const& y) { level.product(x, y); };
  auto const cycle = [&](Vectors const& r, Vectors const& z) {
    for (int i = 0; i < l.n; ++i) {
      auto const own = kernels::block_times<double>(level.inverse(), i, vector_of<double>(r, i));
      for (int c = 0; c < 3; ++c) z(i, c) = 0.1 * own[c];
    }
  };
  auto const dot = [&](Vectors const& a, Vectors const& b) {
    double sum = 0;
    for (int i = 0; i < l.n; ++i)
      for (int c = 0; c < 3; ++c) sum += a(i, c) * b(i, c);
    return sum;
  };
  auto const a = l.vectors(), b = l.vectors(), of_a = l.vectors(), of_b = l.vectors(),
             left = l.vectors();
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) {
      a(i, c) = l.problem.fixed(i) ? 0 : std::sin(2.0 * i + c);
      b(i, c) = l.problem.fixed(i) ? 0 : std::cos(3.0 * i - c);
    }
  light.apply(a, of_a, product, cycle);
  light.apply(b, of_b, product, cycle);
  CHECK(std::abs(dot(of_a, b) - dot(a, of_b)) < 1e-12 * std::abs(dot(a, of_a)));
  CHECK(dot(a, of_a) > 0);
  // Last comes the exact solve, so nothing is left at light nodes.
  level.product(of_a, left);
  double rest = 0, all = 0;
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) {
      if (is_light[i]) rest = std::max(rest, std::abs(a(i, c) - left(i, c)));
      all = std::max(all, std::abs(a(i, c)));
    }
  CHECK(rest < 1e-10 * all);
  // What light nodes alone have done is undone at once.
  for (int i = 0; i < l.n; ++i)
    for (int c = 0; c < 3; ++c) a(i, c) = is_light[i] ? std::sin(2.0 * i + c) : 0;
  level.product(a, b);
  light.apply(b, of_b, product, cycle);
  CHECK(apart(of_b, a, l.n) < 1e-9);
}

TEST_CASE("matrices of particles do not depend on the number of threads", "[mpm][operator]") {
  using C = Of<Fp64, test::RightOf<DefaultSpace>, true>;
  auto const numbers = [] {
    Linearised<C> const l;
    auto const level = l.matrix();
    auto const& entry = level.matrix().entry;
    auto const y = l.vectors();
    l.to.product(l.problem.p, y);
    std::vector<double> all(y.data(), y.data() + 3 * l.n);
    for (int i = 0; i < l.n; ++i)
      for (int k = 0; k < StencilRow<2>::numbers; ++k) all.push_back(entry(i, k));
    return all;
  };
  auto const results = test::on_one_thread_and_all(numbers);
  CHECK(results[0] == results[1]);
}

}  // namespace
}  // namespace taut
