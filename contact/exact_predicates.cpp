// Signs of determinants by CGAL's kernel of exact predicates: a bound of the rounding error decides
// nearly all of them in a few operations, intervals most of the others, numbers of unlimited length
// the rest (C. Burnikel, S. Funke, M. Seel, "Exact geometric computation using cascading", Int. J.
// Comput. Geom. Appl. 11, 2001).
//
// CGAL's kernel is under the LGPL 3 and is included here alone, as headers and as it is. Other
// parts of CGAL that this folder could use (box_intersection_d, Side_of_triangle_mesh) are under
// the GPL, and stay out. Long numbers are CGAL's own, not GMP's: they decide so rarely that one
// library less to link is worth more than their speed.
#include <taut/contact/exact_predicates.hpp>

#define CGAL_DISABLE_GMP 1
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

namespace taut {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 in_space(Point const& x) { return {x[0], x[1], x[2]}; }

/// Seen along an axis, the other two in cyclic order.
Kernel::Point_2 in_plane(Point const& x, int axis) {
  std::size_t const k = static_cast<std::size_t>(axis);
  return {x[(k + 1) % 3], x[(k + 2) % 3]};
}

}  // namespace

int orientation(Point const& a, Point const& b, Point const& c, Point const& d) {
  return CGAL::orientation(in_space(a), in_space(b), in_space(c), in_space(d));
}

int projected_orientation(Point const& a, Point const& b, Point const& c, int axis) {
  return CGAL::orientation(in_plane(a, axis), in_plane(b, axis), in_plane(c, axis));
}

}  // namespace taut
