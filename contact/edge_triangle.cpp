// The edge p q meets the triangle a b c, which has an area, if its ends are not on the same side of
// the plane, and the line p q does not pass outside of a side: the signs of the volumes (p q a b),
// (p q b c), (p q c a) do not contradict each other. All else happens in a plane or on a line, and
// is decided in a projection in which nothing falls together. (Shewchuk's and Guigue and Devillers'
// way of asking for signs only: P. Guigue, O. Devillers, "Fast and robust triangle-triangle overlap
// test using orientation predicates", J. Graphics Tools 8, 2003. The degenerate cases are ours.)
#include <taut/contact/edge_triangle.hpp>

#include <taut/contact/exact_predicates.hpp>

#include <algorithm>

namespace taut {

namespace {

using Kind = std::optional<IntersectionKind>;
constexpr Kind apart = std::nullopt, touching = IntersectionKind::touching,
               overlap = IntersectionKind::overlap, crossing = IntersectionKind::crossing;

/// An axis along which a, b, c are seen to turn; -1 if they lie on a line.
int axis_of_plane(Point const& a, Point const& b, Point const& c) {
  for (int axis = 0; axis < 3; ++axis)
    if (projected_orientation(a, b, c, axis) != 0) return axis;
  return -1;
}

bool on_a_line(Point const& a, Point const& b, Point const& c) {
  return axis_of_plane(a, b, c) < 0;
}

/// Two segments, which may be points. Points of a line are ordered along it as their coordinates
/// are, lexicographically.
Kind meet(std::array<Point, 2> s, std::array<Point, 2> t) {
  for (auto* segment : {&s, &t})
    if ((*segment)[1] < (*segment)[0]) std::swap((*segment)[0], (*segment)[1]);
  if (s[0] == s[1]) std::swap(s, t);  // if any is a point, t is
  if (on_a_line(s[0], s[1], t[0]) && on_a_line(s[0], s[1], t[1])) {
    Point const first = std::max(s[0], t[0]), last = std::min(s[1], t[1]);
    return last < first ? apart : first < last ? overlap : touching;
  }
  if (t[0] == t[1] || orientation(s[0], s[1], t[0], t[1]) != 0) return apart;
  // In a plane, but not on a line: each must reach from one side of the other to the other side.
  int axis = axis_of_plane(s[0], s[1], t[0]);
  if (axis < 0) axis = axis_of_plane(s[0], s[1], t[1]);
  const auto divides = [axis](std::array<Point, 2> const& line, std::array<Point, 2> const& ends) {
    return projected_orientation(line[0], line[1], ends[0], axis) *
               projected_orientation(line[0], line[1], ends[1], axis) <=
           0;
  };
  return divides(s, t) && divides(t, s) ? touching : apart;
}

/// A triangle with an area, seen along an axis from where its corners turn counter-clockwise.
class Triangle2 {
public:
  Triangle2(Point const& a, Point const& b, Point const& c, int axis)
      : corner_{a, b, c}, axis_(axis) {
    if (projected_orientation(a, b, c, axis) < 0) std::swap(corner_[1], corner_[2]);
  }

  /// A point of the plane: in the triangle or on its sides.
  bool holds(Point const& x) const {
    for (int k = 0; k < 3; ++k)
      if (inward(k, x) < 0) return false;
    return true;
  }

  /// A segment of the plane with p != q.
  Kind meet_segment(Point const& p, Point const& q) const {
    bool from_side = false;  // an end on the line of a side, the other one outside of it
    for (int k = 0; k < 3; ++k) {
      int const at_p = inward(k, p), at_q = inward(k, q);
      if (at_p < 0 && at_q < 0) return apart;
      from_side = from_side || at_p + at_q < 0;
    }
    int left = 0, right = 0;  // corners beside the line p q
    for (Point const& corner : corner_) {
      int const side = projected_orientation(p, q, corner, axis_);
      left += side > 0;
      right += side < 0;
    }
    // No line along a side of either keeps them apart: they meet (the separating axes of a triangle
    // and a segment are the normals of these four).
    if (left == 3 || right == 3) return apart;
    bool const at_corner = left + right == 2 && (left == 0 || right == 0);
    return from_side || at_corner ? touching : overlap;
  }

private:
  /// 1 inside of the line of side k, 0 on it.
  int inward(int k, Point const& x) const {
    return projected_orientation(corner_[k], corner_[(k + 1) % 3], x, axis_);
  }

  std::array<Point, 3> corner_;
  int axis_;
};

}  // namespace

std::optional<IntersectionKind> intersect(Point const& p, Point const& q, Point const& a,
                                          Point const& b, Point const& c) {
  int const above_p = orientation(a, b, c, p), above_q = orientation(a, b, c, q);
  if (above_p * above_q > 0) return apart;
  if (above_p * above_q < 0) {
    int const sides[] = {orientation(p, q, a, b), orientation(p, q, b, c), orientation(p, q, c, a)};
    auto const [least, most] = std::minmax({sides[0], sides[1], sides[2]});
    if (least * most < 0) return apart;
    return least * most > 0 ? crossing : touching;
  }
  int const axis = axis_of_plane(a, b, c);
  if (axis < 0) return meet({p, q}, {std::min({a, b, c}), std::max({a, b, c})});
  Triangle2 const triangle(a, b, c, axis);
  if (above_p == 0 && above_q == 0 && p != q) return triangle.meet_segment(p, q);
  return triangle.holds(above_p == 0 ? p : q) ? touching : apart;
}

}  // namespace taut
