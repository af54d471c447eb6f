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

namespace kernels {

/// The displacements since `origin`, at the start and the end of a motion, give or take the
/// round-off of both: that of these sums, and that with which the end is stored.
template <class Precision, class S>
struct DisplacementCloud {
  Motion<Precision, S> motion;
  VectorField<double, S> origin;
  KOKKOS_FUNCTION void add(int v, Bounds& bounds) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    constexpr double epsilon_here = Kokkos::Experimental::epsilon_v<double>;
    Vec3<double> const x0{origin(v, 0), origin(v, 1), origin(v, 2)};
    Vec3<double> const x = motion.start(v), step = motion.step(v);
    for (int c = 0; c < 3; ++c) {
      double const here = 2 * epsilon_here * (Kokkos::abs(x[c]) + Kokkos::abs(x0[c]));
      extend_axis(bounds, c, x[c] - x0[c], here, v);
      if (!motion.moves()) continue;
      double const size = Kokkos::abs(step[c]), end = x[c] + step[c];
      double const stored = here + 2 * epsilon * size + epsilon_x * Kokkos::abs(end);
      extend_axis(bounds, c, end - x0[c], stored, v);
    }
  }
};

/// The bounds of chunk i of vertices.
template <class S, class Cloud>
struct ChunkBounds {
  Cloud cloud;
  Kokkos::View<int const*, typename S::memory> vertex, begin;
  Kokkos::View<Bounds*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int i) const { find(i); }
  /// Compiled once, as what contact_kernels.hpp computes: a bound must not depend on the number of
  /// threads.
  [[gnu::noinline]] KOKKOS_FUNCTION void find(int i) const {
    Bounds b;
    FindBounds<int>{}.init(b);
    for (int k = begin(i); k < begin(i + 1); ++k) cloud.add(vertex(k), b);
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

/// All bounds, and the longest diagonal of one body.
struct BodyBounds {
  Bounds all;
  double longest;
};

/// Reduces the chunks of body o. Smallest and largest are exact, so their order is free.
template <class S>
struct FindBodyBounds {
  using value_type = BodyBounds;
  using Find = FindBounds<int>;  // for its init and join alone
  Kokkos::View<Bounds const*, typename S::memory> chunk;
  Kokkos::View<int const*, typename S::memory> begin;
  KOKKOS_FUNCTION void operator()(int o, value_type& b) const {
    BodyBounds body;
    init(body);
    for (int i = begin(o); i < begin(o + 1); ++i) Find{}.join(body.all, chunk(i));
    body.longest = diagonal(body.all);
    join(b, body);
  }
  KOKKOS_FUNCTION void join(value_type& to, value_type const& from) const {
    Find{}.join(to.all, from.all);
    to.longest = Kokkos::max(to.longest, from.longest);
  }
  KOKKOS_FUNCTION void init(value_type& b) const {
    Find{}.init(b.all);
    b.longest = 0;
  }
};

}  // namespace kernels

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
    bounds_ = Kokkos::View<kernels::Bounds*, typename S::memory>("displacement", chunk.size() - 1);
  }

  /// From `origin` to any time of the motion. Throws Error if a vertex is not at a finite place.
  template <class Precision>
  Displacement measure(Motion<Precision, S> const& motion,
                       VectorField<double, S> const& origin) const {
    int const bodies = static_cast<int>(body_.extent(0)) - 1;
    if (bodies < 1) return {};
    using Cloud = kernels::DisplacementCloud<Precision, S>;
    for_each<S>("displacement_chunks", static_cast<int>(bounds_.extent(0)),
                kernels::ChunkBounds<S, Cloud>{{motion, origin}, vertex_, chunk_, bounds_});
    kernels::BodyBounds result;
    kernels::FindBodyBounds<S> const find{bounds_, body_};
    Kokkos::parallel_reduce(label("displacement_bodies"),
                            Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, bodies),
                            find, result);
    refuse_stray(result.all);
    return {result.longest, kernels::diagonal(result.all)};
  }
  int bodies() const { return std::max(0, static_cast<int>(body_.extent(0)) - 1); }

private:
  static constexpr int longest_chunk = 512;
  Kokkos::View<int const*, typename S::memory> vertex_;  ///< of the surface, by body
  Kokkos::View<int const*, typename S::memory> chunk_;   ///< first of each, in vertex_
  Kokkos::View<int const*, typename S::memory> body_;    ///< first chunk of each
  Kokkos::View<kernels::Bounds*, typename S::memory> bounds_;
};

}  // namespace taut
