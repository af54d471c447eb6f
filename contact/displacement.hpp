// How far the vertices of a surface have moved against each other since they were at given places:
// a bound for those of one body, and one for any two. The distance of a pair has changed by no more
// than max |u_i - u_j| over its vertices, and that is no more than the diagonal of the box around
// their displacements u. What a body does as a whole counts nothing within it, and what all do
// together counts nothing at all.
#pragma once

#include <taut/contact/boxes.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace taut {

/// Bounds of relative displacements, m.
struct Displacement {
  double within = 0;   ///< of two vertices of one body, the largest of all bodies
  double between = 0;  ///< of any two vertices

  /// Of a pair that `pair_length` was made for.
  KOKKOS_FUNCTION double of(float pair_length) const { return pair_length < 0 ? within : between; }
};

/// A length of a pair of one body or of two in one number, below zero for one body. Nothing, and
/// what is less, is 0 for either.
KOKKOS_FORCEINLINE_FUNCTION float pair_length(bool one_body, float length) {
  return length > 0 ? (one_body ? -length : length) : 0.f;
}

/// Where the vertices of a mesh were, and a motion from there that has been looked at in full.
template <class S>
struct Departure {
  VectorField<double, S> from;       ///< m
  VectorField<double, S> path;       ///< m
  int leader = -1;                   ///< a vertex that goes far on its path; -1: none goes anywhere
  VectorField<double, S> lead = {};  ///< rows: where the leader was, and its path; m
};

template <class S>
Departure<S> make_departure(std::size_t vertices) {
  return {VectorField<double, S>("departure_from", vertices),
          VectorField<double, S>("departure_path", vertices), -1,
          VectorField<double, S>("departure_lead", 2)};
}

namespace kernels {

/// Remembers where the leader was and where it goes.
template <class S>
struct KeepLead {
  Departure<S> of;
  KOKKOS_FUNCTION void operator()(int c) const {
    of.lead(0, c) = of.from(of.leader, c);
    of.lead(1, c) = of.path(of.leader, c);
  }
};

/// Component c of where a vertex is on a motion, at its start or its end: how far from where it was
/// at a departure, and how far off the path from there; m. The errors are the round-off of these
/// sums, and that with which an end is stored.
struct PlaceComponent {
  double moved, off, error;
  KOKKOS_FUNCTION double off_error() const { return 2 * error; }
};

/// Vertices on a motion, as seen from a departure. Along its path they are s of the whole, 0 to 1,
/// by how far the leader is.
template <class Precision, class S>
struct MotionSince {
  Motion<Precision, S> motion;
  Departure<S> since;

  KOKKOS_FUNCTION double along(bool end) const {
    int const v = since.leader;
    if (v < 0) return 0;
    Vec3<double> x = motion.start(v), path;
    if (end) x = x + motion.step(v);
    for (int c = 0; c < 3; ++c) {
      x[c] -= since.lead(0, c);
      path[c] = since.lead(1, c);
    }
    return Kokkos::min(Kokkos::max(dot(x, path) / dot(path, path), 0.0), 1.0);
  }
  KOKKOS_FUNCTION PlaceComponent place(int v, int c, Vec3<double> const& x,
                                       Vec3<double> const& step, bool end, double s) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    constexpr double epsilon_here = Kokkos::Experimental::epsilon_v<double>;
    double const from = since.from(v, c), path = since.leader < 0 ? 0.0 : since.path(v, c);
    double const size = Kokkos::abs(x[c]) + Kokkos::abs(from) + Kokkos::abs(path);
    double const here = 2 * epsilon_here * size;
    if (!end) return {x[c] - from, x[c] - from - s * path, here};
    double const at = x[c] + step[c];
    return {at - from, at - from - s * path,
            here + 2 * epsilon * Kokkos::abs(step[c]) + epsilon_x * Kokkos::abs(at)};
  }
};

/// The displacements since a departure, at the start and the end of a motion, give or take the
/// round-off of both. And what of them is off the path.
template <class Precision, class S>
struct DisplacementCloud {
  MotionSince<Precision, S> seen;

  KOKKOS_FUNCTION double along(bool end) const { return seen.along(end); }
  KOKKOS_FUNCTION void add(int v, double s_start, double s_end, Bounds& all, Bounds& off) const {
    Vec3<double> const x = seen.motion.start(v), step = seen.motion.step(v);
    for (int c = 0; c < 3; ++c) {
      for (int end = 0; end < (seen.motion.moves() ? 2 : 1); ++end) {
        auto const at = seen.place(v, c, x, step, end == 1, end == 1 ? s_end : s_start);
        extend_axis(all, c, at.moved, at.error, v);
        extend_axis(off, c, at.off, at.off_error(), v);
      }
    }
  }
};

/// Bounds of displacements, and of what of them is off a path.
struct DisplacementBounds {
  Bounds all, off;
};

