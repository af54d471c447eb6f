// The exact intersection test on the objects of a scene or a result: what it finds, in words.
#pragma once

#include <taut/contact/intersection.hpp>

#include <span>
#include <string>
#include <vector>

namespace taut {

/// Looks at the boundary of a tet mesh. Each connected piece of an object is a body, so that one
/// piece inside another is found as well; all are named as their object is.
class ObjectIntersections {
public:
  /// `object` per tet, an index into `names`; `vertices` of the mesh.
  ObjectIntersections(std::vector<Tet> const& tets, std::span<std::int32_t const> object,
                      std::vector<std::string> const& names, std::size_t vertices);

  /// At positions x, m. Throws Error if a vertex of the boundary is not finite.
  std::vector<Intersection> find(std::span<Point const> x) const { return test_.find(x); }

  /// "340 intersections (300 of ball with floor, 40 of ball with itself)"
  std::string count(std::vector<Intersection> const& found) const;

  /// The first `most` of them, one indented line each, and how many more there are.
  std::string first_few(std::vector<Intersection> const& found, std::size_t most) const;

  std::string text(Intersection const& one) const { return one.text(name_of_body_); }

private:
  struct Pieces {
    std::vector<std::int32_t> of_vertex;
    std::vector<std::string> names;  ///< of the objects that they are of
  };
  static Pieces pieces(std::vector<Tet> const& tets, std::span<std::int32_t const> object,
                       std::vector<std::string> const& names, std::size_t vertices);
  ObjectIntersections(std::vector<Tet> const& tets, Pieces pieces);

  std::vector<std::string> name_of_body_;
  IntersectionTest test_;
};

}  // namespace taut
