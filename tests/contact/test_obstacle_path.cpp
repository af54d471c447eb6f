// What the step bound of an obstacle promises, against distances in extended precision: that the
// vertex keeps its clearance all along the step, and where any part of the step is stored. And that
// it is not needlessly short.
#include "obstacle_oracle.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <limits>
#include <tuple>

using namespace taut;
using namespace taut::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr FaceKind kinds[] = {FaceKind::plane, FaceKind::sphere, FaceKind::cylinder};

template <class Position, class Real>
FacePath path_of(FaceSample const& s, FaceMotion const& motion = {}) {
  Vec3<Position> x;
  Vec3<Real> p;
  for (int c = 0; c < 3; ++c) {
    x[c] = Position(s.x[c]);
    p[c] = Real(s.p[c]);
  }
  return FacePath(x, p, s.origin, s.face, motion);
}

/// Whether the distance is `kept` where the step, and parts of it, are stored.
template <class Position>
bool lands_apart(FaceSample const& s, double alpha, double kept) {
  bool apart = true;
  for (double share : {1.0, 0.999, 0.5, 0.3, 1e-3, 1e-9}) {
    for (bool fused : {false, true}) {
      Vec3<double> const to = stored_after<Position>(s.x, s.p, share * alpha, fused);
      apart = apart && long_distance(s.face, s.origin, to_long(to)) >= kept;
    }
  }
  return apart;
}

}  // namespace

TEMPLATE_TEST_CASE("no step along which a vertex is bounded loses its clearance", "[obstacle]",
                   (std::tuple<double, double>), (std::tuple<double, float>),
                   (std::tuple<float, float>)) {
  using Position = std::tuple_element_t<0, TestType>;
  using Real = std::tuple_element_t<1, TestType>;
  constexpr double unit = Kokkos::Experimental::epsilon_v<Position> / 2;
  Samples random(11);
  int violations = 0, uncertain = 0, cut = 0, whole = 0, blunt = 0, compared = 0;
  double bluntest = 1;
  for (int path = 0; path < static_cast<int>(Path::count); ++path) {
    for (FaceKind kind : kinds) {
      for (int trial = 0; trial < 1500; ++trial) {
        auto const s = face_sample<Position, Real>(random, kind, static_cast<Path>(path));
        Clearance const clearance{.share = trial % 2 == 0 ? 0.9 : 0.5};
        double const at_most = trial % 5 == 0 ? infinity : trial % 5 == 1 ? 1 : 1e4;
        auto const r = path_of<Position, Real>(s).reach(clearance, at_most);
        double const gap = double(s.distance(0));
        if (r.settled == Settled::uncertain) {
          ++uncertain;
          // Only where rounding may have used up the gap.
          double const size = std::abs(s.face.size) + norm(s.x - s.origin);
          if (gap > 40 * 1.2e-16 * size) ++violations;
          continue;
        }
        ++(r.settled == Settled::cut ? cut : whole);
        if (!(r.alpha > 0) || !(r.alpha <= at_most) || !(r.kept > 0) || !(r.kept <= gap)) {
          ++violations;
        }
        if (!(r.alpha < infinity)) {
          if (s.distance(1e12 / norm(s.p)) < r.kept) ++violations;
          continue;
        }
        for (int k = 0; k <= 8; ++k) {
          if (s.distance(r.alpha * k / 8) < r.kept) ++violations;
        }
        if (!lands_apart<Position>(s, r.alpha, r.kept)) ++violations;
        if (r.settled != Settled::cut) continue;
        // What is charged at the true end of the step, several times over, is all that is lost.
        double const reach = s.reach(r.kept, at_most);
        double landing = 0, drift = 0;
        for (int c = 0; c < 3; ++c) {
          if (s.p[c] == 0) continue;
          landing += unit * std::abs(s.x[c]);
          drift += 4 * unit * reach * std::abs(s.p[c]);
        }
        double const noise =
            40 * 1.2e-16 * (s.face.size + norm(s.x - s.origin) + reach * norm(s.p));
        double const charge = 1.5 * (landing + drift) + noise;
        if (charge < 0.1 * (gap - r.kept)) {
          ++compared;
          double const sharpness = r.alpha / s.reach(r.kept + charge, at_most);
          bluntest = std::min(bluntest, sharpness);
          if (sharpness < 0.85) ++blunt;
        }
      }
    }
  }
  CAPTURE(uncertain, cut, whole, compared, bluntest);
  CHECK(violations == 0);
  CHECK(blunt == 0);
  CHECK(uncertain > 100);
  CHECK(cut > 15000);
  CHECK(whole > 1000);
  CHECK(compared > 12000);
}

