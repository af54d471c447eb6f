// An edge and a triangle: every way to meet, by name, and soups of nearly and wholly degenerate
// ones against rational arithmetic.
#include "exact_oracle.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <string>

using namespace taut;
using namespace taut::test;

namespace {

using Five = std::array<Point, 5>;  // p, q, a, b, c
using Kind = std::optional<IntersectionKind>;

constexpr Kind apart = std::nullopt, crossing = IntersectionKind::crossing,
               touching = IntersectionKind::touching, overlap = IntersectionKind::overlap;

std::string name(Kind const& kind) {
  if (!kind) return "apart";
  return *kind == crossing ? "crossing" : *kind == touching ? "touching" : "overlap";
}

Kind judge(Five const& s) { return intersect(s[0], s[1], s[2], s[3], s[4]); }
Kind truth(Five const& s) { return oracle_intersect(s[0], s[1], s[2], s[3], s[4]); }

/// Both orders of the ends and all six of the corners agree.
bool same_in_any_order(Five s, Kind const& kind) {
  bool same = true;
  for (int swap = 0; swap < 2; ++swap, std::swap(s[0], s[1])) {
    std::sort(s.begin() + 2, s.end());
    do same = same && judge(s) == kind;
    while (std::next_permutation(s.begin() + 2, s.end()));
  }
  return same;
}

struct Tally {
  int cases = 0, wrong = 0, unordered = 0;
  std::array<int, 4> of{};  ///< apart, crossing, touching, overlap
  Five first{};

