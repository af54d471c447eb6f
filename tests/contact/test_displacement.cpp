// Bounds of relative displacements against all pairs of vertices.
#include "soups.hpp"

#include <support/threads.hpp>
#include <taut/contact/displacement.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <limits>

using namespace taut;
using namespace taut::soups;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
using test::on_one_thread_and_all;

namespace {

using S = DefaultSpace;

/// Triangles of several bodies whose vertices come in turns.
Surface crowd(int triangles, int bodies) {
  std::vector<Triangle> corners;
  std::vector<int> object(std::size_t(3) * triangles);
  for (int t = 0; t < triangles; ++t) {
    Triangle triangle;
    for (int a = 0; a < 3; ++a) {
      triangle[a] = a * triangles + t;
      object[triangle[a]] = (7 * t) % bodies;
    }
    corners.push_back(triangle);
  }
  return make_surface(corners, object);
}

double apart(Point const& a, Point const& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// What `x` holds as numbers of T.
template <class T>
void round_to(std::vector<Point>& x) {
  for (Point& v : x)
    for (double& c : v) c = static_cast<double>(static_cast<T>(c));
}

}  // namespace

TEMPLATE_TEST_CASE("no two vertices have moved further against each other", "[contact]", Fp64,
                   Mixed, Fp32) {
  using Position = typename TestType::position;
  using Real = typename TestType::real;
  for (int bodies : {1, 2, 5}) {
    Surface const surface = crowd(700, bodies);  // more than one chunk per body
    Displacements<S> const displacements(copy_surface<S>(surface));
    CHECK(displacements.bodies() == bodies);
    for (int seed = 0; seed < 4; ++seed) {
      CAPTURE(bodies, seed);
      Random random(seed);
      std::size_t const n = surface.object.size();
      double const far = seed == 3 ? 1e4 : 1;
      std::vector<Point> origin(n), x(n), p(n), end(n);
      for (std::size_t v = 0; v < n; ++v) {
        origin[v] = in_cube(random, far);
        Point const own = in_cube(random, 0.01), step = in_cube(random, 0.01);
        for (int c = 0; c < 3; ++c) {
          // Bodies fly apart, and some of them while they move.
          x[v][c] = origin[v][c] + own[c] + (seed > 0 ? surface.object[v] : 0);
          p[v][c] = step[c] + (seed > 1 ? 2 * surface.object[v] : 0);
        }
      }
      round_to<Position>(x);
      round_to<Real>(p);
      Motion<TestType, S> motion{to_field<Position, S>(x)};
      double const alpha = 0.7;
      if (seed != 0) {
        motion.p = to_field<Real, S>(p);
        motion.alpha = alpha;
      }
      Departure<S> const since{to_field<double, S>(origin), {}, -1};
      auto const results =
          on_one_thread_and_all([&] { return displacements.measure(motion, since).all; });
      CHECK(results[0].within == results[1].within);
      CHECK(results[0].between == results[1].between);

      // Where the end is stored as well.
      for (std::size_t v = 0; v < n; ++v)
        for (int c = 0; c < 3; ++c) {
          end[v][c] = x[v][c];
          if (motion.moves()) {
            end[v][c] = static_cast<double>(
                static_cast<Position>(Position(x[v][c]) + Position(alpha) * Position(p[v][c])));
          }
        }
      double within = 0, between = 0;
      for (auto const* at : {&x, &end}) {
        std::vector<Point> u(n);
        for (std::size_t v = 0; v < n; ++v)
          for (int c = 0; c < 3; ++c) u[v][c] = (*at)[v][c] - origin[v][c];
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t j = 0; j < i; ++j) {
            double const d = apart(u[i], u[j]);
            between = std::max(between, d);
            if (surface.object[i] == surface.object[j]) within = std::max(within, d);
          }
      }
      CHECK(results[0].within >= within);
      CHECK(results[0].between >= between);
      // A box's diagonal is at most the root of three times its longest side, and start and end
      // share a box.
      double const rounding = 1e-3 * far * (std::is_same_v<Position, float> ? 1 : 0) + 1e-6;
      CHECK(results[0].between <= 2 * std::sqrt(3.0) * between + rounding);
      CHECK((bodies == 1) == (results[0].within == results[0].between));
      if (seed == 1 && bodies > 1) CHECK(results[0].within < 0.1 * results[0].between);
    }
  }
}

