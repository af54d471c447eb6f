// Closest points against an independent search for the distance, in both precisions, over every
// kind of pair, and against what the features mean.
#include "pair_samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

#include <map>

using namespace taut;
using namespace taut::test::pairs;

namespace {

#ifdef NDEBUG
constexpr int per_family = 8'000;
#else
constexpr int per_family = 500;  // unoptimised, under sanitizers
#endif

template <class T>
struct Pair {
  Vec3<T> y[4];
  Vec3<long double> wide[4];  ///< the same numbers

  explicit Pair(Corners const& corners) {
    for (std::size_t a = 0; a < 4; ++a) {
      y[a] = cast<T>(corners[a]);
      wide[a] = cast<long double>(y[a]);
    }
  }
  /// |b| + |e1| + |e2|
  long double size(PairKind kind) const {
    return kind == PairKind::point_triangle
               ? norm(wide[0] - wide[1]) + norm(wide[2] - wide[1]) + norm(wide[3] - wide[1])
               : norm(wide[0] - wide[2]) + norm(wide[1] - wide[0]) + norm(wide[3] - wide[2]);
  }
  Vec3<long double> at(T const (&c)[4]) const {  // Sum_a c_a y_a in differences, as Sum_a c_a = 0
    Vec3<long double> t{};
    for (int a = 1; a < 4; ++a) t = t + static_cast<long double>(c[a]) * (wide[a] - wide[0]);
    return t;
  }
};

// Whether vertex a may have a coefficient.
bool touches(Feature feature, int a) {
  static std::map<Feature, std::string> const pattern{
      {Feature::face, "1111"},     {Feature::edge_01, "1110"},   {Feature::edge_12, "1011"},
      {Feature::edge_20, "1101"},  {Feature::vertex_0, "1100"},  {Feature::vertex_1, "1010"},
      {Feature::vertex_2, "1001"}, {Feature::edge_edge, "1111"}, {Feature::a0_b, "1011"},
      {Feature::a1_b, "0111"},     {Feature::a_b0, "1110"},      {Feature::a_b1, "1101"},
      {Feature::a0_b0, "1010"},    {Feature::a0_b1, "1001"},     {Feature::a1_b0, "0110"},
      {Feature::a1_b1, "0101"}};
  return pattern.at(feature)[std::size_t(a)] == '1';
}

}  // namespace

TEMPLATE_TEST_CASE("closest points are as close as a search finds, for every kind of pair",
                   "[contact]", float, double) {
  using T = TestType;
  constexpr auto epsilon = static_cast<long double>(std::numeric_limits<T>::epsilon());
  for (Family const& family : families()) {
    long double worst_distance = 0, worst_sum = 0, worst_point = 0;
    int outside = 0, wrong_features = 0;
    Random random(std::hash<std::string>{}(family.name));
    for (int k = 0; k < per_family; ++k) {
      Pair<T> const pair(family.draw(random));
      for (PairKind const kind : {PairKind::point_triangle, PairKind::edge_edge}) {
        auto const found = closest_points(kind, pair.y);
        long double const unit = epsilon * pair.size(kind);
        long double const expected = searched_distance(kind, pair.wide);
        if (unit > 0) {
          // A NaN fails these comparisons.
          auto const raise = [&](long double& worst, long double error) {
            if (!(error / unit <= worst)) worst = error / unit;
          };
          raise(worst_distance, std::abs(found.distance - expected));
          raise(worst_point, norm(pair.at(found.c) - cast<long double>(found.t)));
        } else {
          CHECK(found.distance == 0);
        }
        long double sum = 0;
        for (int a = 0; a < 4; ++a) {
          sum += found.c[a];
          bool const first = a == 0 || (a == 1 && kind == PairKind::edge_edge);
          T const share = first ? found.c[a] : -found.c[a];
          if (!(share >= 0 && share <= 1)) ++outside;
          if ((found.c[a] != 0) != touches(found.feature, a)) ++wrong_features;
        }
        if (kind_of(found.feature) != kind) ++wrong_features;
        worst_sum = std::max(worst_sum, std::abs(sum) / epsilon);
      }
    }
    INFO(family.name);
    CHECK(worst_distance < 4);
    CHECK(worst_point < 4);
    CHECK(worst_sum <= 1);
    CHECK(outside == 0);
    CHECK(wrong_features == 0);
  }
}

TEMPLATE_TEST_CASE("a pair made with a feature is found to have it", "[contact]", float, double) {
  using T = TestType;
  Random random(2);
  for (int k = 0; k < 500 * features; ++k) {
    auto const feature = static_cast<Feature>(k % features);
    double const size = log_uniform(random, 1e-3, 1e3);
    Pair<T> const pair(corners_of(random, feature, size * log_uniform(random, 1e-2, 0.3), size));
    auto const found = closest_points(kind_of(feature), pair.y);
    INFO("pair " << k);
    REQUIRE(found.feature == feature);
  }
}

