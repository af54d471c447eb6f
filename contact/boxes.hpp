// Boxes of the vertices, edges and triangles of a surface, grown so that two primitives that come
// closer than a radius have boxes that overlap. Whether boxes overlap is the one question that
// every search asks, so all searches find the same pairs, and no search can miss one.
//
// A box encloses its vertices at x and, if they move, at x + alpha p; between these they are on
// straight lines inside it. It is stored in single precision, relative to the centre of the scene,
// with every bound rounded outward: what that costs is 2^-24 of the distance from the centre.
//
// The budget of round-off. With epsilon_x that of stored positions and epsilon that of the
// arithmetic on them, the box of a vertex grows on each side by the sum of
//   radius / 2                   the other primitive has the other half
//   epsilon_x |x|                x + alpha p is rounded when it is stored (half of that)
//   2 epsilon |alpha p|          alpha p is rounded, and so is alpha (together)
//   8 epsilon_fp64 (|x| + |alpha p| + |centre| + radius)   the sums of this file, in fp64
// in the largest component, and that of a primitive, made of those of its vertices, by
//   32 epsilon (longest side)
// more, for what is computed from them: distances are off by at most 4 epsilon (|b| + |e1| + |e2|)
// (closest_features.hpp), where |e| <= sqrt(3) sides and |b| <= |e| + radius, or <= |e1| + |e2| +
// radius for edges. That makes 21 epsilon sides of a triangle and 14 of each of two edges; the rest
// is reserve.
#pragma once

#include <taut/contact/surface.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/report/error.hpp>

#include <cmath>
#include <limits>

namespace taut {

/// Closed: boxes that share a point of their surface overlap. But two whose contents are held by
/// one mark never move against each other and are of no interest: they count as apart, so that a
/// search passes over what is inside of an obstacle.
struct SearchBox {
  float low[3], high[3];
  int held = 0;  ///< the mark by which all in it is fixed (Motion::mark); 0: not all, or by several
};

/// Overlaps no bounded box, and leaves every box that it is joined to as it is.
KOKKOS_INLINE_FUNCTION SearchBox empty_box() {
  constexpr float infinity = Kokkos::Experimental::infinity_v<float>;
  return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}, -1};
}

KOKKOS_FORCEINLINE_FUNCTION bool overlap(SearchBox const& a, SearchBox const& b) {
  // Without branches: which side is the first to fail is anyone's guess.
  unsigned all = static_cast<unsigned>(a.held == 0) | static_cast<unsigned>(a.held != b.held);
  for (int c = 0; c < 3; ++c) {
    all &=
        static_cast<unsigned>(a.low[c] <= b.high[c]) & static_cast<unsigned>(b.low[c] <= a.high[c]);
  }
  return all != 0;
}

KOKKOS_FORCEINLINE_FUNCTION SearchBox join(SearchBox const& a, SearchBox const& b) {
  SearchBox r;
  for (int c = 0; c < 3; ++c) {
    r.low[c] = Kokkos::min(a.low[c], b.low[c]);
    r.high[c] = Kokkos::max(a.high[c], b.high[c]);
  }
  // What is empty has -1.
  r.held = a.held < 0 ? b.held : b.held < 0 || b.held == a.held ? a.held : 0;
  return r;
}

/// The longest side; infinite if a bound is.
KOKKOS_FORCEINLINE_FUNCTION float longest_side(SearchBox const& b) {
  float longest = 0;
  for (int c = 0; c < 3; ++c) longest = Kokkos::max(longest, b.high[c] - b.low[c]);
  return longest;
}

/// Of two boxes of a set the one of lower rank asks for the other: the first, but those that are
/// much longer than most come last. So a floor of two large triangles costs each of its neighbours
/// a step, and not one thread the whole scene.
using Rank = int;
inline constexpr Rank lowest_rank = 0, no_rank = -1;
inline constexpr int most_ranked = 1 << 29;

/// Of box i of a set whose boxes are about `length` long.
KOKKOS_FORCEINLINE_FUNCTION Rank rank_of(int i, float longest, float length) {
  int level = 0;
  for (float bound = 16 * length; level < 3 && !(longest < bound); bound *= 16) ++level;
  return level * most_ranked + i;
}

