// What is computed of a pack of pairs at once, against the same of each pair.
#include "pair_samples.hpp"

#include <taut/contact/pair.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::test::pairs;

namespace {

constexpr int per_family = 500;

/// A pack of pairs, and each of them.
template <class T>
struct Pack {
  using Lanes = HostPack<T>;
  static constexpr int lanes = ScalarTraits<Lanes>::lanes;
  Vec3<T> one[lanes][4];
  Vec3<Lanes> all[4];

  /// Pairs that `draw()` gives.
  template <class Draw>
  explicit Pack(Draw const& draw) {
    for (auto& y : one) {
      Corners const corners = draw();
      for (std::size_t a = 0; a < 4; ++a) y[a] = cast<T>(corners[a]);
    }
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) {
        all[a][c] = Lanes([&](std::size_t i) { return one[i][a][c]; });
      }
  }
};

template <class T>
T size_of(Vec3<T> const (&y)[4]) {
  return norm(y[1] - y[0]) + norm(y[2] - y[0]) + norm(y[3] - y[0]);
}

/// The largest difference of two, over `unit`.
template <class T>
void raise(double& worst, T a, T b, T unit) {
  double const error = double(std::abs(a - b)) / double(unit);
  if (!(error <= worst)) worst = error;  // not a number stays
}

}  // namespace

TEMPLATE_TEST_CASE("closest points of a pack are those of its pairs", "[contact]", float, double) {
  using T = TestType;
  constexpr T epsilon = std::numeric_limits<T>::epsilon();
  for (Family const& family : families()) {
    INFO(family.name);
    Random random(std::hash<std::string>{}(family.name));
    double distances = 0, points = 0, sums = 0;
    int outside = 0;
    for (int k = 0; k < per_family; ++k) {
      Pack<T> const pack([&] { return family.draw(random); });
      for (PairKind const kind : {PairKind::point_triangle, PairKind::edge_edge}) {
        auto const found = closest_points(kind, pack.all);
        auto const gap = square_box_gap(kind, pack.all);
        for (int i = 0; i < pack.lanes; ++i) {
          auto const& y = pack.one[i];
          T const unit = epsilon * size_of(y);
          if (!(unit > 0)) continue;
          raise(distances, lane(found.distance, i), closest_points(kind, y).distance, unit);
          Vec3<T> t{};
          T sum = 0;
          for (int a = 0; a < 4; ++a) {
            T const c = lane(found.c[a], i);
            sum += c;
            t = t + c * (y[a] - y[0]);
            outside += !(std::abs(c) <= 1);
          }
          for (int c = 0; c < 3; ++c) raise(points, t[c], lane(found.t[c], i), unit);
          raise(sums, sum, T(0), epsilon);
          CHECK(lane(gap, i) == square_box_gap(kind, y));
        }
      }
    }
    CHECK(distances < 8);
    CHECK(points < 8);
    CHECK(sums <= 2);
    CHECK(outside == 0);
  }
}

TEMPLATE_TEST_CASE("energies of a pack are those of its pairs", "[contact]", LogBarrier, IpcBarrier,
                   LogSquaredBarrier, CubicBarrier) {
  using T = double;
  using Energy = PairEnergy<Normalised<TestType>>;
  using Lanes = HostPack<T>;
  Random random(5);
  int acting = 0, passed = 0;
  double values = 0, gradients = 0, blocks = 0, factors = 0, changes = 0;
  for (int k = 0; k < 4000; ++k) {
    PairKind const kind = k % 2 == 0 ? PairKind::point_triangle : PairKind::edge_edge;
    double const gap = log_uniform(random, 1e-3, 2), size = log_uniform(random, 0.5, 20);
    Pack<T> const pack([&] {
      auto const feature = static_cast<Feature>(k % 2 == 0 ? k / 2 % 7 : 7 + k / 2 % 9);
      return corners_of(random, feature, gap, size);
    });
    Pack<T> const move([&] {
      Corners c;
      for (auto& p : c) p = 0.3 * gap * uniform_vector(random);
      return c;
    });
    PairParameters<T> const parameters{2, 1, k % 2 == 0 ? 0 : 10 / (size * size)};
    PairParameters<Lanes> const same{Lanes(2.), Lanes(1.), Lanes(parameters.mollifier_scale)};
    auto const s = Energy::evaluate(kind, same, pack.all);
    auto const change = Energy::change(kind, same, s, move.all);
    auto const factor = GaussNewtonCurvature::over_gradient(s);
    for (int i = 0; i < pack.lanes; ++i) {
      auto const& y = pack.one[i];
      auto const expected = Energy::evaluate(kind, parameters, y);
      Vec3<T> before[4];
      for (int a = 0; a < 4; ++a) before[a] = y[a] - move.one[i][a];
      bool const mollified =
          expected.m.active || Energy::evaluate(kind, parameters, before).m.active;
      if (mollified) {
        ++passed;
        continue;
      }
      // The distance has an error of round-off, which the logarithm magnifies.
      double const d = expected.at.distance, unit = std::max(size / d, 1.0);
      double const scale = std::max(std::abs(expected.b1), 1e-3);
      raise(values, lane(Energy::value(s), i), Energy::value(expected),
            unit * std::max(expected.b, 1e-6));
      double const dE = Energy::change(kind, parameters, expected, move.one[i]);
      raise(changes, lane(change, i), dE, unit * std::max({expected.b, std::abs(dE), 1e-6}));
      for (int a = 0; a < 4; ++a) {
        auto const g = Energy::gradient(expected, a);
        auto const h = Energy::block(expected, a);
        for (int c = 0; c < 3; ++c) {
          raise(gradients, lane(Energy::gradient(s, a)[c], i), g[c], unit * scale);
        }
        for (int c = 0; c < 6; ++c) {
          raise(blocks, lane(Energy::block(s, a).s[c], i), h.s[c],
                unit * std::max(expected.b2, 1e-2));
        }
      }
      if (expected.at.distance < 0.99) {
        ++acting;
        double const f = GaussNewtonCurvature::over_gradient(expected);
        raise(factors, lane(factor, i), f, unit * f);
        // H = f g g'
        auto const g = Energy::gradient(expected, 0);
        auto const h = GaussNewtonCurvature::block(expected, 0, 0);
        raise(factors, f * g[0] * g[1], h(0, 1), unit * std::max(expected.b2, 1e-2));
      }
    }
  }
  CHECK(acting > 1000);
  CHECK(passed < acting);
  CHECK(values < 1e-10);
  CHECK(changes < 1e-10);
  CHECK(gradients < 1e-10);
  CHECK(blocks < 1e-10);
  CHECK(factors < 1e-10);
}
