// The ray from q along z leaves the surface once for each triangle above it whose front looks up,
// and enters it where the front looks down. So that the ray never meets a side or a corner, q is
// moved by (e, e^2) in the plane of x and y, with e > 0 smaller than any number (H. Edelsbrunner,
// E. P. Muecke, "Simulation of simplicity", ACM Trans. Graphics 9, 1990): where the sign of
//
//   (b_x - a_x) (q_y - a_y) - (b_y - a_y) (q_x - a_x)
//
// is 0, that of its first derivative along the move that is not 0 takes its place. The height above
// a triangle needs no such care: it is 0 only for points of the plane, and whoever is in the plane
// and above the triangle is on the surface.
#include <taut/contact/winding_number.hpp>

#include <taut/contact/exact_predicates.hpp>

#include <algorithm>

namespace taut {

namespace {

int sign(bool positive, bool negative) { return positive ? 1 : negative ? -1 : 0; }

/// Side of a b, seen along z, on which the moved q is; 0 only where a and b fall together.
int moved_side(Point const& a, Point const& b, Point const& q) {
  if (int const side = projected_orientation(a, b, q, 2); side != 0) return side;
  if (int const side = sign(b[1]<a[1], b[1]> a[1]); side != 0) return side;
  return sign(b[0] > a[0], b[0] < a[0]);
}

int crossing(Point const& a, Point const& b, Point const& c, Point const& q) {
  for (std::size_t k = 0; k < 2; ++k) {
    auto const [low, high] = std::minmax({a[k], b[k], c[k]});
    if (q[k] < low || q[k] > high) return 0;  // the move does not lead back into the box
  }
  if (std::max({a[2], b[2], c[2]}) < q[2]) return 0;
  int const front = moved_side(a, b, q);
  if (front == 0 || moved_side(b, c, q) != front || moved_side(c, a, q) != front) return 0;
  return orientation(a, b, c, q) * front < 0 ? front : 0;
}

}  // namespace

bool is_closed(std::span<Triangle const> surface) {
  std::vector<std::pair<std::int32_t, std::int32_t>> forth, back;
  for (Triangle const& t : surface)
    for (std::size_t k = 0; k < 3; ++k) {
      forth.emplace_back(t[k], t[(k + 1) % 3]);
      back.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  return forth == back;
}

int winding_number(std::span<Point const> x, std::span<Triangle const> surface, Point const& q) {
  int number = 0;
  for (Triangle const& t : surface) {
    auto const corner = [&](std::size_t k) { return x[t[k]]; };
    number += crossing(corner(0), corner(1), corner(2), q);
  }
  return number;
}

}  // namespace taut
