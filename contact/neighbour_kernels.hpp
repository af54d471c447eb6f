// The kernels of neighbours.hpp: which pairs are near, which vertices have left their anchors, and
// who asks anew.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>
#include <taut/contact/displacement.hpp>

namespace taut {

/// Two numbers per pair: a surface vertex and a triangle, or two edges, the first one first.
template <class S>
using PrimitivePairs = Kokkos::View<int* [2], typename S::layout, typename S::memory>;

namespace kernels {

/// The pairs that may act, or be half of dhat apart, once their distance has fallen by `reach`, or
/// in the course of `motion`.
template <class Precision, class S>
struct WithinReach {
  Activation<S> activation;
  Displacement reach;
  Motion<Precision, S> motion;

  /// The distance below which a pair is looked after that acts below `acts_below`.
  KOKKOS_FUNCTION double watched(double acts_below) const {
    return Kokkos::max(acts_below, 0.5 * activation.dhat);
  }
  KOKKOS_FUNCTION double reach_of(bool one_body) const {
    return one_body ? reach.within : reach.between;
  }
  /// The same, where there is motion, for pairs that are at y, one or a pack of them.
  template <class T>
  KOKKOS_FUNCTION T moving(T const& far, int const (&v)[4][ScalarTraits<T>::lanes],
                           Vec3<T> const (&y)[4]) const {
    return motion.moves() ? far + relative_motion(v, y) : far;
  }
  /// Of the vertices of a pair against each other, and what storing their ends may add: the
  /// diagonal of the box around their steps.
  template <class T>
  KOKKOS_FUNCTION T relative_motion(int const (&v)[4][ScalarTraits<T>::lanes],
                                    Vec3<T> const (&y)[4]) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    Vec3<T> const step[4] = {motion_of<T>(v[0]), motion_of<T>(v[1]), motion_of<T>(v[2]),
                             motion_of<T>(v[3])};
    T sum(0.0), size(0.0), place(0.0);
    for (int c = 0; c < 3; ++c) {
      T low = step[0][c], high = low;
      for (int a = 0; a < 4; ++a) {
        low = min(low, step[a][c]);
        high = max(high, step[a][c]);
        size = max(size, abs(step[a][c]));
        place = max(place, abs(T(y[a][c] + step[a][c])));
      }
      sum += (high - low) * (high - low);
    }
    // Four vertices, each off by no more than sqrt(3) times what its largest component is.
    return T(1 + 1e-15) * sqrt(sum) + T(28 * epsilon) * size + T(14 * epsilon_x) * place;
  }
  template <class T>
  KOKKOS_FUNCTION Vec3<T> motion_of(int const (&v)[ScalarTraits<T>::lanes]) const {
    if constexpr (is_pack<T>) {
      Vec3<T> r;
      for (int c = 0; c < 3; ++c) {
        r[c] = T([&](std::size_t i) { return motion.alpha * double(motion.p(v[i], c)); });
      }
      return r;
    } else {
      return motion.step(v[0]);
    }
  }
};

/// The distance of a pair, or of a pack of them, m.
template <class T>
struct NearDistance {
  T below;  ///< less the round-off of computing it; infinite where it is known to be too far
  T noted;  ///< what to note of it
};

/// Of pairs at y; those are too far that boxes tell not to be closer than `farthest`.
template <class T>
KOKKOS_FUNCTION NearDistance<T> distance_below(PairKind kind, Vec3<T> const (&y)[4],
                                               T const& farthest) {
  T const infinity(Kokkos::Experimental::infinity_v<double>);
  auto const near = !(square_box_gap(kind, y) > T(1 + 1e-12) * farthest * farthest);
  if constexpr (is_pack<T>) {
    if (!any_lane(near)) return {infinity, infinity};
  } else {
    if (!near) return {infinity, infinity};
  }
  T const size = pair_size(y);
  // As for CloserThan.
  T const budget(16 * Kokkos::Experimental::epsilon_v<double>);
  T const below = select(near, T(closest_points(kind, y).distance - budget * size), infinity);
  return {below, noted_distance(below, size)};
}

/// Chooses those among neighbours, of which what does not change is known.
template <class Precision, class S>
struct StillWithinReach {
  WithinReach<Precision, S> within;