TEST_CASE("where numbers are small the bound of a vertex is the exact one", "[obstacle]") {
  Samples random(3);
  double bluntest = 1;
  for (FaceKind kind : kinds) {
    for (int trial = 0; trial < 3000; ++trial) {
      auto const s = face_sample<double, double>(random, kind, Path::plain);
      auto const r = path_of<double, double>(s).reach({.share = 0.9}, infinity);
      if (r.settled == Settled::cut) bluntest = std::min(bluntest, r.alpha / s.reach(r.kept, 1e30));
    }
  }
  CAPTURE(bluntest);
  CHECK(bluntest > 1 - 1e-8);
}

TEMPLATE_TEST_CASE("a vertex that an obstacle comes towards keeps its clearance", "[obstacle]",
                   double, float) {
  using Position = TestType;
  Samples random(5);
  int violations = 0, cut = 0, whole = 0, uncertain = 0;
  double sum = 0, sum_of_slow = 0;
  int slow = 0;
  for (FaceKind kind : kinds) {
    for (int trial = 0; trial < 3000; ++trial) {
      Path const path = trial % 4 == 0 ? Path::close : trial % 4 == 1 ? Path::far : Path::plain;
      auto s = face_sample<Position, Position>(random, kind, path);
      if (trial % 3 == 0) s.p = {0, 0, 0};
      // The obstacle as a shape of one face about a centre that is not the origin of its frame.
      Vec3<double> const centre = random.vector(2);
      RigidPose now, then;
      now.rotation = turn_matrix({random.unit_vector(), random.uniform(0, 3)});
      now.translation = s.origin - now.rotation * centre;
      double const fastest = trial % 2 == 0 ? 0.02 : 3.1;
      then.rotation =
          turn_matrix({random.unit_vector(), random.uniform(0, fastest)}) * now.rotation;
      if (trial % 7 == 0) then.rotation = now.rotation;
      Vec3<double> const go = random.vector(std::pow(10.0, random.uniform(-4, 1)));
      then.translation = s.origin + go - then.rotation * centre;
      ObstacleTrack track(centre);
      track.place(now);
      track.move_to(then);
      ObstacleFace const own{kind, transpose_times(now.rotation, s.face.direction), s.face.size};
      auto const placed = [&](RigidPose const& pose) {
        ObstacleFace face = own;
        if (kind != FaceKind::sphere)
          face.direction = kernels::unit_vector(pose.rotation * own.direction);
        return std::pair(pose(centre), face);
      };
      std::tie(s.origin, s.face) = placed(track.pose());
      auto const r = path_of<Position, Position>(s, track.motion()).reach({.share = 0.9}, 1);
      auto const distance = [&](double a, bool fused) {
        ObstacleTrack moved = track;
        moved.advance(a);
        auto const [origin, face] = placed(moved.pose());
        return long_distance(face, origin, to_long(stored_after<Position>(s.x, s.p, a, fused)));
      };
      if (r.settled == Settled::uncertain) {
        ++uncertain;
        continue;
      }
      ++(r.settled == Settled::cut ? cut : whole);
      for (double share : {1.0, 0.9, 0.5, 0.1, 1e-3}) {
        for (bool fused : {false, true}) {
          if (distance(share * r.alpha, fused) < r.kept) ++violations;
        }
      }
      if (r.settled != Settled::cut || path != Path::plain) continue;
      double first = 1;
      for (int k = 1; k <= 256 && first == 1; ++k) {
        if (distance(k / 256.0, false) < r.kept) first = k / 256.0;
      }
      double low = std::max(0.0, first - 1 / 256.0), high = first;
      for (int k = 0; k < 40; ++k) {
        double const middle = 0.5 * (low + high);
        (distance(middle, false) < r.kept ? high : low) = middle;
      }
      double const sharpness = high > 0 ? r.alpha / high : 1;
      sum += sharpness;
      if (fastest < 1) sum_of_slow += sharpness, ++slow;
    }
  }
  double const mean = sum / std::max(1, cut), mean_of_slow = sum_of_slow / std::max(1, slow);
  CAPTURE(cut, whole, uncertain, slow, mean, mean_of_slow);
  CHECK(violations == 0);
  CHECK(cut > 2500);
  CHECK(whole > 500);
  CHECK(slow > 500);
  CHECK(mean > 0.3);
  CHECK(mean_of_slow > 0.8);
}