  void add(Five const& s) {
    Kind const kind = judge(s), right = truth(s);
    if (kind != right && wrong++ == 0) first = s;
    unordered += !same_in_any_order(s, right);
    ++of[right ? 1 + static_cast<std::size_t>(*right) : 0];
    ++cases;
  }
  /// And no kind was met less than `least` times.
  void check(int least) const {
    std::string at;
    for (Point const& x : first)
      for (double const c : x) at += std::to_string(c) + " ";
    INFO("first disagreement: " << at);
    CHECK(wrong == 0);
    CHECK(unordered == 0);
    INFO("apart " << of[0] << ", crossing " << of[1] << ", touching " << of[2] << ", overlap "
                  << of[3]);
    CHECK(*std::min_element(of.begin(), of.end()) >= least);
  }
};

using Random = std::mt19937_64;
/// The standard fixes the engine's numbers, not those of distributions.
int below(int n, Random& random) { return static_cast<int>(random() % static_cast<unsigned>(n)); }
double unit(Random& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

Five on_grid(int n, Random& random) {
  Five s;
  for (Point& x : s)
    for (double& c : x) c = below(n, random);
  return s;
}
Five mapped(Five s, std::function<double(double)> const& f) {
  for (Point& x : s)
    for (double& c : x) c = f(c);
  return s;
}

}  // namespace

TEST_CASE("every way that an edge and a triangle meet has its name", "[exact]") {
  Point const a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
  struct Case {
    char const* what;
    Point p, q;
    Kind kind;
  };
  for (auto const& [what, p, q, kind] : std::vector<Case>{
           {"through the inside", {1, 1, -1}, {1, 1, 1}, crossing},
           {"through a side", {2, 0, -1}, {2, 0, 1}, touching},
           {"through a corner", {4, 0, -1}, {4, 0, 1}, touching},
           {"beside a side", {2, -1e-300, -1}, {2, -1e-300, 1}, apart},
           {"just within a side", {2, 1e-300, -1}, {2, 1e-300, 1}, crossing},
           {"an end inside", {1, 1, 0}, {1, 1, 1}, touching},
           {"an end on a side", {2, 2, 0}, {5, 5, 5}, touching},
           {"an end on a corner", {0, 0, 0}, {-1, -1, 3}, touching},
           {"an end just above", {1, 1, 5e-324}, {1, 1, 1}, apart},
           {"parallel to the plane", {0, 0, 1}, {1, 1, 1}, apart},
           {"in the plane, inside", {0.5, 1, 0}, {1, 1.5, 0}, overlap},
           {"in the plane, right across", {-1, 1, 0}, {9, 1, 0}, overlap},
           {"in the plane, from inside to outside", {1, 1, 0}, {9, 9, 0}, overlap},
           {"in the plane, from a side inward", {2, 0, 0}, {2, 1, 0}, overlap},
           {"in the plane, from a side outward", {2, 0, 0}, {2, -1, 0}, touching},
           {"in the plane, past a corner", {3, -1, 0}, {5, 1, 0}, touching},
           {"in the plane, through a corner and inward", {-1, -1, 0}, {1, 1, 0}, overlap},
           {"in the plane, along a side", {1, 0, 0}, {2, 0, 0}, overlap},
           {"in the plane, along a side and past it", {3, 0, 0}, {9, 0, 0}, overlap},
           {"a side itself", {4, 0, 0}, {0, 4, 0}, overlap},
           {"in line with a side, at its corner", {4, 0, 0}, {5, 0, 0}, touching},
           {"in line with a side, beyond", {5, 0, 0}, {6, 0, 0}, apart},
           {"in the plane, outside", {3, 3, 0}, {4, 2, 0}, apart},
           {"in the plane, in the box, outside", {3, 2, 0}, {2, 3, 0}, apart},
           {"no length, inside", {1, 1, 0}, {1, 1, 0}, touching},
           {"no length, on a side", {2, 2, 0}, {2, 2, 0}, touching},
           {"no length, outside", {3, 3, 0}, {3, 3, 0}, apart},
           {"no length, above", {1, 1, 1}, {1, 1, 1}, apart}}) {
    INFO(what);
    Five const s{p, q, a, b, c};
    CHECK(name(judge(s)) == name(kind));
    CHECK(name(truth(s)) == name(kind));
    CHECK(same_in_any_order(s, kind));
  }
}

TEST_CASE("triangles without area are the segments or points that they are", "[exact]") {
  struct Case {
    char const* what;
    Five s;
    Kind kind;
  };
  Point const o{0, 0, 0}, m{1, 1, 1}, e{2, 2, 2};
  for (auto const& [what, s, kind] : std::vector<Case>{
           {"across a needle", {Point{1, 0, 1}, Point{1, 2, 1}, o, m, e}, touching},
           {"at a needle's end", {Point{2, 2, 2}, Point{3, 0, 1}, o, m, e}, touching},
           {"past a needle's end", {Point{3, 2, 3}, Point{3, 4, 3}, o, m, e}, apart},
           {"along a needle", {Point{0.5, 0.5, 0.5}, Point{3, 3, 3}, o, m, e}, overlap},
           {"in line with a needle, at its end", {e, Point{3, 3, 3}, o, m, e}, touching},
           {"in line with a needle, beyond", {Point{3, 3, 3}, Point{4, 4, 4}, o, m, e}, apart},
           {"parallel to a needle", {Point{0, 0, 1}, Point{1, 1, 2}, o, m, e}, apart},
           {"skew to a needle", {Point{1, 0, 2}, Point{1, 2, 2}, o, m, e}, apart},
           {"no length, on a needle", {m, m, o, o, e}, touching},
           {"no length, beside a needle", {Point{1, 1, 2}, Point{1, 1, 2}, o, m, e}, apart},
           {"through a point", {o, e, m, m, m}, touching},
           {"ends at a point", {m, e, m, m, m}, touching},
           {"past a point", {o, Point{2, 2, 3}, m, m, m}, apart},
           {"point on point", {m, m, m, m, m}, touching},
           {"point beside point", {m, m, e, e, e}, apart}}) {
    INFO(what);
    CHECK(name(judge(s)) == name(kind));
    CHECK(name(truth(s)) == name(kind));
    CHECK(same_in_any_order(s, kind));
  }
}

TEST_CASE("soups on a small grid agree with rational arithmetic", "[exact]") {
  // Few points to choose from: every degenerate case is common.
  Random random(1);
  Tally tally;
  for (int k = 0; k < 12000; ++k) tally.add(on_grid(2 + k % 3, random));
  tally.check(40);
}

TEST_CASE("soups that rounding has just spoilt agree with rational arithmetic", "[exact]") {
  // What was degenerate on the grid is so no more, or still is; no rounded determinant can tell.
  Random random(2);
  Tally tally;
  for (int k = 0; k < 6000; ++k) {
    Five s = mapped(on_grid(4, random), [](double c) { return 0.1 * c + 0.7; });
    if (k % 2 == 0) {
      double& c = s[below(5, random)][below(3, random)];
      c = std::nextafter(c, below(2, random) == 0 ? -1.0 : 2.0);
    }
    tally.add(s);
  }
  tally.check(5);
}

TEST_CASE("ends that were computed to lie on the triangle agree with rational arithmetic",
          "[exact]") {
  Random random(3);
  int wrong = 0, met = 0, missed = 0;
  for (int k = 0; k < 1500; ++k) {
    Five s;
    for (Point& x : s)
      for (double& c : x) c = unit(random) - 0.5;
    if (k % 3 == 0)  // a needle: the third corner on the line of the others, but for rounding
      for (std::size_t i = 0; i < 3; ++i) s[4][i] = s[2][i] + 0.3 * (s[3][i] - s[2][i]);
    double const u = unit(random), v = (1 - u) * unit(random);
    for (std::size_t i = 0; i < 3; ++i)
      s[0][i] = s[2][i] + u * (s[3][i] - s[2][i]) + v * (s[4][i] - s[2][i]);
    Kind const right = truth(s);
    wrong += judge(s) != right;
    (right ? met : missed) += 1;
  }
  CHECK(wrong == 0);
  CHECK(met > 100);
  CHECK(missed > 100);
}

TEST_CASE("soups in single precision agree with rational arithmetic", "[exact]") {
  Random random(4);
  Tally tally;
  for (int k = 0; k < 4000; ++k) {
    tally.add(mapped(on_grid(4, random), [&](double c) {
      float const x = 0.1f * static_cast<float>(c) + 3.3f;
      return k % 2 == 0 || below(20, random) > 0 ? x : std::nextafter(x, 9.0f);
    }));
  }
  tally.check(5);
}

TEST_CASE("no coordinate is too large or too small", "[exact]") {
  // Products of three lengths leave the doubles at both ends, from 1e103 and 1e-108 on.
  double const scale =
      GENERATE(0x1p1021, 1e200, 1e110, 1e-105, 1e-150, 1e-300, 4.9406564584124654e-324);
  INFO("scale " << scale);
  Random random(5);
  Tally tally;
  for (int k = 0; k < 400; ++k) {
    tally.add(mapped(on_grid(3, random), [&](double c) { return (c - 1) * scale; }));
  }
  tally.check(1);
}

TEST_CASE("large and small coordinates may meet in one pair", "[exact]") {
  double const values[] = {0, 1, -1, 1e300, -1e300, 1e-300, 5e-324, 1 + 0x1p-52, 0x1p53};
  Random random(6);
  Tally tally;
  for (int k = 0; k < 80; ++k) {
    tally.add(mapped(on_grid(9, random), [&](double c) { return values[static_cast<int>(c)]; }));
  }
  tally.check(0);
  CHECK(tally.of[1] + tally.of[2] > 0);
}