  /// Compiled once, as what contact_kernels.hpp computes: which pairs are candidates must not
  /// depend on the number of threads.
  template <class T, int lanes>
  [[gnu::noinline]] KOKKOS_FUNCTION void judge(PairKind kind, int const (&v)[4][lanes],
                                               Vec3<T> const (&y)[4], PairNote (&note)[lanes],
                                               bool (&keep)[lanes]) const {
    bool one_body[lanes];
    double reach[lanes], watched[lanes], below[lanes], noted[lanes], least[lanes];
    for (int i = 0; i < lanes; ++i) {
      float const d = note[i].distance;
      int const ends[4] = {v[0][i], v[1][i], v[2][i], v[3][i]};
      one_body[i] = d < 0 || (d == 0 && within.activation.one_body(ends));
      reach[i] = within.reach_of(one_body[i]);
      watched[i] = within.watched(note[i].activation);
    }
    T const farthest = load<T>(watched) + within.moving(load<T>(reach), v, y);
    NearDistance<T> const distance = distance_below(kind, y, farthest);
    store(distance.below, below);
    store(distance.noted, noted);
    store(farthest, least);
    for (int i = 0; i < lanes; ++i) {
      keep[i] = below[i] < least[i];
      if (keep[i]) note[i].distance = pair_length(one_body[i], static_cast<float>(noted[i]));
    }
  }
};

/// Where the vertices of a surface are taken to be.
template <class S>
struct Anchors {
  Departure<S> at;          ///< A and P
  Array<double, S> radius;  ///< r, m

  KOKKOS_FUNCTION Motion<Fp64, S> motion() const {
    Motion<Fp64, S> m{at.from};
    if (at.leader >= 0) {
      m.p = at.path;
      m.alpha = 1;
    }
    return m;
  }
};

/// Keeps neighbours, which are judged at their anchors.
template <class S>
struct NearAnchors {
  WithinReach<Fp64, S> within;
  Array<double, S> radius;

  /// Compiled once, as in StillWithinReach.
  template <class T, int lanes>
  [[gnu::noinline]] KOKKOS_FUNCTION void judge(PairKind kind, int const (&v)[4][lanes],
                                               Vec3<T> const (&y)[4], PairNote (&note)[lanes],
                                               bool (&keep)[lanes]) const {
    int const second = kind == PairKind::point_triangle ? 1 : 2;
    bool one_body[lanes];
    double reach[lanes], far[lanes], below[lanes], noted[lanes];
    for (int i = 0; i < lanes; ++i) {
      int const ends[4] = {v[0][i], v[1][i], v[2][i], v[3][i]};
      one_body[i] = within.activation.one_body(ends);
      double r[2] = {0, 0};
      for (int a = 0; a < 4; ++a) {
        double& of_side = r[a < second ? 0 : 1];
        of_side = Kokkos::max(of_side, radius(ends[a]));
      }
      reach[i] = within.reach_of(one_body[i]) + r[0] + r[1];
    }
    T const whole = within.moving(load<T>(reach), v, y);
    store(whole, far);
    NearDistance<T> const distance = distance_below(kind, y, T(T(within.activation.dhat) + whole));
    store(distance.below, below);
    store(distance.noted, noted);
    for (int i = 0; i < lanes; ++i) {
      keep[i] = below[i] < within.activation.dhat + far[i];
      if (!keep[i]) continue;
      int const ends[4] = {v[0][i], v[1][i], v[2][i], v[3][i]};
      note[i].activation = within.activation(kind, ends);
      note[i].distance = pair_length(one_body[i], static_cast<float>(noted[i]));
      keep[i] = below[i] < within.watched(note[i].activation) + far[i];
    }
  }
};

/// Sums of how far the vertices are off their anchors at the start and the end of a motion.
template <class Precision, class S>
struct SumDrift {
  SurfaceViews<S> surface;
  MotionSince<Precision, S> seen;
  double s[2];
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 6>& sum) const {
    int const v = surface.vertex(i);
    Vec3<double> const x = seen.motion.start(v), step = seen.motion.step(v);
    for (int end = 0; end < 2; ++end)
      for (int c = 0; c < 3; ++c)
        sum[3 * end + c] += seen.place(v, c, x, step, end == 1, s[end]).off;
  }
};

struct Progress {
  double start = 0, end = 0;  ///< along a path, 0 to 1
};
template <class Precision, class S>
struct FindProgress {
  using value_type = Progress;
  MotionSince<Precision, S> since;
  KOKKOS_FUNCTION void operator()(int, Progress& p) const {
    p = {since.along(false), since.along(true)};
  }
  KOKKOS_FUNCTION void init(Progress& p) const { p = {}; }
  KOKKOS_FUNCTION void join(Progress& to, Progress const& from) const {
    to = {to.start + from.start, to.end + from.end};
  }
};

