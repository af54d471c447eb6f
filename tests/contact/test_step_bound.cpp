// What a step bound promises for one pair, proved in exact arithmetic: that the gap stays above its
// clearance all along the step and where the step is stored after it. And that it is not needlessly
// short.
#include "step_bound_samples.hpp"

#include <taut/contact/vertex_bound.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <limits>
#include <tuple>

using namespace taut;
using namespace taut::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr PairKind kinds[] = {PairKind::point_triangle, PairKind::edge_edge};

template <class Position, class Real, class F>
auto with_path(PairMotion const& m, F const& f) {
  Vec3<Position> x[4];
  Vec3<Real> p[4];
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) {
      x[k][c] = Position(m.x[k][c]);
      p[k][c] = Real(m.p[k][c]);
    }
  return f(x, p);
}

template <class T, class Position, class Real, class Bound>
Reach<T> bound_of(PairMotion const& m, Bound const& bound, Clearance const& clearance, T at_most) {
  return with_path<Position, Real>(m, [&](auto const& x, auto const& p) {
    if (m.kind == PairKind::point_triangle) {
      PairPath<T, PairKind::point_triangle> const path(x, p);
      static_assert(GapBound<Bound, PairPath<T, PairKind::point_triangle>>);
      return bound.bound(path, clearance, at_most);
    }
    PairPath<T, PairKind::edge_edge> const path(x, p);
    return bound.bound(path, clearance, at_most);
  });
}

template <class T, class Position, class Real, class Bound>
VertexReach<T> vertex_bound_of(PairMotion const& m, Bound const& bound, Clearance const& clearance,
                               T at_most) {
  return with_path<Position, Real>(m, [&](auto const& x, auto const& p) {
    if (m.kind == PairKind::point_triangle) {
      return bound.bound(PairPath<T, PairKind::point_triangle>(x, p), clearance, at_most);
    }
    return bound.bound(PairPath<T, PairKind::edge_edge>(x, p), clearance, at_most);
  });
}

/// Where the step is stored: with the product rounded by itself, or not.
template <class Position>
PairMotion landed(PairMotion const& m, double const (&alpha)[4], bool fused) {
  PairMotion r = m;
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) {
      Position const a = Position(alpha[k]), x = Position(m.x[k][c]), p = Position(m.p[k][c]);
      Position volatile product = a * p;
      Position const moved = product;
      r.x[k][c] = double(fused ? std::fma(a, p, x) : Position(x + moved));
      r.p[k][c] = 0;
    }
  return r;
}
template <class Position>
PairMotion landed(PairMotion const& m, double alpha, bool fused) {
  double const all[4] = {alpha, alpha, alpha, alpha};
  return landed<Position>(m, all, fused);
}

template <class T_, class Position_, class Real_>
struct Scalars {
  using T = T_;
  using Position = Position_;
  using Real = Real_;
};
using AllScalars = std::tuple<Scalars<float, float, float>, Scalars<double, float, float>,
                              Scalars<float, double, float>, Scalars<double, double, float>,
                              Scalars<double, double, double>>;

/// What the distance must at least be after a step: the clearance, less the round-off of a kernel
/// in T on corners this far apart.
template <class T>
double promised(PairMotion const& m, Clearance const& clearance) {
  double const d = true_distance(m, 0);
  double const round_off = 64 * double(std::numeric_limits<T>::epsilon()) * m.size();
  return d - clearance.usable(d) - round_off;
}

struct Tally {
  int settled[settled_kinds] = {};
  int lost = 0;  ///< uncertain though the gap is well above the round-off
};

