// Lists of candidates: growth, filters, distances of activation, and reuse over many steps.
#include "soups.hpp"

#include <support/threads.hpp>
#include <taut/contact/bvh.hpp>
#include <taut/contact/candidate_cache.hpp>
#include <taut/contact/spatial_hash.hpp>
#include <taut/core/fem/shapes.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::soups;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
using test::on_one_thread_and_all;

namespace {

using S = DefaultSpace;

int allocations = 0;
void count_allocation(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t) {
  ++allocations;
}
template <class F>
int allocations_of(F const& f) {
  allocations = 0;
  Kokkos::Tools::Experimental::set_allocate_data_callback(count_allocation);
  f();
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  return allocations;
}

Motion<Fp64, S> at(std::vector<Point> const& x) { return {to_field<double, S>(x)}; }

struct WritePairs {
  PairIds<S> ids;
  KOKKOS_FUNCTION void operator()(int k) const {
    for (int a = 0; a < 4; ++a) ids(k, a) = k + a;
  }
};
struct KeepThirds {
  int rest;
  KOKKOS_FUNCTION bool operator()(PairKind kind, int const (&v)[4],
                                  Vec3<double> const (&y)[4]) const {
    return kind == PairKind::edge_edge && v[0] % 3 == rest && y[3][0] == v[3];
  }
};

struct Activate {
  PairKind kind;
  PairIds<S> ids;
  Activation<S> activation;
  Kokkos::View<double*, S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const v[4] = {ids(k, 0), ids(k, 1), ids(k, 2), ids(k, 3)};
    to(k) = activation(kind, v);
  }
};

/// Two balls side by side, a gap apart along x.
struct TwoBalls {
  std::vector<Point> x;
  Surface surface;
  double edge_length = 0;
  int first_of_second = 0;
  explicit TwoBalls(double gap, int resolution = 4) {
    TetMesh const ball = make_shape(SphereShape{0.5}, resolution);
    first_of_second = static_cast<int>(ball.points.size());
    std::vector<Triangle> triangles;
    std::vector<int> object;
    for (int b = 0; b < 2; ++b) {
      for (Point v : ball.points) {
        v[0] += b * (1 + gap);
        x.push_back(v);
        object.push_back(b);
      }
      for (Triangle t : boundary_faces(ball.tets)) {
        for (std::int32_t& v : t) v += b * first_of_second;
        triangles.push_back(t);
      }
    }
    surface = make_surface(triangles, object);
    edge_length = edge_lengths(surface, x).mean;
  }
  Activation<S> activation(double dhat) const {
    return {
        .dhat = dhat, .rest = to_field<double, S>(x), .object = copy_surface<S>(surface).object};
  }
};

/// All pairs with the distances below which they act, computed on the host.
std::vector<std::pair<Pair, double>> all_activations(TwoBalls const& balls, double dhat) {
  std::vector<std::pair<Pair, double>> all;
  all_pairs(balls.surface, [&](Pair const& pair) {
    bool const one_body = balls.surface.object[pair.v[0]] == balls.surface.object[pair.v[3]];
    all.emplace_back(pair, one_body ? std::min(dhat, 0.5 * distance(pair, balls.x)) : dhat);
  });
  return all;
}

/// Pairs of a list whose distance, at one of two places, is not between what the cache says.
template <class Cache, PairKind kind>
int strays(Cache const& cache, CandidateList<kind, S> const& list, std::vector<Point> const& x,
           std::vector<Point> const& end) {
  FoundDistances<S> const found = cache.template distances<kind>();
  auto const at = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), found.at);
  FoundDistances<Space<Kokkos::DefaultHostExecutionSpace>> const known{at, found.moved};
  std::vector<std::array<int, 4>> const pairs = to_host(list);
  int count = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (auto const* where : {&x, &end}) {
      double const d = distance(Pair{kind, pairs[k]}, *where);
      count += !(known.least(int(k)) <= d && d <= known.most(int(k)));
    }
  }
  return count;
}

}  // namespace

TEST_CASE("a list grows, and allocates only then", "[contact]") {
  CandidateList<PairKind::edge_edge, S> list;
  CHECK(list.count() == 0);
  CHECK(allocations_of([&] { list.resize(1000); }) == 1);
  CHECK(allocations_of([&] {
          list.resize(10);
          list.resize(1500);  // half as much again was made
          list.resize(0);
        }) == 0);
  CHECK(allocations_of([&] { list.resize(1501); }) == 1);
  CHECK(list.count() == 1501);
  CHECK(list.ids().extent(0) == 1501);
  CHECK_THROWS_WITH(list.resize(std::int64_t(1) << 31), ContainsSubstring("2147483648"));
  CHECK(list.count() == 1501);
}

