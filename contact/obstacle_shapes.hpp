// Obstacles that are formulas, not meshes: the set that they leave to the bodies is convex, and is
// given by its faces. With w = x - o, o the centre of the shape,
//
//   plane      g(x) = s + n . w           n its unit normal, towards the bodies
//   sphere     g(x) = s - |w|             seen from inside
//   cylinder   g(x) = s - |a x w|         seen from inside, a its unit axis
//
// is the distance of a point to a face, above 0 on the bodies' side, and the bodies are to stay
// where all of them are above 0. Every g is a concave function of x, and that is all that is used:
//   - a triangle is in the set as soon as its three vertices are, so it is exact to test vertices
//     alone;
//   - on a straight path g is concave in time, so two ends speak for all that is between them
//     (obstacle_path.hpp);
//   - barriers fall and are convex in g, so b(g(x)) is convex in x (obstacle_kernels.hpp).
//
// None of it holds for the OUTSIDE of a ball, a box or a cylinder: an edge of a triangle can run
// through a ball whose distance to its two ends is positive. What bodies fall onto from outside is
// a mesh of triangles in the collision surface (surface.hpp), and so is a bowl that is touched from
// both sides or at its rim: as soon as vertices above a rim are free, the set is not convex.
#pragma once

#include <taut/core/math/rigid_pose.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <concepts>

namespace taut {

enum class FaceKind : int { plane, sphere, cylinder };

/// One face, of a shape that is centred at the origin.
struct ObstacleFace {
  FaceKind kind;
  Vec3<double> direction;  ///< of length 1: a plane's normal, a cylinder's axis; a sphere has none
  double size;  ///< s, m: how far the centre is from it; a sphere's and a cylinder's radius
};

/// A shape in its own frame. Faces are numbered from 0.
template <class S>
concept ObstacleShape = requires(S const& shape, int face) {
  { S::name } -> std::convertible_to<char const*>;
  { S::max_faces } -> std::convertible_to<int>;
  { shape.centre() } -> std::same_as<Vec3<double>>;
  { shape.faces() } -> std::same_as<int>;
  { shape.face(face) } -> std::same_as<ObstacleFace>;
  /// Throws Error for what is not a shape.
  {shape.check()};
};

namespace kernels {
inline bool is_finite(Vec3<double> const& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}
inline Vec3<double> unit_vector(Vec3<double> const& a) {
  double const most = std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[2])});
  Vec3<double> const scaled = (1 / most) * a;  // whose square neither overflows nor vanishes
  return (1 / norm(scaled)) * scaled;
}
/// A vector that is to give a direction.
inline void check_direction(char const* shape, char const* what, Vec3<double> const& a) {
  if (is_finite(a) && (a[0] != 0 || a[1] != 0 || a[2] != 0)) return;
  throw Error("obstacle: the {} of a {} is ({}, {}, {}): give a vector that has a direction", what,
              shape, a[0], a[1], a[2]);
}
inline void check_point(char const* shape, char const* what, Vec3<double> const& a) {
  if (is_finite(a)) return;
  throw Error("obstacle: the {} of a {} is ({}, {}, {}): give finite coordinates", what, shape,
              a[0], a[1], a[2]);
}
inline void check_size(char const* shape, char const* what, double size) {
  if (size > 0 && std::isfinite(size)) return;
  throw Error("obstacle: the {} of a {} is {} m: give a finite length above 0", what, shape, size);
}
}  // namespace kernels

/// What is above a plane.
struct HalfSpace {
  static constexpr char const* name = "half-space";
  static constexpr int max_faces = 1;
  Vec3<double> point{0, 0, 0};   ///< on the plane, m
  Vec3<double> normal{0, 1, 0};  ///< towards the bodies, of any length

  Vec3<double> centre() const { return point; }
  int faces() const { return 1; }
  ObstacleFace face(int) const { return {FaceKind::plane, kernels::unit_vector(normal), 0}; }
  void check() const {
    kernels::check_point(name, "point", point);
    kernels::check_direction(name, "normal", normal);
  }
};

/// The inside of a sphere.
struct InsideBall {
  static constexpr char const* name = "ball";
  static constexpr int max_faces = 1;
  Vec3<double> middle{0, 0, 0};  ///< m
  double radius = 1;             ///< m