TEMPLATE_TEST_CASE("closest points stay put where one feature passes into the next", "[contact]",
                   float, double) {
  // Round-off in the distances, which agree to second order there, must not decide: a foot
  // 1e-4 epsilon^(1/2) inside an edge is still inside, to full accuracy of the direction.
  using T = TestType;
  T const epsilon = std::numeric_limits<T>::epsilon();
  T const inside = T(1e-2) * std::sqrt(epsilon);
  for (T const height : {T(1), T(0.1), T(10)}) {
    Vec3<T> const above_face[4] = {{inside, inside, height}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    auto const face = closest_point_triangle(above_face);
    CHECK(face.feature == Feature::face);
    CHECK(std::abs(-face.c[2] - inside) < 2 * epsilon * inside);
    Vec3<T> const beside_edge[4] = {{inside, -inside, height}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    auto const edge = closest_point_triangle(beside_edge);
    CHECK(edge.feature == Feature::edge_01);
    CHECK(std::abs(-edge.c[2] - inside) < 2 * epsilon * inside);
    Vec3<T> const beyond_vertex[4] = {{-inside, -inside, height}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    CHECK(closest_point_triangle(beyond_vertex).feature == Feature::vertex_0);
    // Edge b starts at the origin and leads up and away from edge a, which passes below.
    Vec3<T> const end_of_b[4] = {{-inside, 0, -height}, {1, 0, -height}, {0, 0, 0}, {0, 1, 1}};
    auto const end = closest_edge_edge(end_of_b);
    CHECK(end.feature == Feature::a_b0);
    CHECK(std::abs(end.c[1] * (1 + inside) - inside) < 4 * epsilon * inside);
    Vec3<T> const both_ends[4] = {{inside, 0, -height}, {1, 0, -height}, {0, 0, 0}, {0, 1, 1}};
    CHECK(closest_edge_edge(both_ends).feature == Feature::a0_b0);
    Vec3<T> const across[4] = {{-inside, 0, -height}, {1, 0, -height}, {0, -inside, 0}, {0, 1, 0}};
    CHECK(closest_edge_edge(across).feature == Feature::edge_edge);
  }
}

TEST_CASE("parallel edges have the distance of the lines, and closest points that lie opposite",
          "[contact]") {
  Random random(3);
  for (int k = 0; k < 2000; ++k) {
    // Overlapping edges along a random direction, some turned by an angle down to round-off.
    Vec3<double> const along = uniform_direction(random), off = uniform_direction(random);
    Vec3<double> const across = cross(along, off);
    Vec3<double> const turned = along + log_uniform(random, 1e-18, 1e-12) * off;
    double const gap = log_uniform(random, 1e-3, 1) * norm(across);
    Vec3<double> const b0 = uniform(random, -0.5, 0.9) * along + (gap / norm(across)) * across;
    Vec3<double> const y[4] = {{0, 0, 0}, along, b0, b0 + uniform(random, 0.5, 1.0) * turned};
    auto const found = closest_edge_edge(y);
    double const overlap = std::min(1.0, dot(y[3], along)) - std::max(0.0, dot(y[2], along));
    if (overlap < 0.01) continue;
    CHECK(std::abs(found.distance - gap) < 1e-11);
    CHECK(std::abs(dot(found.t, along)) < 1e-11);
  }
}

TEST_CASE("closest points do not see translations and rotations", "[contact]") {
  Random random(4);
  for (int k = 0; k < 200 * features; ++k) {
    auto const feature = static_cast<Feature>(k % features);
    Corners const y = corners_of(random, feature, log_uniform(random, 1e-3, 0.3), 1);
    Vec3<double> const axis = uniform_direction(random), shift = uniform_vector(random, 5);
    double const angle = uniform(random, -3, 3);
    // Rodrigues
    auto const turn = [&](Vec3<double> const& v) {
      return std::cos(angle) * v + std::sin(angle) * cross(axis, v) +
             ((1 - std::cos(angle)) * dot(axis, v)) * axis;
    };
    Vec3<double> here[4], there[4];
    for (std::size_t a = 0; a < 4; ++a) {
      here[a] = y[a];
      there[a] = turn(y[a]) + shift;
    }
    auto const p = closest_points(kind_of(feature), here);
    auto const q = closest_points(kind_of(feature), there);
    REQUIRE(p.feature == q.feature);
    CHECK(norm(turn(p.t) - q.t) < 1e-13);
    for (int a = 0; a < 4; ++a) CHECK(std::abs(p.c[a] - q.c[a]) < 1e-12);
  }
}