/// How a motion is seen from the anchors: where it is along their path, and what all do together.
template <class Precision, class S>
struct SeenFromAnchors {
  MotionSince<Precision, S> since;
  double s[2];            ///< at its start and its end
  Vec3<double> drift[2];  ///< c

  /// Off its anchor, and a bound of the round-off of that, m.
  KOKKOS_FUNCTION Vec3<double> off(int v, int end, double& error) const {
    Vec3<double> const x = since.motion.start(v), step = since.motion.step(v);
    Vec3<double> r;
    error = 0;
    for (int c = 0; c < 3; ++c) {
      auto const at = since.place(v, c, x, step, end == 1, s[end]);
      r[c] = at.off - drift[end][c];
      error += at.off_error() + Kokkos::Experimental::epsilon_v<double> *
                                    (Kokkos::abs(at.off) + Kokkos::abs(drift[end][c]));
    }
    return r;
  }
};

/// Marks the vertices that do not keep to their anchor, or to which a much smaller radius would do.
template <class Precision, class S>
struct FindStrays {
  SurfaceViews<S> surface;
  SeenFromAnchors<Precision, S> seen;
  Array<double, S> radius;
  double least_radius;
  Kokkos::View<std::uint8_t*, typename S::memory> stray;

  KOKKOS_FUNCTION void operator()(int i, int& count) const {
    bool const strays = find(surface.vertex(i));
    stray(surface.vertex(i)) = strays ? 1 : 0;
    count += strays ? 1 : 0;
  }
  /// Compiled once, as what contact_kernels.hpp computes.
  [[gnu::noinline]] KOKKOS_FUNCTION bool find(int v) const {
    double error[2];
    Vec3<double> const start = seen.off(v, 0, error[0]), end = seen.off(v, 1, error[1]);
    double const needed = Kokkos::max(norm(start) + error[0], norm(end) + error[1]);
    bool const loose = radius(v) > 2 * least_radius + 2 * norm(end - start);
    return !(needed < radius(v)) || loose;
  }
  using value_type = int;
  KOKKOS_FUNCTION void init(int& count) const { count = 0; }
  KOKKOS_FUNCTION void join(int& to, int from) const { to += from; }
};

/// Anchors the vertices that stray in the middle of their motion.
template <class Precision, class S>
struct AnchorStrays {
  SurfaceViews<S> surface;
  SeenFromAnchors<Precision, S> seen;
  double least_radius;
  VertexMask<S> stray;
  Anchors<S> anchors;

  KOKKOS_FUNCTION void operator()(int i) const {
    if (stray(surface.vertex(i)) != 0) anchor(surface.vertex(i));
  }
  [[gnu::noinline]] KOKKOS_FUNCTION void anchor(int v) const {
    Vec3<double> const x = seen.since.motion.start(v), step = seen.since.motion.step(v);
    double error[2];
    seen.off(v, 0, error[0]);
    seen.off(v, 1, error[1]);
    Vec3<double> const start = x - seen.drift[0], end = x + step - seen.drift[1];
    for (int c = 0; c < 3; ++c) {
      anchors.at.from(v, c) = 0.5 * start[c] + 0.5 * end[c];
      anchors.at.path(v, c) = 0;
    }
    anchors.radius(v) = 0.5 * norm(end - start) + least_radius + 2 * (error[0] + error[1]);
  }
};

/// Anchors vertex i of the surface where a motion starts, with all of the motion as its path.
template <class Precision, class S>
struct AnchorAll {
  SurfaceViews<S> surface;
  MotionSince<Precision, S> seen;
  double least_radius;
  Anchors<S> anchors;

  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = surface.vertex(i);
    Vec3<double> const x = seen.motion.start(v), step = seen.motion.step(v);
    double error = 0;
    for (int c = 0; c < 3; ++c) {
      anchors.at.from(v, c) = x[c];
      anchors.at.path(v, c) = step[c];
      error += seen.place(v, c, x, step, true, 0).error;
    }
    anchors.radius(v) = least_radius + 4 * error;
  }
};

/// Anchors vertex i of the surface where it is `s` of its path on.
template <class S>
struct SettleAnchors {
  SurfaceViews<S> surface;
  double s;
  Anchors<S> anchors;