  Vec3<double> centre() const { return middle; }
  int faces() const { return 1; }
  ObstacleFace face(int) const { return {FaceKind::sphere, {0, 0, 0}, radius}; }
  void check() const {
    kernels::check_point(name, "centre", middle);
    kernels::check_size(name, "radius", radius);
  }
};

/// The inside of a box along the axes of its own frame. Its six planes act each by itself, so that
/// the energy is smooth where two or three of them meet.
struct InsideBox {
  static constexpr char const* name = "box";
  static constexpr int max_faces = 6;
  Vec3<double> middle{0, 0, 0};  ///< m
  Vec3<double> size{1, 1, 1};    ///< m

  Vec3<double> centre() const { return middle; }
  int faces() const { return 6; }
  /// Faces 2 c and 2 c + 1 are those at the lower and at the upper end of axis c.
  ObstacleFace face(int f) const {
    Vec3<double> n{0, 0, 0};
    n[f / 2] = f % 2 == 0 ? 1 : -1;
    return {FaceKind::plane, n, 0.5 * size[f / 2]};
  }
  void check() const {
    kernels::check_point(name, "centre", middle);
    for (int c = 0; c < 3; ++c) kernels::check_size(name, "size", size[c]);
  }
};

/// The inside of a round cylinder: its side, face 0, and, if it is `capped`, the planes at the
/// start and at the end of its axis.
struct InsideCylinder {
  static constexpr char const* name = "cylinder";
  static constexpr int max_faces = 3;
  Vec3<double> middle{0, 0, 0};  ///< m
  Vec3<double> axis{0, 1, 0};    ///< of any length
  double radius = 1;             ///< m
  double length = 2;             ///< m; not used if it is not capped
  bool capped = true;            ///< else it goes on without end

  Vec3<double> centre() const { return middle; }
  int faces() const { return capped ? 3 : 1; }
  ObstacleFace face(int f) const {
    Vec3<double> const a = kernels::unit_vector(axis);
    if (f == 0) return {FaceKind::cylinder, a, radius};
    return {FaceKind::plane, f == 1 ? a : -a, 0.5 * length};
  }
  void check() const {
    kernels::check_point(name, "centre", middle);
    kernels::check_direction(name, "axis", axis);
    kernels::check_size(name, "radius", radius);
    if (capped) kernels::check_size(name, "length", length);
  }
};

/// The faces of a shape at one pose, where kernels read them. What is meant by the obstacle is
/// these numbers: they are rounded once, here, and exact from then on.
template <int n>
struct PlacedFaces {
  static constexpr int most = n;
  Vec3<double> origin;  ///< o, m
  ObstacleFace face[n];
  int count = 0;
};

template <ObstacleShape S>
PlacedFaces<S::max_faces> place(S const& shape, RigidPose const& pose) {
  PlacedFaces<S::max_faces> placed{};
  placed.origin = pose(shape.centre());
  placed.count = shape.faces();
  for (int f = 0; f < placed.count; ++f) {
    placed.face[f] = shape.face(f);
    if (placed.face[f].kind != FaceKind::sphere) {
      placed.face[f].direction = kernels::unit_vector(pose.rotation * placed.face[f].direction);
    }
  }
  return placed;
}

/// A point and a face.
struct FaceDistance {
  double distance;  ///< g, m
  Vec3<double> n;   ///< the gradient of g, of length 1; zero in the middle of a round face
  double radius;    ///< from the middle of a round face, m; 0 for a plane
};

/// `w` is relative to the centre of the shape, m.
KOKKOS_INLINE_FUNCTION FaceDistance distance_to(ObstacleFace const& face, Vec3<double> const& w) {
  if (face.kind == FaceKind::plane) {
    return {face.size + dot(face.direction, w), face.direction, 0};
  }
  Vec3<double> const& a = face.direction;
  bool const round = face.kind == FaceKind::cylinder;
  Vec3<double> const turned = round ? cross(a, w) : w;
  double const radius = norm(turned);
  // a x w, turned back by a quarter, is what of w is across the axis.
  Vec3<double> const out = round ? cross(turned, a) : w;
  return {face.size - radius, (radius > 0 ? -1 / radius : 0.0) * out, radius};
}

}  // namespace taut
