// Candidates for contact: lists of pairs that a search found, as the vertices of each. They live
// where the kernels run. A list grows when a search finds more than it can hold, and never loses a
// pair; while nothing grows, nothing is allocated.
//
// A list can be cut down to what a filter keeps, in the same order: closeness proper
// (`CloserThan`), or the paper's exclusion of pairs that are close at rest (activation.hpp). A
// filter may note what it has computed of the pairs that it keeps.
#pragma once

#include <taut/contact/closest_features.hpp>
#include <taut/contact/displacement.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/scan.hpp>

#include <limits>
#include <string>
#include <utility>

namespace taut {

/// The vertices of each pair: of point_triangle the point and the corners of the triangle, of
/// edge_edge the ends of an edge and of another, the edge that comes first in the surface first.
template <class S>
using PairIds = Kokkos::View<int* [4], typename S::layout, typename S::memory>;
/// The same, to read.
template <class S>
using PairList = Kokkos::View<int const* [4], typename S::layout, typename S::memory>;

/// Where the vertices of a pair are at `x`.
template <class Positions>
KOKKOS_INLINE_FUNCTION void gather(int const (&v)[4], Positions const& x, Vec3<double> (&y)[4]) {
  for (int a = 0; a < 4; ++a)
    for (int c = 0; c < 3; ++c) y[a][c] = double(x(v[a], c));
}

/// How far the vertices of a pair, or of a pack of them, are spread; m.
template <class T>
KOKKOS_INLINE_FUNCTION T pair_size(Vec3<T> const (&y)[4]) {
  T size(0.0);
  for (int a = 1; a < 4; ++a) size += norm(y[a] - y[0]);
  return size;
}

/// A distance is noted less this share of it.
inline constexpr double noted_less = 1e-6;

/// What to note of a pair, or of a pack of them, whose distance was computed as `below` to at most
/// 1e-14 of its size, m: 0 where that may be more than a millionth.
template <class T>
KOKKOS_INLINE_FUNCTION T noted_distance(T const& below, T const& size) {
  return select(below > T(1e-8) * size, T(T(1 - noted_less) * below), T(0.0));
}

/// How far apart the pairs of a list were where they were found, in m, each a little less than it
/// was, and by how much their distances may have changed since, at any time of a motion. It tells
/// that a pair is out of reach for the price of one number.
template <class S>
struct FoundDistances {
  Array<float, S> at;  ///< pair_length; empty: nothing is known
  Displacement moved;

  KOKKOS_FUNCTION double least(int k) const { return Kokkos::abs(at(k)) - moved.of(at(k)); }
  /// Where at(k) is not 0.
  KOKKOS_FUNCTION double most(int k) const {
    return Kokkos::abs(at(k)) * (1 + 4 * noted_less) + moved.of(at(k));
  }
};

/// What a filter computes of a pair on the way.
struct PairNote {
  float distance = 0;     ///< m, as FoundDistances::at
  double activation = 0;  ///< the distance below which the pair acts, m
};

namespace kernels {

template <class S>
struct NoteFields {
  Array<float, S> distance;
  Array<double, S> activation;

  /// For `count` pairs; what was noted is lost where that takes other memory.
  void make_room(int count) {
    grow(distance, "candidate_distance", count);
    grow(activation, "candidate_activation", count);
  }
  KOKKOS_FUNCTION PairNote read(int k) const { return {distance(k), activation(k)}; }
  KOKKOS_FUNCTION void write(int k, PairNote const& note) const {
    distance(k) = note.distance;
    activation(k) = note.activation;
  }
};

/// A filter that judges a pack of pairs at once, and notes what it has computed of those that it
/// keeps: `judge(kind, v, y, note, keep)`, with the vertices v[a][lane].
template <class Filter>
concept NotingFilter = requires(Filter const& filter, int const (&v)[4][1],
                                Vec3<double> const (&y)[4], PairNote (&note)[1], bool (&keep)[1]) {
  filter.judge(PairKind::edge_edge, v, y, note, keep);
};

template <class Ids>
KOKKOS_INLINE_FUNCTION void read_pair(Ids const& ids, std::int64_t k, int (&v)[4]) {
  for (int a = 0; a < 4; ++a) v[a] = ids(k, a);
}
template <class Ids>
KOKKOS_INLINE_FUNCTION void write_pair(int const (&v)[4], Ids const& ids, std::int64_t k) {
  for (int a = 0; a < 4; ++a) ids(k, a) = v[a];
}

/// Pairs to choose from: `read(k, v)` gives the vertices of pair k. If there is `known(k)`, a
/// filter starts from that note.
template <class S>
struct ListedPairs {
  PairIds<S> ids;
  KOKKOS_FUNCTION void read(int k, int (&v)[4]) const { read_pair(ids, k, v); }
};

/// Whether the pairs of pack g are kept, as 1 or 0, and what is noted of them.
template <PairKind kind, class S, class Source, class Positions, class Filter>
struct JudgePairs {
  using Lanes = std::conditional_t<S::on_host && NotingFilter<Filter>, HostPack<double>, double>;
  static constexpr int lanes = ScalarTraits<Lanes>::lanes;

  Source pairs;
  Positions x;
  Filter filter;
  int count;
  Kokkos::View<int*, typename S::memory> kept;
  NoteFields<S> notes;

