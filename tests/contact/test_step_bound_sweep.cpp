// The sweeps over lists of pairs against one pair after the other, in every precision, layout and
// number of threads; and how far a list of candidates covers the motion.
#include "step_bound_samples.hpp"

#include <taut/contact/step_bound_sweep.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <limits>
#include <tuple>
#include <vector>

#include "support/threads.hpp"

using namespace taut;
using namespace taut::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

using HostExecution = Kokkos::DefaultHostExecutionSpace;
template <class Precision_, class Layout>
struct Setting {
  using Precision = Precision_;
  using S = Space<HostExecution, Layout>;
};
using Settings = std::tuple<Setting<Fp64, Kokkos::LayoutRight>, Setting<Fp64, Kokkos::LayoutLeft>,
                            Setting<Mixed, Kokkos::LayoutRight>, Setting<Mixed, Kokkos::LayoutLeft>,
                            Setting<Fp32, Kokkos::LayoutRight>, Setting<Fp32, Kokkos::LayoutLeft>>;

/// Pairs with vertices of their own, in an order that is not that of the vertices.
template <class Setting>
struct Crowd {
  using S = typename Setting::S;
  using Position = typename Setting::Precision::position;
  using Real = typename Setting::Precision::real;

  std::vector<PairMotion> motion;
  Kokkos::View<int* [4], typename S::layout, typename S::memory> pairs;
  VectorField<Position, S> x;
  VectorField<Real, S> p;

  explicit Crowd(std::vector<PairMotion> motions)
      : motion(std::move(motions)),
        pairs("pairs", motion.size() + 3),  // room to spare, which no sweep may read
        x("x", 4 * motion.size()),
        p("p", 4 * motion.size()) {
    int const n = size();
    for (int k = 0; k < n; ++k) {
      for (int a = 0; a < 4; ++a) {
        int const v = a * n + (n - 1 - k);
        pairs(k, a) = v;
        for (int c = 0; c < 3; ++c) {
          x(v, c) = Position(motion[k].x[a][c]);
          p(v, c) = Real(motion[k].p[a][c]);
        }
      }
    }
    for (int k = n; k < n + 3; ++k)
      for (int a = 0; a < 4; ++a) pairs(k, a) = -1;
  }
  int size() const { return static_cast<int>(motion.size()); }
};

template <class Setting>
Crowd<Setting> crowd(PairKind kind, int n, unsigned seed) {
  Samples samples(seed);
  std::vector<PairMotion> motions;
  for (int k = 0; k < n; ++k) {
    Hardship const kinds[] = {Hardship::none, Hardship::turning, Hardship::sliding,
                              Hardship::half_at_rest, Hardship::fly_by};
    motions.push_back(
        samples.motion<typename Setting::Precision::position, typename Setting::Precision::real>(
            kind, kinds[k % 5]));
    if (k % 7 == 0) {
      for (auto& p : motions.back().p) p = (1 / 1024.) * p;
    }
  }
  return Crowd<Setting>(motions);
}

template <class Setting, PairKind kind, class Bound>
BoundedStep sweep(Crowd<Setting> const& c, Bound const& bound, Clearance const& clearance,
                  double at_most) {
  return bound_step<typename Setting::Precision, typename Setting::S, kind>(
      bound, clearance, c.pairs, c.size(), c.x, c.p, at_most);
}

bool same(BoundedStep const& a, BoundedStep const& b) {
  bool equal = a.alpha == b.alpha && a.pair == b.pair;
  for (int k = 0; k < settled_kinds; ++k) equal = equal && a.settled[k] == b.settled[k];
  return equal;
}

}  // namespace

TEMPLATE_LIST_TEST_CASE("a sweep finds the shortest of all bounds and the first pair that has it",
                        "[step_bound]", Settings) {
  constexpr PairKind kind = PairKind::edge_edge;
  auto const check = [](auto const& bound) {
    Clearance const clearance{.share = 0.5};
    // Twins, of which the first has to be named.
    auto motions = crowd<TestType>(kind, 400, 3).motion;
    std::size_t const half = motions.size();
    for (std::size_t k = 0; k < half; ++k) motions.push_back(motions[half - 1 - k]);
    Crowd<TestType> const c(motions);
    auto const results =
        on_one_thread_and_all([&] { return sweep<TestType, kind>(c, bound, clearance, 1.0); });
    CHECK(same(results[0], results[1]));
    BoundedStep const& step = results[0];

    // One by one.
    BoundedStep expected;
    expected.alpha = 1;
    for (int k = 0; k < c.size(); ++k) {
      std::vector<PairMotion> const alone(1, c.motion[k]);
      auto const one = sweep<TestType, kind>(Crowd<TestType>(alone), bound, clearance, 1.0);
      CHECK((one.pair == 0) == (one.count(Settled::cut) + one.count(Settled::uncertain) == 1));
      for (int h = 0; h < settled_kinds; ++h) expected.settled[h] += one.settled[h];
      if (one.alpha < expected.alpha) {
        expected.alpha = one.alpha;
        expected.pair = k;
      }
    }
    CHECK(same(step, expected));
    CHECK((step.alpha > 0 && step.alpha < 1));
    CHECK(step.count(Settled::cut) > 100);
  };
  check(AdditiveCcd{});
  check(PairwiseClosing{});
  check(HalfDhatClamp{0.1});
}

