// What is put down next to something stays where it is put. Below dhat a barrier pushes, and the
// stiffer a pair is taken to be the further it throws what starts there: K grows with 1 / h^2. So
// pairs act, at a vertex, below
//
//   a_v = min(dhat, s G),   G the largest gap of v that a step has begun with, s < 1 the share:
//
// no pair acts where it starts, and whoever has once been further apart acts from further on. A
// pair never comes to act because a_v grows: s G is less than its own distance then.
//
// This keeps a_v for a term, which says what the gap of a vertex is: start_gaps.hpp, of pairs of
// two bodies; obstacle.hpp, of faces.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/report/error.hpp>

namespace taut {
namespace kernels {

/// Raises a_i from gap(i) as it is now; says whether any stays below dhat.
template <class Gap, class S>
struct RaiseActivation {
  Gap gap;
  Array<double, S> activation;
  double dhat, share;
  bool first;  ///< no step has begun before

  KOKKOS_FUNCTION void operator()(int i, int& any) const {
    double const before = first ? 0 : activation(i);
    activation(i) = Kokkos::min(dhat, Kokkos::max(before, share * gap(i)));
    any = Kokkos::max(any, activation(i) < dhat ? 1 : 0);
  }
};

}  // namespace kernels

template <class S>
class StartActivation {
public:
  StartActivation() = default;
  /// For `count` vertices. `share`: s; 0: all act below dhat (m), however they start. Throws Error,
  /// in the name of `term`, unless it is from 0 on and below 1.
  StartActivation(char const* term, std::size_t count, double dhat, double share)
      : of_vertex_("activation_of_vertex", count), dhat_(dhat), share_(share), short_(share > 0) {
    if (!(share >= 0 && share < 1)) {
      throw Error(
          "{}: pairs that act below {} of the gap they start with: give a share from 0 on and "
          "below "
          "1",
          term, share);
    }
    assign(of_vertex_, dhat);
  }

  /// a_v, m.
  Array<double, S> const& of_vertex() const { return of_vertex_; }
  /// Whether any may be below dhat, so that gaps are to be looked at when a step begins.
  bool is_short() const { return short_; }
  /// A gap from which on a_v is dhat, m.
  double full_gap() const { return dhat_ / share_; }

  /// A step begins, with `gap(i)` at vertex i (m).
  template <class Gap>
  void raise(Gap const& gap) {
    int const n = of_vertex_.extent_int(0);
    kernels::RaiseActivation<Gap, S> const raise{gap, of_vertex_, dhat_, share_, first_};
    short_ = maximum<S>("start_activation", n, 0, raise) > 0;
    first_ = false;
  }
  /// For checkpoints: goes on with these a_v, m.
  void set(Array<double, S> const& of_vertex) {
    if (share_ == 0) return;
    assign(of_vertex_, of_vertex);
    first_ = false;
    short_ = true;  // the next step finds out
  }

private:
  Array<double, S> of_vertex_;
  double dhat_ = 0, share_ = 0;
  bool short_ = false, first_ = true;
};

}  // namespace taut
