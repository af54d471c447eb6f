// The exact intersection test on the bodies and obstacles of a scene or a result: what it finds, in
// words.
#pragma once

#include <taut/contact/intersection.hpp>
#include <taut/core/io/vtkhdf.hpp>

#include <span>
#include <string>
#include <vector>

namespace taut {

/// Looks at the boundary of the tets and at the triangles of obstacles, but for those that are only
/// drawn. Each connected piece of an object is a body, so that one piece inside another is found as
/// well; all are named as their object is. Obstacles among themselves may meet: where bodies are is
/// what matters.
class ObjectIntersections {
public:
  explicit ObjectIntersections(ResultMesh const& mesh);

  /// At positions x, m, one per point of the mesh. Throws Error if a vertex of the boundary or of
  /// an obstacle is not finite.
  std::vector<Intersection> find(std::span<Point const> x) const;

  /// "340 intersections (300 of ball with floor, 40 of ball with itself)"
  std::string count(std::vector<Intersection> const& found) const;

  /// The first `most` of them, one indented line each, and how many more there are.
  std::string first_few(std::vector<Intersection> const& found, std::size_t most) const;

  std::string text(Intersection const& one) const { return one.text(name_of_body_); }

  /// Whether an obstacle is one of the two.
  bool with_obstacle(Intersection const& one) const {
    return is_obstacle_[one.edge_body] || is_obstacle_[one.triangle_body];
  }

private:
  /// Numbers the pieces as bodies, and returns their triangles with the body of every vertex.
  IntersectionMesh pieces(ResultMesh const& mesh);

  std::vector<std::string> name_of_body_;
  std::vector<bool> is_obstacle_;  ///< per body
  IntersectionTest test_;
};

}  // namespace taut