TEMPLATE_LIST_TEST_CASE("the step of a sweep keeps every pair apart where it is stored",
                        "[step_bound]", Settings) {
  using Position = typename TestType::Precision::position;
  auto const check = [](auto kind) {
    constexpr PairKind k = decltype(kind)::value;
    for (unsigned seed = 0; seed < 10; ++seed) {
      auto const c = crowd<TestType>(k, 50, seed);
      Clearance const clearance{.share = 0.9};
      auto const step = sweep<TestType, k>(c, AdditiveCcd{}, clearance, infinity);
      CHECK(step.count(Settled::uncertain) == 0);
      REQUIRE((step.alpha > 0 && step.alpha < infinity));
      Position const alpha = Position(step.alpha);
      for (int i = 0; i < c.size(); ++i) {
        PairMotion const& before = c.motion[i];
        double const kept = 0.1 * true_distance(before, 0) - 1e-13 * before.size();
        CHECK(proved_apart(before, kept, 0, step.alpha));
        PairMotion after = before;
        for (int a = 0; a < 4; ++a)
          for (int d = 0; d < 3; ++d) {
            after.x[a][d] =
                stored<Position>(Position(before.x[a][d]) + alpha * Position(before.p[a][d]));
            after.p[a][d] = 0;
          }
        CHECK(proved_apart(after, kept, 0, 0));
      }
      // A step that is asked to be shorter than the bound is as long as asked.
      auto const shorter = sweep<TestType, k>(c, AdditiveCcd{}, clearance, step.alpha / 2);
      CHECK(shorter.alpha == step.alpha / 2);
      CHECK(shorter.pair == -1);
    }
  };
  check(std::integral_constant<PairKind, PairKind::point_triangle>{});
  check(std::integral_constant<PairKind, PairKind::edge_edge>{});
}

TEMPLATE_LIST_TEST_CASE("what was found far enough apart keeps its clearance without a look",
                        "[step_bound]", Settings) {
  using S = typename TestType::S;
  using Position = typename TestType::Precision::position;
  auto const check = [](auto kind, auto const& bound, bool by_gap) {
    constexpr PairKind k = decltype(kind)::value;
    int passed = 0, looked_at = 0;
    for (unsigned seed = 0; seed < 4; ++seed) {
      for (PairMotion m : crowd<TestType>(k, 60, seed).motion) {
        double const distance = true_distance(m, 0);
        // The corners move against each other by half of the gap, or of what is left of it.
        double fastest = 0;
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b) fastest = std::max(fastest, norm(m.p[a] - m.p[b]));
        if (!(fastest > 0)) continue;
        double const by = (seed % 2 == 0 ? 0.4 : 0.9) * distance;
        for (auto& p : m.p)
          for (int c = 0; c < 3; ++c) {
            p[c] = stored<typename TestType::Precision::real>(by / fastest * p[c]);
          }
        Crowd<TestType> const c({m});
        Vec3<double> y[4] = {m.x[0], m.x[1], m.x[2], m.x[3]};
        FoundDistances<S> found{Array<float, S>("found", 1), {}};
        found.at(0) = static_cast<float>(noted_distance(distance * (1 - 1e-9), pair_size(y)));
        // That of the corners and of storing them.
        double const moved =
            by * (1 + 1e-6) + 8 * double(std::numeric_limits<Position>::epsilon()) * m.size();
        found.moved = {seed % 4 < 2 ? moved : 0, seed % 4 < 2 ? 0 : moved};
        found.at(0) = pair_length(seed % 4 < 2, found.at(0));
        CHECK((found.at(0) == 0 || (found.least(0) <= distance - by && found.most(0) >= distance)));
        Clearance const clearance{.share = 0.9};
        auto const plain = sweep<TestType, k>(c, bound, clearance, 1.0);
        auto const step = bound_step<typename TestType::Precision, S, k>(bound, clearance, c.pairs,
                                                                         1, c.x, c.p, 1.0, found);
        bool const pass = step.alpha == 1 && step.count(Settled::boxes) == 1;
        if (!pass) CHECK(same(step, plain));
        if (pass && by_gap) CHECK(proved_apart(m, 0.1 * distance - 1e-13 * m.size(), 0, 1));
        (pass ? passed : looked_at) += 1;
      }
    }
    CHECK(looked_at > 50);
    CHECK((passed > 50) == by_gap);
  };
  using Triangle = std::integral_constant<PairKind, PairKind::point_triangle>;
  using Edge = std::integral_constant<PairKind, PairKind::edge_edge>;
  check(Triangle{}, AdditiveCcd{}, true);
  check(Edge{}, AdditiveCcd{}, true);
  check(Edge{}, PairwiseClosing{}, true);
  check(Triangle{}, HalfDhatClamp{0.1}, false);  // it does not look at gaps, so it may not skip
}