TEST_CASE("a filter leaves what it keeps, in order", "[contact]") {
  std::vector<Point> x(1010);
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = {double(v), 0, 0};
  auto const field = to_field<float, S>(x);
  for (int count : {0, 1, 2, 3, 1000}) {
    for (int rest = 0; rest < 4; ++rest) {  // 3: none is kept
      auto const filtered = [&] {
        CandidateList<PairKind::edge_edge, S> list;
        list.resize(count);
        for_each<S>("test_write", count, WritePairs{list.ids()});
        list.keep(KeepThirds{rest}, field);
        return to_host(list);
      };
      std::vector<std::array<int, 4>> expected;
      for (int k = rest; k < count && rest < 3; k += 3)
        expected.push_back({k, k + 1, k + 2, k + 3});
      for (auto const& pairs : on_one_thread_and_all(filtered)) CHECK((pairs == expected));
    }
  }
}

TEMPLATE_TEST_CASE("searches allocate nothing once the lists are long enough", "[contact]",
                   BruteForce<S>, SpatialHash<S>, Bvh<S>) {
  Soup const soup = make_soup(Kind::scattered, 0, 50);
  PairSearch<TestType> search(copy_surface<S>(soup.surface), soup.edge_length);
  auto const motion = at(soup.x);
  Candidates<S> found;
  auto const find = [&] {
    search.find(motion, soup.radius, found);
    found.keep(CloserThan<double>{0.5 * soup.radius}, motion.x);
  };
  CHECK(allocations_of(find) > 0);
  find();
  CHECK(allocations_of(find) == 0);
  search.find(motion, 5 * soup.radius, found);
  int const more = found.edge_edge.count();
  search.find(motion, soup.radius, found);
  CHECK(found.edge_edge.count() < more);
}

TEST_CASE("a list can be cut down to what is close", "[contact]") {
  for (int seed = 0; seed < 5; ++seed) {
    Soup const soup = make_soup(Kind::scattered, seed, 40);
    Candidates<S> found;
    PairSearch<SpatialHash<S>> search(copy_surface<S>(soup.surface), soup.edge_length);
    auto const motion = at(soup.x);
    search.find(motion, soup.radius, found);
    std::size_t const before = PairSet(to_host(found)).size();
    found.keep(CloserThan<double>{soup.radius}, motion.x);
    PairSet const left(to_host(found));
    CHECK(left.size() < before);
    std::size_t wrong = 0, close = 0;
    all_pairs(soup.surface, [&](Pair const& pair) {
      double const d = distance(pair, soup.x);
      close += d < soup.radius;
      // In the budget of round-off either answer is right.
      if (std::abs(d - soup.radius) > 1e-12) wrong += (d < soup.radius) != left.has(pair);
    });
    CHECK(wrong == 0);
    CHECK(close > 20);
  }
}

TEST_CASE("no pair acts at rest, and none is exempt", "[contact]") {
  TwoBalls const balls(0.1);
  double const dhat = balls.edge_length;  // far too much for a body by itself
  auto const activation = balls.activation(dhat);
  Candidates<S> found;
  PairSearch<SpatialHash<S>> search(copy_surface<S>(balls.surface), balls.edge_length);
  search.find(at(balls.x), 2 * dhat, found);
  std::size_t capped = 0, between = 0;
  auto const check = [&](auto const& list, PairKind kind) {
    Kokkos::View<double*, S::memory> const device("activations", list.count());
    for_each<S>("test_activations", list.count(), Activate{kind, list.ids(), activation, device});
    auto const acts = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), device);
    auto const pairs = to_host(list);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      double const d = distance({kind, pairs[k]}, balls.x), a = acts(k);
      bool const one_body = balls.surface.object[pairs[k][0]] == balls.surface.object[pairs[k][3]];
      if (one_body ? a <= 0 || a >= d || std::abs(a - std::min(dhat, 0.5 * d)) > 1e-12 * a
                   : a != dhat) {
        FAIL("pair " << k << " at " << d << " acts below " << a);
      }
      capped += a < dhat;
      between += one_body ? 0 : 1;
    }
  };
  check(found.point_triangle, PairKind::point_triangle);
  check(found.edge_edge, PairKind::edge_edge);
  CHECK(capped > 1000);
  CHECK(between > 100);
}