/// The bounds of chunk i of vertices.
template <class S, class Cloud>
struct ChunkBounds {
  Cloud cloud;
  Kokkos::View<int const*, typename S::memory> vertex, begin;
  Kokkos::View<DisplacementBounds*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int i) const { find(i); }
  /// Compiled once, as what contact_kernels.hpp computes: a bound must not depend on the number of
  /// threads.
  [[gnu::noinline]] KOKKOS_FUNCTION void find(int i) const {
    DisplacementBounds b;
    FindBounds<int>{}.init(b.all);
    FindBounds<int>{}.init(b.off);
    double const start = cloud.along(false), end = cloud.along(true);
    for (int k = begin(i); k < begin(i + 1); ++k) cloud.add(vertex(k), start, end, b.all, b.off);
    to(i) = b;
  }
};

[[gnu::noinline]] KOKKOS_INLINE_FUNCTION double diagonal(Bounds const& b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    double const side = b.high[c] - b.low[c];
    sum += side * side;
  }
  // A little more, for these sums.
  return Kokkos::sqrt(sum) * (1 + 8 * Kokkos::Experimental::epsilon_v<double>);
}

/// All bounds, and the longest diagonals of one body.
struct BodyBounds {
  DisplacementBounds bounds;
  double longest, longest_off;
};

/// Reduces the chunks of body o. Smallest and largest are exact, so their order is free.
template <class S>
struct FindBodyBounds {
  using value_type = BodyBounds;
  using Find = FindBounds<int>;  // for its init and join alone
  Kokkos::View<DisplacementBounds const*, typename S::memory> chunk;
  Kokkos::View<int const*, typename S::memory> begin;
  KOKKOS_FUNCTION void operator()(int o, value_type& b) const {
    BodyBounds body;
    init(body);
    for (int i = begin(o); i < begin(o + 1); ++i) {
      Find{}.join(body.bounds.all, chunk(i).all);
      Find{}.join(body.bounds.off, chunk(i).off);
    }
    body.longest = diagonal(body.bounds.all);
    body.longest_off = diagonal(body.bounds.off);
    join(b, body);
  }
  KOKKOS_FUNCTION void join(value_type& to, value_type const& from) const {
    Find{}.join(to.bounds.all, from.bounds.all);
    Find{}.join(to.bounds.off, from.bounds.off);
    to.longest = Kokkos::max(to.longest, from.longest);
    to.longest_off = Kokkos::max(to.longest_off, from.longest_off);
  }
  KOKKOS_FUNCTION void init(value_type& b) const {
    Find{}.init(b.bounds.all);
    Find{}.init(b.bounds.off);
    b.longest = b.longest_off = 0;
  }
};

}  // namespace kernels

/// What has moved since a departure.
struct Moved {
  Displacement all;
  Displacement off;  ///< the path of the departure
};

/// Measures one surface, again and again; allocates nothing after its construction.
template <class S>
class Displacements {
public:
  Displacements() = default;
  explicit Displacements(SurfaceViews<S> const& surface) {
    auto const vertex = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surface.vertex);
    auto const object = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surface.object);
    std::vector<int> order(vertex.data(), vertex.data() + vertex.extent(0)), chunk{0}, body{0};
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return object(a) < object(b); });
    for (int k = 1; k <= static_cast<int>(order.size()); ++k) {
      bool const last = k == static_cast<int>(order.size());
      bool const ends = last || object(order[k]) != object(order[k - 1]);
      if (ends || k - chunk.back() == longest_chunk) chunk.push_back(k);
      if (ends) body.push_back(static_cast<int>(chunk.size()) - 1);
    }
    vertex_ = to_space<S>("displacement_vertex", order);
    chunk_ = to_space<S>("displacement_chunk", chunk);
    body_ = to_space<S>("displacement_body", body);
    bounds_ = Kokkos::View<kernels::DisplacementBounds*, typename S::memory>("displacement",
                                                                             chunk.size() - 1);
  }

  /// From a departure to any time of the motion. Throws Error if a vertex is not at a finite place.
  template <class Precision>
  Moved measure(Motion<Precision, S> const& motion, Departure<S> const& since) const {
    int const bodies = this->bodies();
    if (bodies < 1) return {};
    using Cloud = kernels::DisplacementCloud<Precision, S>;
    for_each<S>("displacement_chunks", static_cast<int>(bounds_.extent(0)),
                kernels::ChunkBounds<S, Cloud>{{{motion, since}}, vertex_, chunk_, bounds_});
    auto const result =
        join_all<S>("displacement_bodies", bodies, kernels::FindBodyBounds<S>{bounds_, body_});
    refuse_stray(result.bounds.all);
    return {{result.longest, kernels::diagonal(result.bounds.all)},
            {result.longest_off, kernels::diagonal(result.bounds.off)}};
  }
  int bodies() const { return std::max(0, static_cast<int>(body_.extent(0)) - 1); }

private:
  static constexpr int longest_chunk = 512;
  Kokkos::View<int const*, typename S::memory> vertex_;  ///< of the surface, by body
  Kokkos::View<int const*, typename S::memory> chunk_;   ///< first of each, in vertex_
  Kokkos::View<int const*, typename S::memory> body_;    ///< first chunk of each
  Kokkos::View<kernels::DisplacementBounds*, typename S::memory> bounds_;
};

}  // namespace taut