  int packs() const { return (count + lanes - 1) / lanes; }
  KOKKOS_FUNCTION void operator()(int g) const {
    if constexpr (NotingFilter<Filter>) {
      side_by_side(lanes * g);
    } else {
      int v[4];
      Vec3<double> y[4];
      pairs.read(g, v);
      gather(v, x, y);
      kept(g) = filter(kind, v, y) ? 1 : 0;
    }
  }

private:
  KOKKOS_FUNCTION void side_by_side(int first) const {
    int const n = Kokkos::min(int(lanes), count - first);
    int v[4][lanes];
    PairNote note[lanes];
    for (int i = 0; i < lanes; ++i) {
      int const k = i < n ? first + i : first;
      int of_pair[4];
      pairs.read(k, of_pair);
      for (int a = 0; a < 4; ++a) v[a][i] = of_pair[a];
      if constexpr (requires { pairs.known(k); }) note[i] = pairs.known(k);
    }
    Vec3<Lanes> y[4];
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) {
        if constexpr (is_pack<Lanes>) {
          y[a][c] = Lanes([&](std::size_t i) { return double(x(v[a][i], c)); });
        } else {
          y[a][c] = double(x(v[a][0], c));
        }
      }
    bool keep[lanes];
    filter.judge(kind, v, y, note, keep);
    for (int i = 0; i < n; ++i) {
      kept(first + i) = keep[i] ? 1 : 0;
      if (keep[i]) notes.write(first + i, note[i]);
    }
  }
};

/// Moves pair k to place(k), if the next one has another place.
template <class S, class Source>
struct MovePairs {
  Source from;
  Kokkos::View<int const*, typename S::memory> place;
  PairIds<S> to;
  NoteFields<S> notes_from, notes_to;  ///< empty: without
  int count, kept;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const next = k + 1 < count ? place(k + 1) : kept;
    if (next == place(k)) return;
    int v[4];
    from.read(k, v);
    write_pair(v, to, place(k));
    if (notes_to.distance.extent(0) > 0) notes_to.write(place(k), notes_from.read(k));
  }
};

}  // namespace kernels

/// Throws Error if `count` pairs are more than `most`.
inline void refuse_pairs_beyond(std::int64_t most, std::int64_t count) {
  if (count <= most) return;
  throw Error(
      "contact: {} candidate pairs are more than a list can hold: search within a smaller radius, "
      "or look for a vertex that has flown off",
      count);
}

/// A list of pairs of one kind.
template <PairKind kind, class S>
class CandidateList {
public:
  int count() const { return count_; }
  /// `count()` pairs. Valid until the list is changed.
  PairIds<S> ids() const { return PairIds<S>(ids_, Kokkos::make_pair(0, count_), Kokkos::ALL); }
  /// What the last filter has noted of each, if it was one that notes.
  Array<float, S> distance() const { return notes_.distance; }
  Array<double, S> activation() const { return notes_.activation; }

  /// Makes room for `count` pairs and takes them for the list; what was in it is lost. Throws Error
  /// if there are more than an int can count.
  void resize(std::int64_t count) {
    refuse_pairs_beyond(std::numeric_limits<int>::max(), count);
    grow(ids_, "candidates", static_cast<std::size_t>(count));
    count_ = static_cast<int>(count);
  }

  /// Leaves the pairs for which `filter(kind, v, y)` says so, or a NotingFilter; v are the vertices
  /// of a pair and y is where these are at `x`.
  template <class Filter, class Positions>
  void keep(Filter const& filter, Positions const& x) {
    std::swap(ids_, spare_);
    take(kernels::ListedPairs<S>{spare_}, count_, filter, x);
  }
  /// Becomes what the filter leaves of the first `count` pairs of a source, in their order.
  template <class Source, class Filter, class Positions>
  void take(Source const& from, int count, Filter const& filter, Positions const& x) {
    constexpr bool notes = kernels::NotingFilter<Filter>;
    grow(place_, "candidate_place", count);
    if constexpr (notes) judged_.make_room(count);
    kernels::JudgePairs<kind, S, Source, Positions, Filter> const judge{from,  x,      filter,
                                                                        count, place_, judged_};
    for_each<S>("candidates_judge", judge.packs(), judge);
    Kokkos::View<int*, typename S::memory> const place(place_, Kokkos::make_pair(0, count));
    int const kept = exclusive_scan<S, int>("candidates_place", place);
    grow(ids_, "candidates", kept);
    if constexpr (notes) {
      notes_.make_room(kept);
    } else {
      notes_ = {};
    }
    for_each<S>("candidates_move", count,
                kernels::MovePairs<S, Source>{from, place, ids_, judged_, notes_, count, kept});
    count_ = kept;
  }

private:
  PairIds<S> ids_, spare_;
  kernels::NoteFields<S> notes_, judged_;
  Kokkos::View<int*, typename S::memory> place_;
  int count_ = 0;
};

/// What a search finds.
template <class S>
struct Candidates {
  CandidateList<PairKind::point_triangle, S> point_triangle;
  CandidateList<PairKind::edge_edge, S> edge_edge;

  template <class Filter, class Positions>
  void keep(Filter const& filter, Positions const& x) {
    point_triangle.keep(filter, x);
    edge_edge.keep(filter, x);
  }
};

/// Keeps what is closer than `radius`, m, give or take the round-off of the distance: nothing that
/// is closer by arithmetic in `Real` is lost.
template <class Real>
struct CloserThan {
  double radius;

  KOKKOS_FUNCTION bool operator()(PairKind kind, int const (&)[4],
                                  Vec3<double> const (&y)[4]) const {
    // 4 epsilon (|b| + |e1| + |e2|) of closest_features.hpp; the sum is 3 sizes at most.
    constexpr double budget = 16 * Kokkos::Experimental::epsilon_v<Real>;
    return closest_points(kind, y).distance < radius + budget * pair_size(y);
  }
};

}  // namespace taut
