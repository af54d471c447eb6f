// Scenes for obstacles, and the term once more: serial, in extended precision, shape by shape.
#pragma once

#include "contact_scenes.hpp"
#include "step_bound_samples.hpp"

#include <taut/contact/obstacle.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace taut::scenes {

/// Distances to the faces of a shape at a pose, from its own definition.
template <class Shape>
std::vector<long double> face_distances(Shape const& shape, RigidPose const& pose,
                                        Vec3<double> const& x) {
  using Long = Vec3<long double>;
  auto const lengthen = [](Vec3<double> const& a) { return Long{a[0], a[1], a[2]}; };
  Long y{0, 0, 0};  // in the shape's frame
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      y[i] += (long double)pose.rotation(j, i) * ((long double)x[j] - pose.translation[j]);
    }
  if constexpr (std::is_same_v<Shape, HalfSpace>) {
    Long const n = lengthen(shape.normal);
    return {dot(n, y - lengthen(shape.point)) / std::sqrt(dot(n, n))};
  } else {
    Long const w = y - lengthen(shape.middle);
    if constexpr (std::is_same_v<Shape, InsideBall>) {
      return {shape.radius - std::sqrt(dot(w, w))};
    } else if constexpr (std::is_same_v<Shape, InsideBox>) {
      std::vector<long double> d;
      for (int c = 0; c < 3; ++c) {
        d.push_back(shape.size[c] / 2.0L + w[c]);
        d.push_back(shape.size[c] / 2.0L - w[c]);
      }
      return d;
    } else {
      Long const axis = lengthen(shape.axis);
      long double const along = dot(axis, w) / std::sqrt(dot(axis, axis));
      std::vector<long double> d{shape.radius - std::sqrt(dot(w, w) - along * along)};
      if (shape.capped) d.push_back(shape.length / 2.0L + along);
      if (shape.capped) d.push_back(shape.length / 2.0L - along);
      return d;
    }
  }
}
template <class Shape>
double least_distance(Shape const& shape, RigidPose const& pose, Vec3<double> const& x) {
  auto const d = face_distances(shape, pose, x);
  return double(*std::min_element(d.begin(), d.end()));
}
/// Of all vertices of the surface.
template <class Shape>
double least_distance(Shape const& shape, RigidPose const& pose, Surface const& surface,
                      std::vector<Point> const& x) {
  double least = 1e300;
  for (int v : surface.vertices) {
    least = std::min(least, least_distance(shape, pose, {x[v][0], x[v][1], x[v][2]}));
  }
  return least;
}

template <class Shape>
Shape sample_shape();
template <>
inline HalfSpace sample_shape() {
  return {{0.1, -0.4, 0.2}, {0.3, 2, -0.4}};
}
template <>
inline InsideBall sample_shape() {
  return {{0.1, -0.2, 0.3}, 0.9};
}
template <>
inline InsideBox sample_shape() {
  return {{0.1, -0.2, 0.3}, {1.2, 1.5, 1.8}};
}
template <>
inline InsideCylinder sample_shape() {
  return {{0.1, -0.2, 0.3}, {0.2, 1, -0.5}, 0.8, 1.7, true};
}

inline RigidPose sample_pose() {
  RigidPose pose;
  pose.rotation = turn_matrix({{0.6, 0, 0.8}, 0.7});
  pose.translation = {0.3, -0.1, 0.2};
  return pose;
}

/// The vertices of a cube of the mesh, thrown into the shape: many within dhat of one face or of
/// several, none nearer than a twentieth of it.
template <class Shape>
struct Thrown {
  static constexpr double dhat = 0.3;
  Shape shape = sample_shape<Shape>();
  RigidPose pose = sample_pose();
  std::vector<Point> rest, x, p;
  Surface surface;

  explicit Thrown(unsigned seed = 3) {
    TetMesh const mesh = make_shape(BoxShape{}, 3);
    rest = mesh.points;
    surface = make_surface(boundary_faces(mesh.tets), std::vector<int>(rest.size(), 0));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    while (x.size() < rest.size()) {
      Vec3<double> const at =
          pose(shape.centre() + Vec3<double>{any(random), any(random), any(random)});
      double const least = least_distance(shape, pose, at);
      if (least < 0.05 * dhat || (least > dhat && x.size() % 4 != 0)) continue;
      x.push_back({at[0], at[1], at[2]});
      p.push_back({any(random), any(random), any(random)});
    }
  }
  int size() const { return static_cast<int>(x.size()); }
};

}  // namespace taut::scenes