TEST_CASE("fp32 kernels leave to fp64 what is too near for them", "[step_bound]") {
  // 1e-9 apart at size 1, in mixed precision: the positions tell, fp32 differences do not.
  PairMotion const m{PairKind::point_triangle,
                     {{0.25, 0.25, 1e-9}, {0, 0, 0}, {1, 0, 0.3}, {0, 1, -0.3}},
                     {{0, 0, -1e-9}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  using Setting = Setting<Mixed, Kokkos::LayoutRight>;
  std::vector<PairMotion> const alone(1, m);
  Crowd<Setting> const c(alone);
  auto const narrow = AdditiveCcd{}.certify(
      kernels::path_of<float, PairKind::point_triangle>(c.x, c.p, c.pairs, 0), Clearance{}, 1.0f);
  CHECK((narrow.settled == Settled::open && narrow.alpha == 0));
  auto const step = sweep<Setting, PairKind::point_triangle>(c, AdditiveCcd{}, {}, 1.0);
  CHECK(step.count(Settled::cut) == 1);
  CHECK((step.alpha > 0.49 && step.alpha < 0.5));
}

TEMPLATE_LIST_TEST_CASE("a sweep names the pair that nothing can be proved about", "[step_bound]",
                        Settings) {
  auto motions = crowd<TestType>(PairKind::point_triangle, 100, 5).motion;
  for (int k : {30, 70}) motions[k].x[0] = motions[k].x[1];
  motions[30].p[0] = motions[70].p[0] = {1, 0, 0};
  Crowd<TestType> const c(motions);
  auto const step =
      sweep<TestType, PairKind::point_triangle>(c, AdditiveCcd{}, {.share = 0.5}, 1.0);
  CHECK(step.alpha == 0);
  CHECK(step.pair == 30);
  CHECK(step.count(Settled::uncertain) == 2);
}

TEMPLATE_LIST_TEST_CASE("bounds of vertices are the least over their pairs", "[step_bound]",
                        Settings) {
  using Position = typename TestType::Precision::position;
  using S = typename TestType::S;
  constexpr PairKind kind = PairKind::edge_edge;
  auto const check = [](auto const& bound) {
    auto const c = crowd<TestType>(kind, 200, 9);
    Samples samples(9);
    // Pairs share vertices: the first edges of each with the second of others.
    int const n = c.size();
    for (int k = 0; k < n; ++k) {
      int const other = samples.one_of(n);
      for (int a = 2; a < 4; ++a) c.pairs(k, a) = a * n + other;
    }
    Clearance const clearance;
    auto const run = [&] {
      Array<Position, S> alpha("alpha", c.x.extent(0));
      assign(alpha, Position(1));
      auto const step = bound_vertices<typename TestType::Precision, S, kind>(
          bound, clearance, c.pairs, n, c.x, c.p, 1.0, alpha);
      std::vector<double> values(alpha.extent(0));
      for (std::size_t v = 0; v < values.size(); ++v) values[v] = double(alpha(v));
      return std::pair(step, values);
    };
    auto const results = on_one_thread_and_all(run);
    CHECK(same(results[0].first, results[1].first));
    CHECK(results[0].second == results[1].second);
    std::vector<double> expected(c.x.extent(0), 1);
    kernels::BoundVertices<typename TestType::Precision, S, kind,
                           std::decay_t<decltype(bound)>> const kernel{
        {1.0}, bound, clearance, c.pairs, c.x, c.p, {}};
    for (int k = 0; k < n; ++k) {
      auto const r = kernel.reach(k);
      for (int a = 0; a < 4; ++a) {
        double& e = expected[c.pairs(k, a)];
        e = std::min(e, stored<Position>(r.alpha[a]));
      }
    }
    CHECK(results[0].second == expected);
    auto const least = *std::min_element(expected.begin(), expected.end());
    CHECK(stored<Position>(results[0].first.alpha) == least);
  };
  check(PlanarScaling{});
  check(IsotropicPerVertex{});
}

TEMPLATE_LIST_TEST_CASE("candidates cover the motion until a vertex has gone half the way",
                        "[step_bound]", Settings) {
  using Position = typename TestType::Precision::position;
  using Real = typename TestType::Precision::real;
  using S = typename TestType::S;
  using Precision = typename TestType::Precision;
  int const n = 300;
  VectorField<Position, S> found("found", n), x("x", n);
  VectorField<Real, S> p("p", n);
  Samples samples(21);
  for (double far : {1.0, 100.0}) {
    for (double moved : {0.0, 0.01}) {
      for (int i = 0; i < n; ++i) {
        Vec3<double> const at = samples.vector(far), by = samples.vector(moved / 2),
                           step = samples.vector(i % 3 == 0 ? 0 : 1);
        for (int c = 0; c < 3; ++c) {
          found(i, c) = Position(at[c]);
          x(i, c) = Position(at[c] + by[c]);
          p(i, c) = Real(step[c]);
        }
      }
      double const radius = 0.1, reserve = 0.04;
      auto const results = on_one_thread_and_all(
          [&] { return covered_step<Precision, S>(found, radius, reserve, x, p, infinity); });
      double const alpha = results[0];
      CHECK(alpha == results[1]);
      REQUIRE((alpha > 0 && alpha < infinity));
      double longest = 0, least = infinity;
      for (int i = 0; i < n; ++i) {
        long double motion = 0, so_far = 0, speed = 0;
        for (int c = 0; c < 3; ++c) {
          double const next = stored<Position>(x(i, c) + Position(alpha) * Position(p(i, c)));
          motion += square((long double)next - found(i, c));
          so_far += square((long double)x(i, c) - found(i, c));
          speed += square((long double)p(i, c));
        }
        longest = std::max(longest, double(std::sqrt(motion)));
        if (speed > 0) {
          least = std::min(least, double((0.03L - std::sqrt(so_far)) / std::sqrt(speed)));
        }
      }
      CAPTURE(far, moved, alpha, least, longest);
      CHECK(longest <= 0.03);
      CHECK(alpha <= least);
      CHECK(alpha > 0.99 * least);
      CHECK(covered_step<Precision, S>(found, radius, reserve, x, p, alpha / 2) == alpha / 2);
    }
  }
  // Gone too far already, or nobody knows where to.
  auto const step = [&] { return covered_step<Precision, S>(found, 0.1, 0.04, x, p, 1.0); };
  Real const was = p(17, 1);
  p(17, 1) = std::numeric_limits<Real>::quiet_NaN();
  CHECK(step() == 0);
  p(17, 1) = was;
  CHECK(step() > 0);
  x(1, 0) += 1;
  CHECK(step() == 0);
  assign(p, Real(0));
  CHECK(step() == 1);
}

TEST_CASE("sweeps say what makes no sense, and take empty lists", "[step_bound]") {
  using Setting = Setting<Fp64, Kokkos::LayoutRight>;
  Crowd<Setting> const none(std::vector<PairMotion>{});
  constexpr PairKind kind = PairKind::point_triangle;
  auto const empty = sweep<Setting, kind>(none, AdditiveCcd{}, {}, 0.75);
  CHECK((empty.alpha == 0.75 && empty.pair == -1));
  auto const says = [](char const* part) {
    return Catch::Matchers::MessageMatches(Catch::Matchers::ContainsSubstring(part));
  };
  for (double share : {0.0, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_MATCHES((sweep<Setting, kind>(none, AdditiveCcd{}, {.share = share}, 1.0)), Error,
                         says("share of a gap"));
  }
  CHECK_THROWS_MATCHES((sweep<Setting, kind>(none, AdditiveCcd{}, {.least = -1}, 1.0)), Error,
                       says("least = -1 m"));
  CHECK_THROWS_MATCHES((sweep<Setting, kind>(none, AdditiveCcd{}, {.ample = 0}, 1.0)), Error,
                       says("ample = 0 m"));
  CHECK_THROWS_MATCHES((sweep<Setting, kind>(none, AdditiveCcd{}, {}, 0.0)), Error,
                       says("above 0"));
  CHECK_THROWS_MATCHES((covered_step<Fp64, Setting::S>(none.x, 0.1, 0.1, none.x, none.p, 1.0)),
                       Error, says("search further"));
}