namespace kernels {

/// The largest float that is not above v.
KOKKOS_INLINE_FUNCTION float round_down(double v) {
  constexpr float largest = Kokkos::Experimental::finite_max_v<float>;
  if (v >= double(largest)) return largest;
  if (v < -double(largest)) return -Kokkos::Experimental::infinity_v<float>;
  float const nearest = static_cast<float>(v);
  if (double(nearest) <= v) return nearest;
  // The next one below, by its bits: std::nextafter would be a call for each number of each box.
  if (nearest == 0) return -Kokkos::Experimental::denorm_min_v<float>;
  auto const bits = Kokkos::bit_cast<std::uint32_t>(nearest);
  return Kokkos::bit_cast<float>(nearest > 0 ? bits - 1 : bits + 1);
}
KOKKOS_FORCEINLINE_FUNCTION float round_up(double v) { return -round_down(-v); }

/// Bounds of a cloud of points, and the first of its points that is not finite.
struct Bounds {
  double low[3], high[3];
  int stray;
};

/// Reduces to the bounds of points; `Cloud` gives point i by `add(i, bounds)`. Smallest and largest
/// are exact, so their order is free.
template <class Cloud>
struct FindBounds {
  using value_type = Bounds;
  Cloud cloud;
  KOKKOS_FUNCTION void operator()(int i, value_type& b) const { cloud.add(i, b); }
  KOKKOS_FUNCTION void join(value_type& to, value_type const& from) const {
    for (int c = 0; c < 3; ++c) {
      to.low[c] = Kokkos::min(to.low[c], from.low[c]);
      to.high[c] = Kokkos::max(to.high[c], from.high[c]);
    }
    to.stray = Kokkos::min(to.stray, from.stray);
  }
  KOKKOS_FUNCTION void init(value_type& b) const {
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    for (int c = 0; c < 3; ++c) {
      b.low[c] = infinity;
      b.high[c] = -infinity;
    }
    b.stray = Kokkos::Experimental::finite_max_v<int>;
  }
};

/// Takes x[c] +- error of a vertex into the bounds along axis c.
KOKKOS_INLINE_FUNCTION void extend_axis(Bounds& b, int c, double x, double error, int vertex) {
  b.low[c] = Kokkos::min(b.low[c], x - error);
  b.high[c] = Kokkos::max(b.high[c], x + error);
  if (!(Kokkos::abs(x) <= Kokkos::Experimental::finite_max_v<double>)) {
    b.stray = Kokkos::min(b.stray, vertex);
  }
}

template <class S, class Cloud>
Bounds find_bounds(char const* name, int n, Cloud const& cloud) {
  return join_all<S>(name, n, FindBounds<Cloud>{cloud});
}

}  // namespace kernels

/// Throws Error if a vertex was not at a finite place.
inline void refuse_stray(kernels::Bounds const& bounds) {
  if (bounds.stray == std::numeric_limits<int>::max()) return;
  throw Error(
      "broad phase: vertex {} is not at a finite place, or is moved to none: the step before has "
      "failed",
      bounds.stray);
}

/// Where the vertices are and how far they go: x to x + alpha p. Without motion `p` is empty. Pairs
/// of vertices that are all `fixed` are of no interest, unless `between_fixed` asks for those whose
/// marks differ, because these may move apart; an empty mask fixes none.
template <class Precision, class S>
struct Motion {
  VectorField<typename Precision::position, S> x;  ///< m
  VectorField<typename Precision::real, S> p = {};
  double alpha = 0;
  FixedMask<S> fixed = {};
  bool between_fixed = false;

  KOKKOS_FUNCTION bool moves() const { return p.extent(0) > 0; }
  /// Vertices of one mark, but 0, make no pairs of interest.
  KOKKOS_FUNCTION int mark(int v) const {
    if (fixed.extent(0) == 0 || fixed(v) == 0) return 0;
    return between_fixed ? fixed(v) : 1;
  }
  KOKKOS_FUNCTION Vec3<double> start(int v) const {
    return {double(x(v, 0)), double(x(v, 1)), double(x(v, 2))};
  }
  KOKKOS_FUNCTION Vec3<double> step(int v) const {
    if (!moves()) return {0, 0, 0};
    return alpha * Vec3<double>{double(p(v, 0)), double(p(v, 1)), double(p(v, 2))};
  }
};

/// A mask of vertices of the mesh; empty: all of them.
template <class S>
using VertexMask = Kokkos::View<std::uint8_t const*, typename S::memory>;

