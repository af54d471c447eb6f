// The drawing of pairs and the search for their distance, which the tests of pairs share.
#include "pair_samples.hpp"

#include <catch2/catch_test_macros.hpp>

#include <algorithm>

namespace taut::test::pairs {
namespace {

Vec3<double> unit(Vec3<double> const& v) { return (1 / norm(v)) * v; }

// A unit vector for which `keep` holds.
template <class Keep>
Vec3<double> direction(Random& random, Keep const& keep) {
  for (;;) {
    Vec3<double> const v = uniform_direction(random);
    if (keep(v)) return v;
  }
}

Vec3<double> normal_to(Random& random, Vec3<double> const& v) {
  Vec3<double> const other =
      direction(random, [&](auto const& w) { return norm(cross(w, unit(v))) > 0.1; });
  return unit(cross(v, other));
}

Corners corners_of_triangle(Random& random, Feature feature, double gap, double size) {
  Vec3<double> const d1 = uniform_direction(random);
  Vec3<double> const d2 =
      direction(random, [&](auto const& w) { return norm(cross(w, d1)) > 0.6; });
  Corners y;
  y[1] = uniform_vector(random, size);
  y[2] = y[1] + size * uniform(random, 0.5, 1.5) * d1;
  y[3] = y[1] + size * uniform(random, 0.5, 1.5) * d2;
  Vec3<double> const normal = unit(cross(y[2] - y[1], y[3] - y[1]));
  double const side = random() % 2 == 0 ? 1 : -1;
  int const k = static_cast<int>(feature);
  if (feature == Feature::face) {
    double const w1 = uniform(random, 0.2, 0.4), w2 = uniform(random, 0.2, 0.4);
    y[0] = y[1] + w1 * (y[2] - y[1]) + w2 * (y[3] - y[1]) + side * gap * normal;
  } else if (feature <= Feature::edge_20) {
    int const from = k, to = 1 + k % 3;
    Vec3<double> const e = y[to] - y[from], outward = unit(cross(e, normal));
    double const angle = uniform(random, -1.4, 1.4);
    y[0] = y[from] + uniform(random, 0.2, 0.8) * e +
           gap * (std::cos(angle) * outward + std::sin(angle) * normal);
  } else {
    int const at = k - static_cast<int>(Feature::vertex_0);
    Vec3<double> const v = y[1 + at];
    Vec3<double> const e1 = unit(y[1 + (at + 1) % 3] - v), e2 = unit(y[1 + (at + 2) % 3] - v);
    y[0] = v + gap * direction(random, [&](auto const& w) {
                 return dot(w, e1) < -0.1 && dot(w, e2) < -0.1;
               });
  }
  return y;
}

Corners corners_of_edges(Random& random, Feature feature, double gap, double size) {
  Vec3<double> const origin = uniform_vector(random, size);
  double const length_a = size * uniform(random, 0.5, 1.5),
               length_b = size * uniform(random, 0.5, 1.5);
  Corners y;
  if (feature == Feature::edge_edge) {
    Vec3<double> const a = uniform_direction(random);
    Vec3<double> const b =
        direction(random, [&](auto const& w) { return norm(cross(w, a)) > 0.3; });
    double const s = uniform(random, 0.2, 0.8), u = uniform(random, 0.2, 0.8);
    double const side = random() % 2 == 0 ? 1 : -1;
    y[0] = origin - s * length_a * a + side * gap * unit(cross(a, b));
    y[1] = y[0] + length_a * a;
    y[2] = origin - u * length_b * b;
    y[3] = y[2] + length_b * b;
    return y;
  }
  // From the end at `from` the edge leads away from the other, whose closest point is `at`.
  Vec3<double> const n = uniform_direction(random);
  auto const leads = [&](double sign) {
    return direction(random, [&](auto const& w) { return sign * dot(w, n) > 0.2; });
  };
  int const k = static_cast<int>(feature);
  bool const ends = feature >= Feature::a0_b0;
  bool const inside_b = feature == Feature::a0_b || feature == Feature::a1_b;
  int end_of_a = 0, end_of_b = 0;
  if (ends) {
    end_of_a = (k - static_cast<int>(Feature::a0_b0)) / 2;
    end_of_b = (k - static_cast<int>(Feature::a0_b0)) % 2;
  } else {
    end_of_a = end_of_b = (k - static_cast<int>(Feature::a0_b)) % 2;
  }
  if (ends || inside_b) {
    y[end_of_a] = origin + gap * n;
    y[1 - end_of_a] = y[end_of_a] + length_a * leads(1);
  } else {
    Vec3<double> const a = normal_to(random, n);
    y[0] = origin + gap * n - uniform(random, 0.2, 0.8) * length_a * a;
    y[1] = y[0] + length_a * a;
  }
  if (ends || !inside_b) {
    y[2 + end_of_b] = origin;
    y[3 - end_of_b] = origin + length_b * leads(-1);
  } else {
    Vec3<double> const b = normal_to(random, n);
    y[2] = origin - uniform(random, 0.2, 0.8) * length_b * b;
    y[3] = y[2] + length_b * b;
  }
  return y;
}

// The least value of a convex function on [0, 1].
template <class Function>
long double least(Function const& f) {
  long double const ratio = (std::sqrt(5.0L) - 1) / 2;
  long double from = 0, to = 1, best = std::min(f(0.0L), f(1.0L));
  long double left = 1 - ratio, right = ratio;
  long double at_left = f(left), at_right = f(right);
  for (int k = 0; k < 90; ++k) {
    best = std::min({best, at_left, at_right});
    if (at_left < at_right) {
      to = right;
      right = left;
      at_right = at_left;
      left = to - ratio * (to - from);
      at_left = f(left);
    } else {
      from = left;
      left = right;
      at_left = at_right;
      right = from + ratio * (to - from);
      at_right = f(right);
    }
  }
  return best;
}

long double to_segment(Vec3<long double> const& b, Vec3<long double> const& e) {
  long double const ee = dot(e, e);
  long double const s = ee > 0 ? std::clamp(dot(b, e) / ee, 0.0L, 1.0L) : 0;
  return norm(b - s * e);
}

}  // namespace

Corners corners_of(Random& random, Feature feature, double gap, double size) {
  return kind_of(feature) == PairKind::point_triangle
             ? corners_of_triangle(random, feature, gap, size)
             : corners_of_edges(random, feature, gap, size);
}

long double searched_distance(PairKind kind, Vec3<long double> const (&y)[4]) {
  if (kind == PairKind::point_triangle) {
    Vec3<long double> const b = y[0] - y[1], e1 = y[2] - y[1], e2 = y[3] - y[1];
    return least([&](long double v) { return to_segment(b - v * e2, (1 - v) * e1); });
  }
  Vec3<long double> const b = y[0] - y[2], e1 = y[1] - y[0], e2 = y[3] - y[2];
  return least([&](long double s) { return to_segment(b + s * e1, e2); });
}

std::vector<Family> families() {
  auto const pick = [](Random& r) { return static_cast<std::size_t>(r() % 4); };
  auto const in_a_feature = [](Random& r, double gap) {
    return corners_of(r, static_cast<Feature>(r() % features), gap, 1);
  };
  std::vector<Family> all;
  all.push_back({"random", [](Random& r) { return uniform_corners(r); }});
  all.push_back({"every feature, close",
                 [=](Random& r) { return in_a_feature(r, log_uniform(r, 1e-9, 1)); }});
  all.push_back({"every feature, far from the origin", [=](Random& r) {
                   Corners y = in_a_feature(r, 1e-4);
                   Vec3<double> const origin = uniform_vector(r, 1e3);
                   for (auto& v : y) v = v + origin;
                   return y;
                 }});
  all.push_back({"needles and nearly parallel edges", [](Random& r) {
                   Corners y = uniform_corners(r);
                   double const off = log_uniform(r, 1e-14, 1e-1);
                   y[3] = y[1] + uniform(r, -0.5, 1.5) * (y[2] - y[1]) + uniform_vector(r, off);
                   if (r() % 2 == 0) {  // as edges
                     y[2] = uniform_vector(r);
                     y[3] = y[2] + uniform(r, -1.5, 1.5) * (y[1] - y[0]) + uniform_vector(r, off);
                   }
                   return y;
                 }});
  all.push_back({"needles, close", [](Random& r) {
                   Corners y = uniform_corners(r);
                   double const off = log_uniform(r, 1e-14, 1e-1);
                   y[3] = y[1] + uniform(r, -0.5, 1.5) * (y[2] - y[1]) + uniform_vector(r, off);
                   y[0] = y[1] + uniform(r, -0.1, 1.1) * (y[2] - y[1]) +
                          uniform_vector(r, log_uniform(r, 1e-14, 1e-1));
                   return y;
                 }});
  all.push_back({"exactly parallel edges", [](Random& r) {
                   Corners y = uniform_corners(r);
                   for (auto& v : y)
                     for (int c = 0; c < 3; ++c) v[c] = std::round(16 * v[c]) / 16;
                   double const stretch = static_cast<double>(r() % 9) / 4 - 1;
                   y[3] = y[2] + stretch * (y[1] - y[0]);
                   return y;
                 }});
  all.push_back({"coplanar", [](Random& r) {
                   Corners y = uniform_corners(r);
                   for (auto& v : y) v[2] = 0.25;
                   return y;
                 }});
  all.push_back({"collinear", [](Random& r) {
                   Vec3<double> const at = uniform_vector(r), along = uniform_direction(r);
                   Corners y;
                   for (auto& v : y) v = at + uniform(r, -1, 1) * along;
                   return y;
                 }});
  all.push_back({"small integers: coinciding, collinear, touching", [](Random& r) {
                   Corners y;
                   for (auto& v : y) v = {double(r() % 3), double(r() % 3), double(r() % 3)};
                   return y;
                 }});
  all.push_back({"coinciding vertices", [=](Random& r) {
                   Corners y = uniform_corners(r);
                   for (auto n = 1 + r() % 3; n > 0; --n) y[pick(r)] = y[pick(r)];
                   return y;
                 }});
  all.push_back({"point on an edge or in the triangle, edges that cross", [](Random& r) {
                   Corners y = uniform_corners(r);
                   double const s = uniform(r, 0, 1), u = r() % 2 == 0 ? 0 : uniform(r, 0, 1 - s);
                   y[0] = y[1] + s * (y[2] - y[1]) + u * (y[3] - y[1]);
                   if (r() % 2 == 0) {  // as edges
                     y = uniform_corners(r);
                     y[1] = y[0] + uniform(r, 1, 3) * (y[2] + s * (y[3] - y[2]) - y[0]);
                   }
                   return y;
                 }});
  all.push_back({"edges of very different length", [=](Random& r) {
                   Corners y = in_a_feature(r, log_uniform(r, 1e-6, 1e-1));
                   std::size_t const k = pick(r), other = (k + 1) % 4;
                   y[k] = y[other] + log_uniform(r, 1e-7, 1e-2) * (y[k] - y[other]);
                   return y;
                 }});
  auto const scaled = [=](double from, double to) {
    return [=](Random& r) {
      Corners y = in_a_feature(r, log_uniform(r, 1e-3, 1));
      double const scale = log_uniform(r, from, to);
      for (auto& v : y) v = scale * v;
      return y;
    };
  };
  all.push_back({"tiny", scaled(1e-10, 1e-3)});
  all.push_back({"huge", scaled(1e3, 1e15)});
  return all;
}

TEST_CASE("the search for a distance finds the gap that a pair was made with", "[contact]") {
  Random random(1);
  for (int k = 0; k < 50 * features; ++k) {
    auto const feature = static_cast<Feature>(k % features);
    double const gap = log_uniform(random, 1e-5, 0.2);
    Corners const y = corners_of(random, feature, gap, 1);
    Vec3<long double> w[4];
    for (int a = 0; a < 4; ++a) w[a] = cast<long double>(y[std::size_t(a)]);
    auto const found = double(searched_distance(kind_of(feature), w));
    INFO("feature " << k % features << ", gap " << gap);
    CHECK(std::abs(found - gap) < 1e-14);
  }
}

}  // namespace taut::test::pairs