template <class Scalars, class Bound>
Tally check_bound(Bound const& bound, Hardship hardship, int count, unsigned seed) {
  using T = typename Scalars::T;
  using Position = typename Scalars::Position;
  Samples samples(seed);
  Tally tally;
  for (int k = 0; k < count; ++k) {
    PairKind const kind = kinds[k % 2];
    PairMotion const m = samples.motion<Position, typename Scalars::Real>(kind, hardship);
    Clearance clearance;
    double const shares[] = {0.1, 0.5, 0.9, 0.99};
    clearance.share = shares[samples.one_of(4)];
    if (samples.one_of(4) == 0) clearance.ample = 0.01;
    if (samples.one_of(4) == 0) clearance.least = true_distance(m, 0) * samples.uniform(0, 1.1);
    T const at_most = T(samples.one_of(2) == 0 ? 1 : samples.uniform(0.1, 10));
    Reach<T> const r = bound_of<T, Position, typename Scalars::Real>(m, bound, clearance, at_most);
    CAPTURE(int(hardship), k, double(r.alpha), double(r.kept), int(r.settled), clearance.share,
            clearance.least, clearance.ample);
    ++tally.settled[int(r.settled)];
    REQUIRE((r.alpha >= 0 && r.alpha <= at_most));
    REQUIRE((r.alpha > 0) == (r.settled != Settled::uncertain));
    if (r.settled == Settled::at_rest) continue;
    if (r.settled == Settled::uncertain) {
      // Where the distance exceeds `least` by a thousand times the round-off, there is an answer.
      double const d = true_distance(m, 0) - clearance.least;
      tally.lost += d * std::min(clearance.share, 1 - clearance.share) >
                    1e3 * std::numeric_limits<T>::epsilon() * m.size();
      continue;
    }
    double const kept = std::max(double(r.kept), promised<T>(m, clearance));
    REQUIRE(kept > 0);
    CAPTURE(kept, true_distance(m, double(r.alpha)) - kept);
    REQUIRE(proved_apart(m, kept, 0, double(r.alpha)));
    for (double alpha : {double(r.alpha), samples.uniform(0, 1) * double(r.alpha),
                         std::pow(10, -samples.uniform(0, 12)) * double(r.alpha)}) {
      for (bool fused : {false, true}) {
        REQUIRE(proved_apart(landed<Position>(m, alpha, fused), kept, 0, 0));
      }
    }
  }
  return tally;
}

}  // namespace

TEMPLATE_LIST_TEST_CASE("steps of the default bound keep their clearance, proved without rounding",
                        "[step_bound]", AllScalars) {
  for (int h = 0; h < hardships; ++h) {
    Tally const tally = check_bound<TestType>(AdditiveCcd{}, Hardship(h), 1000, 100 + h);
    CHECK(tally.lost == 0);
    if (Hardship(h) == Hardship::none) CHECK(tally.settled[int(Settled::cut)] > 100);
  }
}

TEMPLATE_LIST_TEST_CASE("steps that are ended early keep their clearance", "[step_bound]",
                        AllScalars) {
  for (int iterations = 0; iterations < 3; ++iterations) {
    for (Hardship h : {Hardship::none, Hardship::turning, Hardship::fly_by}) {
      check_bound<TestType>(AdditiveCcd{.iterations = iterations}, h, 200, 7);
      check_bound<TestType>(AdditiveCcd{.iterations = 200, .tolerance = 0}, h, 200, 8);
    }
  }
}

TEMPLATE_LIST_TEST_CASE("steps of the closing sum keep their clearance", "[step_bound]",
                        AllScalars) {
  for (int h = 0; h < hardships; ++h) {
    check_bound<TestType>(PairwiseClosing{}, Hardship(h), 200, 300 + h);
  }
}

TEMPLATE_LIST_TEST_CASE("vertices that move by any share of their own bound keep the clearance",
                        "[step_bound]", AllScalars) {
  using T = typename TestType::T;
  using Position = typename TestType::Position;
  using Real = typename TestType::Real;
  auto const check = [](auto const& bound, Hardship hardship) {
    Samples samples(50 + unsigned(hardship));
    int cut = 0;
    for (int k = 0; k < 200; ++k) {
      PairMotion const m = samples.motion<Position, Real>(kinds[k % 2], hardship);
      Clearance const clearance{.share = samples.uniform(0.1, 0.9)};
      auto const r = vertex_bound_of<T, Position, Real>(m, bound, clearance, T(1));
      CAPTURE(int(hardship), k, int(r.settled), double(r.kept));
      if (r.settled == Settled::at_rest || r.settled == Settled::uncertain) continue;
      cut += r.settled == Settled::cut;
      double const kept = std::max(double(r.kept), promised<T>(m, clearance));
      for (int trial = 0; trial < 4; ++trial) {
        double alpha[4];
        PairMotion shares = m;
        for (int v = 0; v < 4; ++v) {
          // The vertices, all or not, and some of the way.
          alpha[v] = double(r.alpha[v]) * (trial == 0   ? 1
                                           : trial == 1 ? samples.one_of(2)
                                                        : samples.uniform(0, 1));
          // A power of two less than a step, so that the product is exact.
          for (int c = 0; c < 3; ++c) {
            shares.p[v][c] = m.p[v][c] * std::exp2(std::floor(std::log2(alpha[v])));
          }
        }
        REQUIRE(proved_apart(shares, kept, 0, 1));
        for (bool fused : {false, true}) {
          REQUIRE(proved_apart(landed<Position>(m, alpha, fused), kept, 0, 0));
        }
      }
    }
    return cut;
  };
  for (int h = 0; h < hardships; ++h) {
    int const planar = check(PlanarScaling{}, Hardship(h));
    int const isotropic = check(IsotropicPerVertex{}, Hardship(h));
    if (Hardship(h) == Hardship::none) CHECK((planar > 50 && isotropic > 50));
  }
}

