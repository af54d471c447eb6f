// Loops and reductions over Kokkos, with names that profilers see.
//
// Sums are deterministic: the terms are added in runs of fixed length, each by one thread in index
// order, and the run sums are added the same way until few are left. The shape of the sum depends
// on the number of terms alone, never on the number of threads, so results are bitwise repeatable.
// `FreeReducer` is the opt-out: it leaves the order to Kokkos.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/host_loop.hpp>
#include <taut/core/report/error.hpp>

#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace taut {

/// The name of a loop as Kokkos takes it, kept from its first use on: a std::string made anew for
/// each loop would be an allocation per loop. Safe to call from several threads.
inline std::string const& label(std::string_view name) {
  static std::mutex mutex;
  static std::set<std::string, std::less<>> labels;
  std::lock_guard<std::mutex> const lock(mutex);
  auto const found = labels.find(name);
  return found != labels.end() ? *found : *labels.emplace(name).first;
}

/// Calls `functor(i)` for i in [0, n).
template <class S, class Functor>
void for_each(char const* name, int n, Functor const& functor) {
  if constexpr (S::on_host) {
    kernels::host_loop(S::instance(), label(name), n, kernels::run_range<Functor>, &functor);
  } else {
    Kokkos::parallel_for(label(name),
                         Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, n), functor);
  }
}

namespace kernels {

/// Where `bytes` for a team go if its fastest memory holds `fastest` of them: level 1 is larger.
constexpr int scratch_level(std::size_t bytes, std::size_t fastest) {
  return bytes <= fastest ? 0 : 1;
}

}  // namespace kernels

/// Calls `functor(team)` for `teams` teams of `team_size` threads, each with `scratch` bytes of its
/// own: at level 0, or on a device where that is too small and the functor has a `scratch_level`
/// that can tell it so, at level 1.
template <class S, class Functor>
void for_each_team(char const* name, int teams, int team_size, std::size_t scratch,
                   Functor const& functor) {
  if (teams == 0) return;
  typename S::team_policy policy(S::instance(), teams, team_size);
  auto const provide = [&](int level) {
    if (scratch > 0) policy.set_scratch_size(level, Kokkos::PerTeam(static_cast<int>(scratch)));
  };
  if constexpr (S::on_host) {
    using Execution = typename S::execution;
    provide(0);
    kernels::host_team_loop<Execution>(policy, label(name), kernels::run_team<Execution, Functor>,
                                       &functor);
  } else if constexpr (requires(Functor f) { f.scratch_level = 0; }) {
    Functor placed = functor;
    placed.scratch_level = kernels::scratch_level(scratch, policy.scratch_size_max(0));
    provide(placed.scratch_level);
    Kokkos::parallel_for(label(name), policy, placed);
  } else {
    provide(0);
    Kokkos::parallel_for(label(name), policy, functor);
  }
}

namespace kernels {

/// What a functor makes of `start` over one run of a loop.
template <class T, class Functor>
struct FoldRun {
  Functor functor;
  T start;
  T* to;
  int n, length;
  KOKKOS_FUNCTION void operator()(int r) const {
    T value = start;
    int const first = r * length, last = first + Kokkos::min(length, n - first);
    for (int i = first; i < last; ++i) functor(i, value);
    to[r] = value;
  }
};

/// A functor that raises or lowers a number, as one of `join_all`.
template <class T, class Functor, bool largest>
struct Extreme {
  using value_type = T;
  Functor functor;
  T start;
  KOKKOS_FUNCTION void operator()(int i, T& value) const { functor(i, value); }
  KOKKOS_FUNCTION void init(T& value) const { value = start; }
  KOKKOS_FUNCTION void join(T& to, T const& from) const {
    if (largest ? to < from : from < to) to = from;
  }
};

}  // namespace kernels

/// What a functor of Kokkos's form (value_type, init, join, `functor(i, value)`) makes of [0, n),
/// where the order of its joins is free. Waits for it. On the host in up to `runs` runs on the
/// stack: Kokkos would make a string for the name of a fence in each reduction.
template <class S, class Functor>
typename Functor::value_type join_all(char const* name, int n, Functor const& functor) {
  using T = typename Functor::value_type;
  T result;
  functor.init(result);
  if (n <= 0) return result;
  if constexpr (S::on_host) {
    constexpr int runs = sizeof(T) > 64 ? 64 : 256;
    T part[runs];
    int const length = n / runs + 1, count = n / length + (n % length > 0);
    for_each<S>(name, count, kernels::FoldRun<T, Functor>{functor, result, part, n, length});
    S::instance().fence(label(name));
    for (int r = 0; r < count; ++r) functor.join(result, part[r]);
  } else {
    Kokkos::parallel_reduce(label(name),
                            Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, n),
                            functor, result);
    S::instance().fence(label(name));
  }
  return result;
}

/// Calls `functor(i, largest)` for i in [0, n), where `functor` raises `largest`; returns it, or
/// `floor` if n = 0. A maximum is exact, so its order is free.
template <class S, class T, class Functor>
T maximum(char const* name, int n, T floor, Functor const& functor) {
  return join_all<S>(name, n, kernels::Extreme<T, Functor, true>{functor, floor});
}

/// As `maximum`, for the smallest.
template <class S, class T, class Functor>
T minimum(char const* name, int n, T ceiling, Functor const& functor) {
  return join_all<S>(name, n, kernels::Extreme<T, Functor, false>{functor, ceiling});
}

/// K sums that are accumulated side by side.
template <class T, int K>
struct Sums {
  T value[K] = {};
  KOKKOS_FORCEINLINE_FUNCTION T& operator[](int k) { return value[k]; }
  KOKKOS_FORCEINLINE_FUNCTION T const& operator[](int k) const { return value[k]; }
  KOKKOS_FORCEINLINE_FUNCTION void operator+=(Sums const& other) {
    for (int k = 0; k < K; ++k) value[k] += other.value[k];
  }
};