TEST_CASE("the paper's exclusion drops the pairs that are close at rest, and those alone",
          "[contact]") {
  TwoBalls const balls(0.3);
  double const dhat = 0.9 * balls.edge_length;
  // Later the second ball lies upon the first, so that many pairs are close that were not.
  std::vector<Point> x = balls.x;
  for (std::size_t v = balls.first_of_second; v < x.size(); ++v) {
    x[v] = {x[v][0] - 1.27, x[v][1] + 0.02, x[v][2] + 0.01};
  }
  Candidates<S> found;
  PairSearch<SpatialHash<S>> search(copy_surface<S>(balls.surface), balls.edge_length);
  auto const motion = at(x);
  search.find(motion, dhat, found);
  found.keep(CloserThan<double>{dhat}, motion.x);
  found.keep(RestExclusion<S>{1.5 * dhat, to_field<double, S>(balls.x)}, motion.x);
  PairSet const left(to_host(found));
  std::size_t wrong = 0, dropped = 0, kept = 0;
  all_pairs(balls.surface, [&](Pair const& pair) {
    double const d = distance(pair, x), rest = distance(pair, balls.x);
    if (std::abs(d - dhat) < 1e-12 || std::abs(rest - 1.5 * dhat) < 1e-12) return;
    bool const expected = d < dhat && rest >= 1.5 * dhat;
    wrong += left.has(pair) != expected;
    kept += expected;
    dropped += d < dhat && !expected;
  });
  CHECK(wrong == 0);
  CHECK(kept > 100);
  CHECK(dropped > 10);
}

TEMPLATE_TEST_CASE("a cache misses no pair over random walks", "[contact]", SpatialHash<S>,
                   Bvh<S>) {
  for (int seed = 0; seed < 4; ++seed) {
    TwoBalls const balls(0.25, 3);
    bool const long_steps = seed == 3;
    double const dhat = 0.3 * balls.edge_length;
    auto const activations = all_activations(balls, dhat);
    CandidateCache<TestType, Fp64> cache(copy_surface<S>(balls.surface), balls.edge_length,
                                         balls.activation(dhat),
                                         {.slack = long_steps ? 0.25 : 0.25 * (seed + 1)});
    std::vector<Point> x = balls.x;
    Random random(seed);
    int acting_steps = 0, impossible_steps = 0;
    std::size_t missed = 0, wrong = 0, unknown = 0, remembered = 0;
    for (int step = 0; step < 40; ++step) {
      // Both fall, sway towards each other and tremble.
      for (std::size_t v = 0; v < x.size(); ++v) {
        double const sway = static_cast<int>(v) < balls.first_of_second ? 1 : -1;
        Point const tremble = in_cube(random, 2e-3 * std::min(seed, 2) * dhat);
        x[v] = {x[v][0] + tremble[0] + 0.05 * dhat * sway, x[v][1] + tremble[1] - 0.01 * step,
                x[v][2] + tremble[2]};
      }
      Motion<Fp64, S> motion = at(x);
      std::vector<Point> end = x;
      if (step % 3 == 2) {
        std::vector<Point> p(x.size());
        for (std::size_t v = 0; v < x.size(); ++v) {
          p[v] = in_cube(random, long_steps ? 2 * dhat : 0.2 * dhat);
          for (int c = 0; c < 3; ++c) end[v][c] += 0.5 * p[v][c];
        }
        motion.p = to_field<double, S>(p);
        motion.alpha = 0.5;
      }
      Touch const touch = cache.update(motion);
      PairSet const found(to_host(cache.candidates()));
      bool acts = false;
      for (auto const& [pair, a] : activations) {
        double const d =
            motion.moves() ? std::min(distance(pair, x), distance(pair, end)) : distance(pair, x);
        if (d < std::max(a, 0.5 * dhat) && !found.has(pair)) ++missed;
        acts = acts || d < a;
      }
      unknown += strays(cache, cache.candidates().point_triangle, x, end);
      unknown += strays(cache, cache.candidates().edge_edge, x, end);
      remembered += cache.candidates().point_triangle.count();
      wrong += acts && touch == Touch::impossible;
      acting_steps += acts;
      impossible_steps += touch == Touch::impossible;
      if (long_steps && motion.moves()) {  // as after a line search
        double const part = 0.1 * (step % 10);
        for (std::size_t v = 0; v < x.size(); ++v)
          for (int c = 0; c < 3; ++c) x[v][c] += part * (end[v][c] - x[v][c]);
      }
    }
    INFO("seed " << seed);
    CHECK(missed == 0);
    CHECK(wrong == 0);
    CHECK(unknown == 0);
    CHECK(remembered > 100);
    CHECK(acting_steps > 5);
    CHECK((long_steps || impossible_steps > 2));
    CacheCounters const& counters = cache.counters();
    CHECK(counters.searches + counters.reuses == 40);
    CHECK(counters.skipped == impossible_steps);
    CHECK((long_steps ? counters.reuses > 10 : counters.reuses > counters.searches));
  }
}