TEST_CASE("the half-dhat clamp lets a pair that is close already cross; the default does not",
          "[step_bound]") {
  double const dhat = 0.1;
  // A point a tenth of dhat above a triangle, and well inside it, comes down by 0.45 dhat.
  PairMotion const m{PairKind::point_triangle,
                     {{0.2, 0.2, 0.01}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                     {{0, 0, -0.045}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  auto const clamped = bound_of<double, double, double>(m, HalfDhatClamp{dhat}, {}, 1.0);
  CHECK(clamped.alpha == 1);
  CHECK(landed<double>(m, clamped.alpha, false).x[0][2] < 0);
  CHECK(true_distance(m, 0.01 / 0.045) < 1e-15);
  auto const safe = bound_of<double, double, double>(m, AdditiveCcd{}, {}, 1.0);
  CHECK(safe.settled == Settled::cut);
  CHECK(landed<double>(m, safe.alpha, false).x[0][2] >= 0.005);
  CHECK(safe.alpha > 0.99 * 0.005 / 0.045);
  // It does what it says: half of dhat for the fastest vertex.
  PairMotion fast = m;
  fast.p[2] = {0, 0.3, 0.4};
  auto const half = bound_of<double, double, double>(fast, HalfDhatClamp{dhat}, {}, 1.0);
  CHECK(std::abs(half.alpha - 0.1) < 1e-12);
}

TEMPLATE_LIST_TEST_CASE("a bound is not needlessly short", "[step_bound]", AllScalars) {
  using T = typename TestType::T;
  using Position = typename TestType::Position;
  using Real = typename TestType::Real;
  for (double share : {0.5, 0.95}) {
    Samples samples(11);
    std::vector<double> ratio, closing;
    while (ratio.size() < 300) {
      PairMotion const m = samples.motion<Position, Real>(
          kinds[ratio.size() % 2], ratio.size() % 3 == 0 ? Hardship::none : Hardship::turning);
      double const d = true_distance(m, 0);
      if (d < 1e-3) continue;
      double const reach = true_reach(m, (1 - share) * d, 1);
      if (reach == 1) continue;
      Clearance const clearance{.share = share};
      ratio.push_back(double(bound_of<T, Position, Real>(m, AdditiveCcd{}, clearance, T(1)).alpha) /
                      reach);
      closing.push_back(
          double(bound_of<T, Position, Real>(m, PairwiseClosing{}, clearance, T(1)).alpha) / reach);
    }
    std::sort(ratio.begin(), ratio.end());
    std::sort(closing.begin(), closing.end());
    CAPTURE(share, ratio[0], ratio[15], ratio[150], closing[15], closing[150]);
    CHECK(ratio[299] < 1 + 1e-3);
    CHECK(ratio[150] > 0.99);
    CHECK(ratio[15] > 0.95);
    CHECK(closing[150] > 0.3);
    CHECK(closing[150] < ratio[150]);
  }
}

TEMPLATE_LIST_TEST_CASE("sliding is free", "[step_bound]", AllScalars) {
  using T = typename TestType::T;
  using Position = typename TestType::Position;
  Samples samples(12);
  for (int k = 0; k < 500; ++k) {
    // A point or an edge a thousandth above the other body goes along it by up to ten times its
    // size; both share a velocity a hundred times that.
    PairMotion m{kinds[k % 2], {{0.25, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}};
    if (m.kind == PairKind::edge_edge) m.x[1] = {0.75, 0.75, 0};
    Vec3<double> const along = samples.vector(10);
    for (int v = 0; v < 4; ++v) {
      m.p[v] = {0.25, 1000, 0};
      if (v < m.first()) {
        m.x[v][2] = 0.0009765625;
        m.p[v] = {stored<float>(0.25 + along[0]), stored<float>(1000 + along[1]), 0};
      }
    }
    auto const r = bound_of<T, Position, float>(m, AdditiveCcd{}, {}, T(1));
    CAPTURE(k, double(r.alpha));
    CHECK(r.alpha == 1);
    CHECK(r.settled == Settled::direction);
  }
}

TEMPLATE_LIST_TEST_CASE("certificates settle most of what a contact scene asks", "[step_bound]",
                        AllScalars) {
  using T = typename TestType::T;
  using Position = typename TestType::Position;
  // Candidates up to 1.5 dhat apart, dhat 0.3 of an edge; each corner moves by up to 0.1 dhat in
  // each direction.
  Samples samples(13);
  Tally tally;
  int const count = 4000;
  for (int k = 0; k < count; ++k) {
    PairMotion m = samples.motion<Position, float>(kinds[k % 2], Hardship::parallel);
    Vec3<double> const lift =
        (samples.uniform(0, 0.45) / true_distance(m, 0)) * likely_directions(m, 0).at(0);
    for (int v = 0; v < 4; ++v) {
      if (v < m.first()) m.x[v] = m.x[v] + lift;
      m.p[v] = samples.vector(0.03);
      for (int c = 0; c < 3; ++c) {
        m.x[v][c] = stored<Position>(m.x[v][c]);
        m.p[v][c] = stored<float>(m.p[v][c]);
      }
    }
    ++tally.settled[int(bound_of<T, Position, float>(m, AdditiveCcd{}, {}, T(1)).settled)];
  }
  int const boxes = tally.settled[int(Settled::boxes)];
  int const direction = tally.settled[int(Settled::direction)];
  CAPTURE(boxes, direction, tally.settled[int(Settled::advance)], tally.settled[int(Settled::cut)]);
  CHECK(boxes > 0.9 * count);
  CHECK(boxes + direction > 0.99 * count);
  CHECK(tally.settled[int(Settled::uncertain)] == 0);
}

TEMPLATE_LIST_TEST_CASE("what nothing can be proved about gets no step", "[step_bound]",
                        AllScalars) {
  using T = typename TestType::T;
  using Position = typename TestType::Position;
  using Real = typename TestType::Real;
  Samples samples(14);
  auto const uncertain = [](PairMotion const& m, auto const& bound) {
    auto const r = bound_of<T, Position, Real>(m, bound, {}, T(1));
    return r.alpha == 0 && r.settled == Settled::uncertain;
  };
  double const bad[] = {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity};
  for (PairKind kind : kinds) {
    for (Hardship h : {Hardship::none, Hardship::tiny_gap, Hardship::sliding}) {
      for (int k = 0; k < 72; ++k) {
        PairMotion m = samples.motion<Position, Real>(kind, h);
        Vec3<double>& spoilt = k < 36 ? m.x[k % 4] : m.p[k % 4];
        spoilt[k / 4 % 3] = bad[k / 12 % 3];
        CAPTURE(int(kind), int(h), k);
        CHECK(uncertain(m, AdditiveCcd{}));
        CHECK(uncertain(m, PairwiseClosing{}));
        CHECK(uncertain(m, HalfDhatClamp{0.1}) == (k >= 36));
        auto const planar = vertex_bound_of<T, Position, Real>(m, PlanarScaling{}, {}, T(1));
        auto const isotropic =
            vertex_bound_of<T, Position, Real>(m, IsotropicPerVertex{}, {}, T(1));
        CHECK((planar.settled == Settled::uncertain && isotropic.settled == Settled::uncertain));
        CHECK((planar.alpha[k % 4] == 0 && isotropic.alpha[k % 4] == 0));
      }
    }
  }
  // Touching, crossing, and nearer than a thickness.
  PairMotion m{PairKind::point_triangle,
               {{0.25, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
               {{0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  CHECK(uncertain(m, AdditiveCcd{}));
  m.x[0][2] = 0.125;
  CHECK(!uncertain(m, AdditiveCcd{}));
  CHECK(bound_of<T, Position, Real>(m, AdditiveCcd{}, {.least = 0.125}, T(1)).alpha == 0);
  PairMotion const crossed{PairKind::edge_edge,
                           {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}},
                           {{0, 0, 1}, {0, 0, 1}, {0, 0, 0}, {0, 0, 0}}};
  CHECK(uncertain(crossed, AdditiveCcd{}));
  // At rest, anything goes.
  PairMotion rest = crossed;
  for (auto& p : rest.p) p = {0, 0, 0};
  CHECK(bound_of<T, Position, Real>(rest, AdditiveCcd{}, {}, T(1)).settled == Settled::at_rest);
}

TEST_CASE("a clearance keeps its share, its thickness, and no more than is ample", "[step_bound]") {
  Clearance const c{.share = 0.25, .least = 1, .ample = 2};
  CHECK(c.usable(0.5) == 0);
  CHECK(c.usable(1.0) == 0);
  CHECK(c.usable(2.0) == 0.25);
  CHECK(c.usable(3.0) == 0.5);
  CHECK(c.usable(11.0) == 10 - 1.5);
  CHECK(c.usable(std::numeric_limits<double>::quiet_NaN()) == 0);
  // A pair that is far apart may come as near as one at `ample` may.
  PairMotion const m{PairKind::point_triangle,
                     {{0.25, 0.25, 8}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                     {{0, 0, -16}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  auto const r = bound_of<double, double, double>(m, AdditiveCcd{}, {.ample = 0.5}, 1.0);
  CHECK(std::abs(r.alpha - 7.75 / 16) < 1e-12);
  CHECK(std::abs(r.kept - 0.25) < 1e-12);
}
