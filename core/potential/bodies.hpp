// Bodies: sets of unknowns that elements connect, whatever the state. What does not last (a pair in
// contact) joins bodies to islands, for as long as it may act.
//
// Sums over each body are made in chunks of its unknowns, in their order: like all sums of the
// library they depend on the number of terms alone, never on the number of threads.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/sparse/pattern.hpp>

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

namespace taut {

template <class S>
struct Bodies {
  using Indices = Kokkos::View<int*, typename S::memory>;
  /// Unknowns of a chunk: as many as one thread sums up (see Reducer).
  static constexpr int chunk_length = S::on_host ? 512 : 32;

  int count = 0;          ///< bodies
  int connected = 0;      ///< those that elements connect: all, or all but the last
  int chunks = 0;         ///< of all of them
  Indices of;             ///< per unknown
  Indices chunk_begin;    ///< per body, +1: its chunks
  Indices unknown_begin;  ///< per chunk, +1: its entries in `unknown`
  Indices unknown;        ///< by body, ascending
};

namespace kernels {

/// Of each of n unknowns, the smallest that elements connect it with; n where it has no element.
inline std::vector<int> smallest_of_body(int n, std::span<Connectivity const> kinds) {
  std::vector<int> parent(n);
  std::iota(parent.begin(), parent.end(), 0);
  auto const root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<char> has_element(n, 0);
  for (Connectivity const& kind : kinds) {
    for (std::size_t k = 0; k < kind.vertices.size(); ++k) {
      std::size_t const first = k - k % std::size_t(kind.per_element);
      int const a = root(kind.vertices[first]), b = root(kind.vertices[k]);
      parent[std::max(a, b)] = std::min(a, b);
      has_element[kind.vertices[k]] = 1;
    }
  }
  // A parent is never larger than its child, so that it is a root by now.
  for (int v = 0; v < n; ++v) parent[v] = has_element[v] ? parent[parent[v]] : n;
  return parent;
}

/// The partial sums of chunk c.
template <class S, class View, class Functor, class T, int K>
struct SumChunk {
  Bodies<S> bodies;
  Functor functor;
  View partial;
  KOKKOS_FUNCTION void operator()(int c) const {
    Sums<T, K> sums;
    for (int j = bodies.unknown_begin(c); j < bodies.unknown_begin(c + 1); ++j) {
      functor(bodies.unknown(j), sums);
    }
    for (int k = 0; k < K; ++k) partial(K * c + k) = sums[k];
  }
};

/// Adds up the chunks of body b.
template <class S, class View, int K>
struct SumBody {
  Bodies<S> bodies;
  View partial, total;
  KOKKOS_FUNCTION void operator()(int b) const {
    for (int k = 0; k < K; ++k) {
      typename View::non_const_value_type sum = 0;
      for (int c = bodies.chunk_begin(b); c < bodies.chunk_begin(b + 1); ++c) {
        sum += partial(K * c + k);
      }
      total(K * b + k) = sum;
    }
  }
};

/// label(b) becomes the label of the body that it names.
template <class S>
struct FollowLabels {
  typename Bodies<S>::Indices label;
  KOKKOS_FUNCTION void operator()(int b, int& changed) const {
    int const mine = Kokkos::atomic_load(&label(b)), next = Kokkos::atomic_load(&label(mine));
    if (next >= mine) return;
    Kokkos::atomic_min(&label(b), next);
    changed = 1;
  }
};

/// Gives two bodies the smaller of their labels. Labels only fall, and end at the smallest body of
/// each set that is joined: the same in any order.
template <class Indices>
KOKKOS_INLINE_FUNCTION void join_labels(Indices const& label, int a, int b, int& changed) {
  if (a == b) return;
  int const of_a = Kokkos::atomic_load(&label(a)), of_b = Kokkos::atomic_load(&label(b));
  if (of_a == of_b) return;
  int const smaller = Kokkos::min(of_a, of_b);
  Kokkos::atomic_min(&label(a), smaller);
  Kokkos::atomic_min(&label(b), smaller);
  changed = 1;
}

}  // namespace kernels

/// The bodies that elements make of n unknowns, numbered by their smallest unknown. Unknowns
/// without an element (the surfaces of obstacles) are one more body, the last.
template <class S>
Bodies<S> make_bodies(int n, std::span<Connectivity const> kinds) {
  std::vector<int> const smallest = kernels::smallest_of_body(n, kinds);
  std::vector<int> number(n + 1, -1), of(n);
  int count = 0;
  for (int v = 0; v < n; ++v) {
    if (smallest[v] == v) number[v] = count++;
  }
  bool const loose = std::find(smallest.begin(), smallest.end(), n) != smallest.end();
  if (loose) number[n] = count++;
  std::vector<std::vector<int>> unknowns(count);
  for (int v = 0; v < n; ++v) unknowns[of[v] = number[smallest[v]]].push_back(v);

  std::vector<int> chunk_begin{0}, unknown_begin{0}, unknown;
  for (auto const& body : unknowns) {
    int const first = static_cast<int>(unknown.size());
    unknown.insert(unknown.end(), body.begin(), body.end());
    int const last = static_cast<int>(unknown.size());
    for (int begin = first; begin < last;) {
      begin = std::min(begin + Bodies<S>::chunk_length, last);
      unknown_begin.push_back(begin);
    }
    chunk_begin.push_back(static_cast<int>(unknown_begin.size()) - 1);
  }
  return {count,
          loose ? count - 1 : count,
          static_cast<int>(unknown_begin.size()) - 1,
          to_space<S>("body_of", of),
          to_space<S>("body_chunks", chunk_begin),
          to_space<S>("body_unknown_begin", unknown_begin),
          to_space<S>("body_unknowns", unknown)};
}

/// Sums over each body, up to `max_sums` side by side. Owns its memory, so that a sum allocates
/// nothing.
template <class S, class T>
class BodySums {
public:
  BodySums() = default;
  explicit BodySums(Bodies<S> const& bodies, int max_sums)
      : bodies_(bodies),
        max_sums_(max_sums),
        partial_("body_partial", std::size_t(bodies.chunks) * max_sums),
        total_("body_total", std::size_t(bodies.count) * max_sums),
        host_(Kokkos::create_mirror_view(Kokkos::HostSpace(), total_)) {}

