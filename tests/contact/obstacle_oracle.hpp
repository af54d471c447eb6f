// What obstacles are judged by: distances to faces in extended precision, and hard paths.
#pragma once

#include "step_bound_samples.hpp"

#include <taut/contact/obstacle_path.hpp>

#include <cmath>

namespace taut::test {

/// The distance of x to a face about the centre o, m: to some 2^-62 of the numbers involved.
inline long double long_distance(ObstacleFace const& face, Vec3<double> const& o, Long const& x) {
  Long w, a;
  for (int c = 0; c < 3; ++c) {
    w[c] = x[c] - o[c];
    a[c] = face.direction[c];
  }
  switch (face.kind) {
    case FaceKind::plane:
      return face.size + dot(a, w);
    case FaceKind::sphere:
      return face.size - long_norm(w);
    default:
      return face.size - long_norm(cross(a, w));
  }
}
inline Long to_long(Vec3<double> const& x) { return {x[0], x[1], x[2]}; }

/// One vertex and one face.
struct FaceSample {
  ObstacleFace face;
  Vec3<double> origin, x, p;

  long double distance(long double a) const {
    return long_distance(face, origin, to_long(x) + a * to_long(p));
  }
  /// The first a at which the distance has come down to `kept`, or `at_most`.
  double reach(long double kept, double at_most) const {
    if (distance(at_most) >= kept) return at_most;
    long double low = 0, high = at_most;
    for (int k = 0; k < 200 && low < high; ++k) {
      long double const middle = low + (high - low) / 2;
      (distance(middle) >= kept ? low : high) = middle;
    }
    return double(low);
  }
};

/// Where x + a p is stored: with the product rounded by itself, or not.
template <class Position>
Vec3<double> stored_after(Vec3<double> const& x, Vec3<double> const& p, double alpha, bool fused) {
  Vec3<double> r;
  for (int c = 0; c < 3; ++c) {
    Position const a = Position(alpha), xc = Position(x[c]), pc = Position(p[c]);
    Position volatile product = a * pc;
    Position const moved = product;
    r[c] = double(fused ? std::fma(a, pc, xc) : Position(xc + moved));
  }
  return r;
}

/// What makes a path hard to bound.
enum class Path : int { plain, aligned, grazing, close, at_round_off, far, slow, fast, count };

/// A vertex at some distance within a face, and a way for it to go; numbers as Position and Real
/// hold them.
template <class Position, class Real>
FaceSample face_sample(Samples& random, FaceKind kind, Path path) {
  constexpr double unit = Kokkos::Experimental::epsilon_v<Position> / 2;
  FaceSample s{};
  s.face.kind = kind;
  s.face.direction = random.unit_vector();
  if (path == Path::aligned) {
    s.face.direction = {0, 0, 0};
    s.face.direction[random.one_of(3)] = random.one_of(2) == 0 ? 1 : -1;
  }
  s.face.size = kind == FaceKind::plane ? random.uniform(0, 2) : random.uniform(0.5, 2);
  s.origin = path == Path::far ? random.vector(1e6) : random.vector(1);
  double gap = std::pow(10.0, random.uniform(-5, -0.5));
  if (path == Path::close) gap = std::pow(10.0, random.uniform(-14, -5));
  if (path == Path::at_round_off) gap = unit * random.uniform(-2, 20);
  Vec3<double> const a = s.face.direction;
  Vec3<double> out = kind == FaceKind::plane ? -a : random.unit_vector();
  if (kind == FaceKind::cylinder) {
    out = cross(a, out);
    out = (1 / norm(out)) * out;
  }
  // Along the face.
  Vec3<double> side = cross(out, random.unit_vector());
  side = (1 / norm(side)) * side;
  s.x = s.origin + (s.face.size - gap) * out;
  if (kind == FaceKind::plane) s.x = s.x + random.uniform(-2, 2) * side;
  if (kind == FaceKind::cylinder) s.x = s.x + random.uniform(-2, 2) * a;
  s.p = random.vector(1);
  if (path == Path::aligned && random.one_of(2) == 0) s.p[random.one_of(3)] = 0;
  if (path == Path::grazing) {
    s.p = side + std::pow(10.0, random.uniform(-17, -1)) * random.uniform(-1, 1) * out;
  }
  double size = std::pow(10.0, random.uniform(-3, 1));
  if (path == Path::slow) size = std::pow(10.0, random.uniform(-20, -10));
  if (path == Path::fast) size = std::pow(10.0, random.uniform(3, 6));
  for (int c = 0; c < 3; ++c) {
    s.x[c] = stored<Position>(s.x[c]);
    s.p[c] = stored<Real>(size * s.p[c]);
  }
  return s;
}

}  // namespace taut::test