TEMPLATE_TEST_CASE("candidates chosen among neighbours are complete, and at rest those of a search",
                   "[contact]", SpatialHash<S>, Bvh<S>) {
  TwoBalls const balls(0.25, 3);
  double const dhat = 0.3 * balls.edge_length;
  auto const surface = copy_surface<S>(balls.surface);
  // Without slack, what has moved is chosen anew.
  using Cache = CandidateCache<TestType, Fp64>;
  Cache cache(surface, balls.edge_length, balls.activation(dhat), {.slack = 0, .skin = 0.5});
  Cache fresh(surface, balls.edge_length, balls.activation(dhat), {.slack = 0, .skin = 0});
  std::vector<Point> x = balls.x;
  Random random(7);
  auto const activations = all_activations(balls, dhat);
  std::size_t different = 0, missed = 0, pairs = 0;
  int const steps = 60;
  for (int step = 0; step < steps; ++step) {
    // All fall and tremble, a few vertices go far, and from step 40 on the first ball turns over
    // in one step, and stays.
    for (std::size_t v = 0; v < x.size(); ++v) {
      Point const tremble = in_cube(random, 5e-3 * dhat), leap = in_cube(random, 0.7 * dhat);
      bool const leaps = v % 37 == std::size_t(step) % 37;
      for (int c = 0; c < 3; ++c) x[v][c] += tremble[c] + (leaps ? leap[c] : 0);
      x[v][1] -= 0.3;
      if (step == 40 && static_cast<int>(v) < balls.first_of_second) x[v][2] = -x[v][2];
    }
    Motion<Fp64, S> motion = at(x);
    std::vector<Point> end = x;
    if (step % 2 == 1) {
      std::vector<Point> p(x.size());
      for (std::size_t v = 0; v < x.size(); ++v) {
        p[v] = in_cube(random, v % 29 == 0 ? 2 * dhat : 0.05 * dhat);
        for (int c = 0; c < 3; ++c) end[v][c] += 0.5 * p[v][c];
      }
      motion.p = to_field<double, S>(p);
      motion.alpha = 0.5;
    }
    cache.update(motion);
    fresh.forget();
    fresh.update(motion);
    PairSet const a(to_host(cache.candidates())), b(to_host(fresh.candidates()));
    if (motion.moves()) {
      for (auto const& [pair, acts_below] : activations) {
        double const d = std::min(distance(pair, x), distance(pair, end));
        missed += d < std::max(acts_below, 0.5 * dhat) && !a.has(pair);
      }
    } else {
      different += a.missing_from(b) + b.missing_from(a);
    }
    pairs += std::size_t(cache.candidates().edge_edge.count());
  }
  CHECK(different == 0);
  CHECK(missed == 0);
  CHECK(pairs > 2000);
  NeighbourCounters const& counters = cache.neighbour_counters();
  CHECK(cache.counters().searches == steps);
  CHECK(counters.full < 6);
  CHECK(counters.partial > steps / 2);
  CHECK(counters.vertices < std::int64_t(x.size()) * counters.partial / 5);
  CHECK(fresh.neighbour_counters().partial == 0);
}