/// n boxes with their ranks, and one box that encloses the vertices.
template <class S>
struct BoxSet {
  Kokkos::View<SearchBox*, typename S::memory> box;
  Kokkos::View<Rank*, typename S::memory> rank;
  int count = 0;
  SearchBox all = empty_box();
};

namespace kernels {

template <class Precision, class S>
struct MotionCloud {
  SurfaceViews<S> surface;
  Motion<Precision, S> motion;
  KOKKOS_FUNCTION void add(int i, Bounds& bounds) const {
    int const v = surface.vertex(i);
    Vec3<double> const x = motion.start(v);
    Vec3<double> const end = x + motion.step(v);
    for (int c = 0; c < 3; ++c) {
      extend_axis(bounds, c, x[c], 0, v);
      extend_axis(bounds, c, end[c], 0, v);
    }
  }
};

/// The box of surface vertex i, to the places `of_vertex(v)` of the mesh's vertex v.
template <class Precision, class S>
struct VertexBoxes {
  SurfaceViews<S> surface;
  Motion<Precision, S> motion;
  Vec3<double> centre;
  double radius, centre_size;
  Array<double, S> own_radius;  ///< in addition, m; empty: none
  VertexMask<S> only;
  Kokkos::View<SearchBox*, typename S::memory> of_vertex;

  KOKKOS_FUNCTION void operator()(int i) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    constexpr double epsilon_here = Kokkos::Experimental::epsilon_v<double>;
    int const v = surface.vertex(i);
    if (only.extent(0) > 0 && only(v) == 0) return;
    Vec3<double> const x = motion.start(v), step = motion.step(v);
    double size_x = 0, size_step = 0;
    for (int c = 0; c < 3; ++c) {
      size_x = Kokkos::max(size_x, Kokkos::max(Kokkos::abs(x[c]), Kokkos::abs(x[c] + step[c])));
      size_step = Kokkos::max(size_step, Kokkos::abs(step[c]));
    }
    double const around = own_radius.extent(0) > 0 ? own_radius(v) : 0;
    double const grow = 0.5 * radius + around + (size_step > 0 ? epsilon_x * size_x : 0) +
                        2 * epsilon * size_step +
                        8 * epsilon_here * (size_x + size_step + centre_size + radius + around);
    SearchBox box;
    for (int c = 0; c < 3; ++c) {
      double const a = x[c] - centre[c], b = x[c] + step[c] - centre[c];
      box.low[c] = round_down(Kokkos::min(a, b) - grow);
      box.high[c] = round_up(Kokkos::max(a, b) + grow);
    }
    box.held = motion.mark(v);
    of_vertex(v) = box;
  }
};

/// Whether a primitive of N vertices has one in a mask.
template <class S, int N>
struct HasVertexIn {
  typename SurfaceViews<S>::Indices corner;
  VertexMask<S> mask;
  KOKKOS_FUNCTION int operator()(int i) const {
    int has = 0;
    for (int a = 0; a < N; ++a) has |= mask(corner(N * i + a));
    return has;
  }
};

/// The box of primitive i, from those of its N vertices, if one of them is in `only`.
template <class S, int N>
struct PrimitiveBoxes {
  typename SurfaceViews<S>::Indices corner;
  HasVertexIn<S, N> is_in_only;
  Kokkos::View<SearchBox const*, typename S::memory> of_vertex;
  Kokkos::View<SearchBox*, typename S::memory> box;
  Kokkos::View<Rank*, typename S::memory> rank;
  double budget;  ///< of round-off, of the longest side
  float length;   ///< of most boxes, m

  KOKKOS_FUNCTION void operator()(int i) const {
    if (is_in_only.mask.extent(0) > 0 && is_in_only(i) == 0) return;
    SearchBox b = of_vertex(corner(N * i));
    for (int a = 1; a < N; ++a) b = join(b, of_vertex(corner(N * i + a)));
    double const grow = budget * double(longest_side(b));
    for (int c = 0; c < 3; ++c) {
      b.low[c] = round_down(double(b.low[c]) - grow);
      b.high[c] = round_up(double(b.high[c]) + grow);
    }
    box(i) = b;
    rank(i) = rank_of(i, longest_side(b), length);
  }
};

}  // namespace kernels