TEST_CASE("what bodies do as wholes counts between them alone", "[contact]") {
  Surface const surface = crowd(50, 3);
  Displacements<S> const displacements(copy_surface<S>(surface));
  Random random(1);
  std::vector<Point> origin(surface.object.size());
  for (Point& v : origin) v = in_cube(random, 1);
  std::vector<Point> x = origin;
  for (std::size_t v = 0; v < x.size(); ++v) {
    x[v][1] -= 100;  // all fall
    if (surface.object[v] == 2) x[v][0] += 3;
  }
  Motion<Fp64, S> const motion{to_field<double, S>(x)};
  Departure<S> const since{to_field<double, S>(origin), {}, -1};
  Moved const moved = displacements.measure(motion, since);
  Displacement const d = moved.all;
  CHECK(moved.off.within < 1e-12);
  CHECK_THAT(moved.off.between, WithinRel(d.between, 1e-12));
  CHECK(d.within < 1e-12);
  CHECK_THAT(d.between, WithinRel(3, 1e-12));
  CHECK(d.of(pair_length(true, 0.5f)) == d.within);
  CHECK(d.of(pair_length(false, 0.5f)) == d.between);
  CHECK(pair_length(true, -1) == 0);
  CHECK(pair_length(false, 0) == 0);

  x[4][2] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(displacements.measure(Motion<Fp64, S>{to_field<double, S>(x)}, since),
                    ContainsSubstring("vertex 4 is"));
  CHECK(Displacements<S>(copy_surface<S>(Surface{})).bodies() == 0);
}

TEST_CASE("what follows a path counts by how far it is off", "[contact]") {
  Surface const surface = crowd(300, 2);
  Displacements<S> const displacements(copy_surface<S>(surface));
  Random random(2);
  std::size_t const n = surface.object.size();
  std::vector<Point> origin(n), path(n), astray(n), x(n);
  for (std::size_t v = 0; v < n; ++v) {
    origin[v] = in_cube(random, 1);
    path[v] = in_cube(random, 1);
    astray[v] = in_cube(random, 0.01);
  }
  path[17] = {3, 0, 0};
  astray[17] = {0, 0, 0};
  Departure<S> const since{to_field<double, S>(origin), to_field<double, S>(path), 17,
                           to_field<double, S>(std::vector<Point>{origin[17], path[17]})};
  auto const at = [&](double s, double by) {
    for (std::size_t v = 0; v < n; ++v)
      for (int c = 0; c < 3; ++c) x[v][c] = origin[v][c] + s * path[v][c] + by * astray[v][c];
    return to_field<double, S>(x);
  };
  auto const measure = [&](double s, double by) {
    return displacements.measure(Motion<Fp64, S>{at(s, by)}, since);
  };
  for (double s : {0.0, 0.3, 1.0}) {
    CAPTURE(s);
    Moved const along = measure(s, 0);
    CHECK(along.off.between < 1e-12);
    CHECK((s == 0) == (along.all.between < 1e-12));
    CHECK_THAT(
        measure(s, 1).off.between,
        WithinRel(displacements.measure(Motion<Fp64, S>{at(0, 1)}, Departure<S>{since.from, {}, -1})
                      .all.between,
                  1e-9));
  }
  // Beyond either end of the path, what lies beyond counts.
  CHECK(measure(1.1, 0).off.between > 0.2);
  CHECK(measure(-0.1, 0).off.between > 0.2);
  // A motion along the path, from within it to its end and further.
  Motion<Fp64, S> motion{at(0.4, 0), since.path, 0.6};
  CHECK(displacements.measure(motion, since).off.between < 1e-12);
  motion.alpha = 0.7;
  CHECK(displacements.measure(motion, since).off.between > 0.2);
}