TEST_CASE("a cache searches when the bound asks for it, and not before", "[contact]") {
  TwoBalls const balls(0.05);
  double const dhat = 0.3 * balls.edge_length;
  CandidateCache<SpatialHash<S>, Fp64> cache(copy_surface<S>(balls.surface), balls.edge_length,
                                             balls.activation(dhat), {.slack = 0.5});
  std::vector<Point> x = balls.x;
  CHECK(cache.update(at(x)) == Touch::impossible);
  CHECK(cache.counters().searches == 1);

  // Free fall of all.
  for (Point& v : x) v[1] -= 100;
  CHECK(cache.update(at(x)) == Touch::impossible);
  CHECK(cache.counters().searches == 1);
  // Just less than two slacks against each other, then just more.
  for (int v = 0; v < balls.first_of_second; ++v) x[v][2] += 0.999 * dhat;
  cache.update(at(x));
  CHECK(cache.counters().searches == 1);
  for (int v = 0; v < balls.first_of_second; ++v) x[v][2] += 0.002 * dhat;
  cache.update(at(x));
  CHECK(cache.counters().searches == 2);
  // The end of a motion counts.
  Motion<Fp64, S> motion = at(x);
  std::vector<Point> p(x.size(), Point{0, 0, 0});
  p[0][2] = 2.2 * dhat;
  motion.p = to_field<double, S>(p);
  motion.alpha = 0.4;
  cache.update(motion);
  CHECK(cache.counters().searches == 2);
  motion.alpha = 0.5;
  cache.update(motion);
  CHECK(cache.counters().searches == 3);
  // A path that was searched along may be gone, in part or in full, and come back from.
  cache.update(motion);
  CHECK(cache.counters().searches == 3);
  x[0][2] += motion.alpha * p[0][2];
  motion = at(x);
  motion.p = to_field<double, S>(p);
  motion.alpha = -0.5;
  cache.update(motion);
  CHECK(cache.counters().searches == 3);
  // Just less than two slacks beside it, then just more.
  x[0][1] += 0.999 * dhat;
  cache.update(at(x));
  CHECK(cache.counters().searches == 3);
  x[0][1] += 0.002 * dhat;
  cache.update(at(x));
  CHECK(cache.counters().searches == 4);
  cache.forget();
  cache.update(at(x));
  CHECK(cache.counters().searches == 5);
  CHECK(cache.counters().reuses == 6);

  // A vertex that is nowhere is named, searching or not.
  int const v = balls.surface.vertices[3];
  Point const before = x[v];
  x[v][0] = NAN;
  CHECK_THROWS_WITH(cache.update(at(x)), ContainsSubstring(fmt::format("vertex {} is", v)));
  cache.forget();
  CHECK_THROWS_WITH(cache.update(at(x)), ContainsSubstring(fmt::format("vertex {} is", v)));
  x[v] = before;
  cache.update(at(x));
  CHECK(cache.counters().searches == 7);
}

TEST_CASE("neighbours in one body are no candidates until they come to act", "[contact]") {
  TwoBalls const balls(10);  // far apart
  double const dhat = 0.3 * balls.edge_length;
  CandidateCache<SpatialHash<S>, Fp64> cache(copy_surface<S>(balls.surface), balls.edge_length,
                                             balls.activation(dhat));
  CHECK(cache.update(at(balls.x)) == Touch::impossible);
  PairSearch<SpatialHash<S>> search(copy_surface<S>(balls.surface), balls.edge_length);
  Candidates<S> boxes;
  search.find(at(balls.x), 1.5 * dhat, boxes);
  CHECK(boxes.edge_edge.count() > 500);  // whose boxes overlap for ever
  CHECK(cache.candidates().point_triangle.count() == 0);
  CHECK(cache.candidates().edge_edge.count() < boxes.edge_edge.count() / 20);

  // Squashed flat, what was opposite acts.
  std::vector<Point> x = balls.x;
  for (Point& v : x) v[1] *= 0.01;
  CHECK(cache.update(at(x)) == Touch::possible);
  CHECK(cache.candidates().point_triangle.count() > 50);
}

TEST_CASE("a cache refuses distances that make no sense", "[contact]") {
  TwoBalls const balls(0.05);
  auto const surface = copy_surface<S>(balls.surface);
  using Cache = CandidateCache<SpatialHash<S>, Fp64>;
  auto activation = balls.activation(0);
  CHECK_THROWS_WITH(Cache(surface, 1, activation), ContainsSubstring("distance of 0 m"));
  activation.dhat = 1;
  activation.fraction = 1;
  CHECK_THROWS_WITH(Cache(surface, 1, activation), ContainsSubstring("between 0 and 1"));
  activation.fraction = 0.5;
  CHECK_THROWS_WITH(Cache(surface, 1, activation, {.slack = -1}), ContainsSubstring("slack of -1"));
}