TEST_CASE("a vertex at rest has any step, one that touches has none", "[obstacle]") {
  FaceSample s{{FaceKind::plane, {0, 1, 0}, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  CHECK(path_of<double, double>(s).reach({}, infinity).alpha == infinity);
  CHECK(path_of<double, double>(s).reach({}, infinity).settled == Settled::at_rest);
  s.p = {0, 1, 0};
  CHECK(path_of<double, double>(s).reach({}, 1).settled == Settled::uncertain);
  CHECK(path_of<double, double>(s).reach({}, 1).alpha == 0);
  s.x[1] = -1e-3;
  CHECK(path_of<double, double>(s).reach({}, 1).alpha == 0);
  s.x[1] = 1e-3;
  CHECK(path_of<double, double>(s).reach({}, infinity).alpha == infinity);
  s.p = {1, 0, 0};
  CHECK(path_of<double, double>(s).reach({}, infinity).alpha == infinity);
  s.p = {0, std::nan(""), 0};
  CHECK(path_of<double, double>(s).reach({}, 1).alpha == 0);
  s.p = {0, -1, 0};
  auto const r = path_of<double, double>(s).reach({.share = 0.9, .least = 4e-4}, 1);
  CHECK(r.alpha < 0.9 * 6e-4);
  CHECK(r.alpha > 0.9 * 6e-4 * (1 - 1e-9));
  // Along the axis of a cylinder there is no end either.
  s = {{FaceKind::cylinder, {0, 1, 0}, 1}, {0, 0, 0}, {0.5, 0, 0}, {0, 1, 0}};
  CHECK(path_of<double, double>(s).reach({}, infinity).alpha > 1e6);
  // To where the wall is at the other side of the middle.
  s = {{FaceKind::sphere, {0, 0, 0}, 1}, {0, 0, 0}, {-0.5, 0, 0}, {1, 0, 0}};
  auto const across = path_of<double, double>(s).reach({.share = 0.9}, infinity);
  CHECK(across.alpha < 1.45);
  CHECK(across.alpha > 1.45 * (1 - 1e-9));
}

TEST_CASE("an obstacle lands where it is told to, by the way that it is told", "[obstacle]") {
  Samples random(7);
  for (int trial = 0; trial < 50; ++trial) {
    Vec3<double> const centre = random.vector(1);
    RigidPose from, to;
    from.rotation = turn_matrix({random.unit_vector(), random.uniform(0, 3)});
    from.translation = random.vector(1);
    Turn const turn{random.unit_vector(), random.uniform(0, 3)};
    to.rotation = turn_matrix(turn) * from.rotation;
    to.translation = random.vector(1);
    ObstacleTrack track(centre);
    track.place(from);
    CHECK_FALSE(track.motion().moves);
    track.move_to(to);
    CHECK(track.motion().moves);
    track.advance(0.25);
    // The centre has gone a quarter of the way, and turned by a quarter.
    Vec3<double> const a = from(centre), b = to(centre), c = track.pose()(centre);
    CHECK(norm(c - (a + 0.25 * (b - a))) < 1e-14);
    Mat3<double> const quarter = turn_matrix({turn.axis, turn.angle / 4}) * from.rotation;
    for (int k = 0; k < 9; ++k) CHECK(std::abs(quarter.a[k] - track.pose().rotation.a[k]) < 1e-14);
    track.advance(1.0 / 3);
    CHECK(norm(track.pose()(centre) - (a + 0.5 * (b - a))) < 1e-14);
    track.advance(1.5);
    for (int k = 0; k < 9; ++k) CHECK(track.pose().rotation.a[k] == to.rotation.a[k]);
    for (int k = 0; k < 3; ++k) CHECK(track.pose().translation[k] == to.translation[k]);
    CHECK_FALSE(track.motion().moves);
  }
}