  KOKKOS_FUNCTION void operator()(int i) const { settle(surface.vertex(i)); }
  [[gnu::noinline]] KOKKOS_FUNCTION void settle(int v) const {
    double error = 0;
    for (int c = 0; c < 3; ++c) {
      double const from = anchors.at.from(v, c), path = anchors.at.path(v, c);
      anchors.at.from(v, c) = from + s * path;
      anchors.at.path(v, c) = 0;
      error +=
          2 * Kokkos::Experimental::epsilon_v<double> * (Kokkos::abs(from) + Kokkos::abs(path));
    }
    anchors.radius(v) -= error;
  }
};

/// Writes the numbers of those that `chosen` says 1 of to their places.
template <class S, class Chosen>
struct ListChosen {
  Chosen chosen;
  Kokkos::View<int const*, typename S::memory> place;
  Kokkos::View<int*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (chosen(i) != 0) to(place(i)) = i;
  }
};

/// Of triangles and the points that they ask for: those that do not ask themselves.
template <class S>
struct PairTrianglePoint : PairingBase<3, S> {
  HasVertexIn<S, 1> asks;

  template <int n>
  KOKKOS_FUNCTION unsigned accept(AskingGroup<3, n> const& group, unsigned bits, int j) const {
    return asks(j) != 0 ? 0 : this->pairs(group, bits, j);
  }
};

/// Of edges and all others; of two that ask, the first.
template <class S>
struct PairEdgeAnew : PairingBase<2, S> {
  HasVertexIn<S, 2> asks;

  template <int n>
  KOKKOS_FUNCTION unsigned accept(AskingGroup<2, n> const& group, unsigned bits, int j) const {
    if (asks(j) != 0) bits &= bits_where<n>([&](int b) { return group.index[b] < j; });
    return bits == 0 ? 0 : this->pairs(group, bits, j);
  }
};

/// Where pairs are written to as primitives.
template <class S>
struct WritePrimitives {
  PrimitivePairs<S> pairs;
  KOKKOS_FUNCTION int& partner(std::int64_t k) const { return pairs(k, 0); }
  template <class Pairing>
  KOKKOS_FUNCTION void operator()(Pairing const& pairing, int i, int j, std::int64_t k) const {
    int ij[2];
    pairing.order(i, j, ij);
    for (int a = 0; a < 2; ++a) pairs(k, a) = ij[a];
  }
};

/// Pairs of primitives as a source of candidates (JudgePairs), with what has been noted of them.
template <PairKind kind, class S>
struct FoundPrimitives {
  SurfaceViews<S> surface;
  PrimitivePairs<S> pairs;
  KOKKOS_FUNCTION void read(int k, int (&v)[4]) const {
    vertices_of<kind>(surface, pairs(k, 0), pairs(k, 1), v);
  }
};
template <PairKind kind, class S>
struct KnownPrimitives : FoundPrimitives<kind, S> {
  NoteFields<S> notes;
  KOKKOS_FUNCTION PairNote known(int k) const { return notes.read(k); }
};

/// 1 for a pair of which no vertex strays.
template <PairKind kind, class S>
struct KeepsAnchors {
  FoundPrimitives<kind, S> from;
  VertexMask<S> stray;
  Kokkos::View<int*, typename S::memory> kept;
  KOKKOS_FUNCTION void operator()(int k) const {
    int v[4], strays = 0;
    from.read(k, v);
    for (int a = 0; a < 4; ++a) strays |= stray(v[a]);
    kept(k) = strays == 0 ? 1 : 0;
  }
};

/// Moves pair k to place(k) after the `first` ones, if the next one has another place.
template <class S>
struct MovePrimitives {
  PrimitivePairs<S> from, to;
  NoteFields<S> notes_from, notes_to;
  Kokkos::View<int const*, typename S::memory> place;
  int first, count, kept;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const next = k + 1 < count ? place(k + 1) : kept;
    if (next == place(k)) return;
    for (int a = 0; a < 2; ++a) to(first + place(k), a) = from(k, a);
    notes_to.write(first + place(k), notes_from.read(k));
  }
};

/// Lowers to the first vertex whose mark has changed.
template <class S>
struct FindOtherMark {
  FixedMask<S> mark, before;
  KOKKOS_FUNCTION void operator()(int v, int& first) const {
    if (mark(v) != before(v)) first = Kokkos::min(first, v);
  }
};

}  // namespace kernels

}  // namespace taut