namespace kernels {

/// Sums run `r` of a loop body.
template <class View, class Functor, class T, int K>
struct SumRun {
  Functor functor;
  View partial;
  int n, length;
  KOKKOS_FUNCTION void operator()(int r) const {
    Sums<T, K> sums;
    int const first = r * length, last = first + Kokkos::min(length, n - first);
    for (int i = first; i < last; ++i) functor(i, sums);
    for (int k = 0; k < K; ++k) partial(K * r + k) = sums[k];
  }
};

/// Sums runs of earlier partial sums.
template <class View, class T, int K>
struct SumPartials {
  View from;
  KOKKOS_FUNCTION void operator()(int i, Sums<T, K>& sums) const {
    for (int k = 0; k < K; ++k) sums[k] += from(K * i + k);
  }
};

}  // namespace kernels

/// Deterministic sums of up to `max_sums` values side by side over loops of up to `max_terms`
/// iterations. Owns its scratch memory, so that a sum allocates nothing.
template <class S, class T = double>
class Reducer {
public:
  /// Length of a run: long on the host, where a thread does many; short on a device, where there
  /// are thousands of threads to feed.
  static constexpr int run_length = S::on_host ? 512 : 32;

  Reducer() = default;
  explicit Reducer(int max_terms, int max_sums = 8)
      : max_terms_(max_terms),
        max_sums_(max_sums),
        first_("reducer_first", std::size_t(runs(max_terms)) * max_sums),
        second_("reducer_second", std::size_t(runs(runs(max_terms))) * max_sums),
        host_("reducer_host", std::size_t(run_length) * max_sums) {}

  /// For kernels that leave `count` partial sums by themselves.
  static Reducer of_partials(int count, int max_sums = 1) {
    return Reducer(count * run_length, max_sums);
  }

  /// Makes room for as many, if there is not.
  void provide(int max_terms, int max_sums = 8) {
    if (max_terms_ >= max_terms && max_sums_ >= max_sums) return;
    bool const first = max_terms_ == 0;
    *this = Reducer();  // the old memory first
    *this = Reducer(first ? max_terms : max_terms + max_terms / 2, max_sums);
  }

  /// `functor(i, Sums<T, K>& sums)` adds the terms of iteration i. Throws Error if there are more
  /// terms or sums than the scratch memory was made for.
  template <int K, class Functor>
  Sums<T, K> sum(char const* name, int n, Functor const& functor) const {
    if (n == 0) return {};
    check(name, n, max_terms_, K);
    int count = runs(n);
    for_each<S>(name, count, kernels::SumRun<View, Functor, T, K>{functor, first_, n, run_length});
    return finish<K>(name, count);
  }

  /// The sum of `count` partial sums that a kernel has left in `partials()`, at K * i + k.
  template <int K>
  Sums<T, K> finish(char const* name, int count) const {
    if (count == 0) return {};
    check(name, count, runs(max_terms_), K);
    View from = first_, to = second_;
    while (count > run_length) {
      int const next = runs(count);
      using Functor = kernels::SumPartials<View, T, K>;
      for_each<S>(name, next,
                  kernels::SumRun<View, Functor, T, K>{Functor{from}, to, count, run_length});
      std::swap(from, to);
      count = next;
    }
    auto const range = Kokkos::make_pair(std::size_t(0), std::size_t(K) * count);
    assign_on<S>(Kokkos::subview(host_, range), Kokkos::subview(from, range));
    S::instance().fence("taut: reduction");
    Sums<T, K> total;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < K; ++k) total[k] += host_(K * i + k);
    return total;
  }

  /// Where a kernel that sums by itself (one partial per block of its own) leaves its partial sums.
  Kokkos::View<T*, typename S::memory> partials() const { return first_; }

private:
  using View = Kokkos::View<T*, typename S::memory>;
  static int runs(int n) { return n / run_length + (n % run_length > 0); }
  void check(char const* name, int terms, int max_terms, int sums) const {
    if (terms > max_terms || sums > max_sums_) {
      throw Error(
          "{}: a reducer for {} sums of {} terms cannot take {} sums of {}: construct it "
          "for as many",
          name, max_sums_, max_terms, sums, terms);
    }
  }

  int max_terms_ = 0, max_sums_ = 0;
  View first_, second_;
  Kokkos::View<T*, Kokkos::HostSpace> host_;
};

/// The opt-out: sums in the order that Kokkos chooses; bitwise repeatable for one thread only.
template <class S, class T = double>
class FreeReducer {
public:
  FreeReducer() = default;
  explicit FreeReducer(int, int = 8) {}

  template <int K, class Functor>
  Sums<T, K> sum(char const* name, int n, Functor const& functor) const;
};

namespace kernels {
template <class Functor, class T, int K>
struct FreeSum {
  using value_type = Sums<T, K>;
  Functor functor;
  KOKKOS_FUNCTION void operator()(int i, value_type& sums) const { functor(i, sums); }
  KOKKOS_FUNCTION void join(value_type& to, value_type const& from) const { to += from; }
  KOKKOS_FUNCTION void init(value_type& sums) const { sums = {}; }
};
}  // namespace kernels

template <class S, class T>
template <int K, class Functor>
Sums<T, K> FreeReducer<S, T>::sum(char const* name, int n, Functor const& functor) const {
  Sums<T, K> total;
  Kokkos::parallel_reduce(label(name),
                          Kokkos::RangePolicy<typename S::execution>(S::instance(), 0, n),
                          kernels::FreeSum<Functor, T, K>{functor}, total);
  return total;
}

}  // namespace taut