/// The boxes of a surface. Owns their memory, so that computing them anew allocates nothing.
template <class S>
class SurfaceBoxes {
public:
  SurfaceBoxes() = default;
  /// `edge_length`: mean length of the surface's edges, m. Throws Error if there are too many.
  SurfaceBoxes(SurfaceViews<S> const& surface, double edge_length)
      : surface_(surface),
        length_(static_cast<float>(edge_length)),
        of_vertex_("box_of_vertex", surface.object.extent(0)),
        points_(make_set(surface.vertices())),
        edges_(make_set(surface.edges())),
        triangles_(make_set(surface.triangles())) {}

  /// So that primitives that come closer than `radius` (m) during the motion have boxes that
  /// overlap, wherever each vertex is within `own_radius` (m, per vertex of the mesh) of where the
  /// motion says. If `only` some vertices have got another motion or radius of their own since the
  /// last time, it is enough to name them. Throws Error if a vertex of the surface is not at a
  /// finite place, or the radius not a finite length.
  template <class Precision>
  void compute(Motion<Precision, S> const& motion, double radius,
               Array<double, S> const& own_radius = {}, VertexMask<S> const& only = {}) {
    if (!(radius >= 0 && radius <= std::numeric_limits<double>::max())) {
      throw Error("broad phase: pairs closer than {} m cannot be searched: ask for a length",
                  radius);
    }
    check(motion);
    kernels::Bounds const bounds = kernels::find_bounds<S>(
        "box_bounds", surface_.vertices(), kernels::MotionCloud<Precision, S>{surface_, motion});
    refuse_stray(bounds);
    if (surface_.vertices() == 0) return;
    if (only.extent(0) == 0) {
      for (int c = 0; c < 3; ++c) centre_[c] = 0.5 * bounds.low[c] + 0.5 * bounds.high[c];
    }
    double centre_size = 0;
    for (double const x : centre_.v) centre_size = std::max(centre_size, std::abs(x));
    for_each<S>("vertex_boxes", surface_.vertices(),
                kernels::VertexBoxes<Precision, S>{surface_, motion, centre_, radius, centre_size,
                                                   own_radius, only, of_vertex_});
    double const budget = 32.0 * std::numeric_limits<typename Precision::real>::epsilon();
    primitives<1>("point_boxes", surface_.vertex, budget, only, points_);
    primitives<2>("edge_boxes", surface_.edge, budget, only, edges_);
    primitives<3>("triangle_boxes", surface_.triangle, budget, only, triangles_);
    SearchBox all;
    for (int c = 0; c < 3; ++c) {
      all.low[c] = kernels::round_down(bounds.low[c] - centre_[c]);
      all.high[c] = kernels::round_up(bounds.high[c] - centre_[c]);
    }
    points_.all = edges_.all = triangles_.all = all;
  }

  SurfaceViews<S> const& surface() const { return surface_; }
  BoxSet<S> const& points() const { return points_; }
  BoxSet<S> const& edges() const { return edges_; }
  BoxSet<S> const& triangles() const { return triangles_; }

private:
  static BoxSet<S> make_set(int count) {
    if (count > most_ranked) {
      throw Error("broad phase: a surface of {} primitives of a kind: at most {} can be searched",
                  count, most_ranked);
    }
    return {Kokkos::View<SearchBox*, typename S::memory>("box", count),
            Kokkos::View<Rank*, typename S::memory>("box_rank", count), count};
  }
  template <class Precision>
  void check(Motion<Precision, S> const& motion) const {
    std::size_t const n = of_vertex_.extent(0);
    bool const fits = motion.x.extent(0) == n && (!motion.moves() || motion.p.extent(0) == n) &&
                      (motion.fixed.extent(0) == 0 || motion.fixed.extent(0) == n);
    if (!fits) {
      throw Error(
          "broad phase: a surface of a mesh of {} vertices cannot be searched with {} positions, "
          "{} directions and a mask of {}: give one entry per vertex",
          n, motion.x.extent(0), motion.p.extent(0), motion.fixed.extent(0));
    }
  }
  template <int N>
  void primitives(char const* name, typename SurfaceViews<S>::Indices const& corner, double budget,
                  VertexMask<S> const& only, BoxSet<S> const& to) const {
    for_each<S>(name, to.count,
                kernels::PrimitiveBoxes<S, N>{
                    corner, {corner, only}, of_vertex_, to.box, to.rank, budget, length_});
  }

  SurfaceViews<S> surface_;
  float length_ = 0;
  Vec3<double> centre_{0, 0, 0};
  Kokkos::View<SearchBox*, typename S::memory> of_vertex_;
  BoxSet<S> points_, edges_, triangles_;
};

}  // namespace taut