  /// `functor(i, Sums<T, K>& sums)` adds the terms of unknown i. Sum k of body b is at K b + k of
  /// what is returned, which lasts until the next sum. Throws Error for too many sums.
  template <int K, class Functor>
  std::span<T const> sum(char const* name, Functor const& functor) const& {
    if (K > max_sums_) {
      throw Error("{}: memory for {} sums of each body cannot take {}: construct it for as many",
                  name, max_sums_, K);
    }
    for_each<S>(name, bodies_.chunks,
                kernels::SumChunk<S, View, Functor, T, K>{bodies_, functor, partial_});
    for_each<S>(name, bodies_.count, kernels::SumBody<S, View, K>{bodies_, partial_, total_});
    auto const used = Kokkos::make_pair(std::size_t(0), std::size_t(K) * bodies_.count);
    assign_on<S>(Kokkos::subview(host_, used), Kokkos::subview(total_, used));
    S::instance().fence("taut: sums over bodies");
    return {host_.data(), std::size_t(K) * bodies_.count};
  }
  /// What is returned would be gone with a temporary.
  template <int K, class Functor>
  std::span<T const> sum(char const* name, Functor const& functor) const&& = delete;

private:
  using View = Kokkos::View<T*, typename S::memory>;
  Bodies<S> bodies_;
  int max_sums_ = 0;
  View partial_, total_;
  typename Kokkos::View<T*, Kokkos::HostSpace> host_;
};

}  // namespace taut
