// Bodies that are put down next to each other stay where they are put. Below dhat a barrier
// pushes, and the stiffer a pair is taken to be the further it throws what starts there: K grows
// with 1 / h^2. So pairs of two bodies act, at a vertex, below
//
//   a_v = min(dhat, s G),   G the largest gap of v that a step has begun with, s < 1 the share,
//
// and a pair below the least a_v of its four vertices: no pair acts where it starts, and whoever
// has once been further apart acts from further on. A pair never comes to act because a_v grows:
// s G is less than its own distance then.
//
// The gap of a vertex is the least distance of all pairs of two bodies that it is part of. Where
// all a_v are dhat nothing is searched.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>

#include <limits>
#include <memory>

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

/// Lowers the gaps of the vertices of pair k to its distance, unless it is of one body.
template <PairKind kind, class Precision, class S>
struct LowerGaps {
  PairList<S> ids;
  Activation<S> activation;
  VectorField<typename Precision::position, S> x;
  Array<double, S> gap;

  KOKKOS_FUNCTION void operator()(int k) const {
    int v[4];
    read_pair(ids, k, v);
    if (activation.one_body(v)) return;
    double const d = distance(v);
    for (int vertex : v) Kokkos::atomic_min(&gap(vertex), d);
  }
  /// Compiled once, as what contact_kernels.hpp computes.
  [[gnu::noinline]] KOKKOS_FUNCTION double distance(int const (&v)[4]) const {
    Vec3<double> y[4];
    gather(v, x, y);
    return closest_points(kind, y).distance;
  }
};

}  // namespace kernels

template <BroadPhase Policy, class Precision>
class StartGaps {
public:
  using Space = typename Policy::Space;
  using Positions = VectorField<typename Precision::position, Space>;

  StartGaps() = default;
  /// `share`: s, below 1; 0: pairs act below dhat, however they start. `activation.of_vertex` is
  /// what this keeps.
  StartGaps(SurfaceViews<Space> const& surface, Activation<Space> const& activation, double share,
            double edge_length, typename Policy::Params const& params)
      : surface_(surface),
        activation_(activation),
        share_(share),
        edge_length_(edge_length),
        params_(params),
        short_(share > 0) {
    if (!(share >= 0 && share < 1)) {
      throw Error(
          "contact: pairs that act below {} of the gap they start with: give a share from 0 on and "
          "below 1",
          share);
    }
  }

  /// Looks at the gaps that a step begins with.
  void begin_step(Positions const& x, FixedMask<Space> const& fixed) {
    if (!short_) return;
    int const n = activation_.of_vertex.extent_int(0);
    if (!search_) {
      search_ = std::make_shared<PairSearch<Policy>>(surface_, edge_length_, params_);
      gap_ = Array<double, Space>("contact_gap", n);
    }
    assign_on<Space>(gap_, std::numeric_limits<double>::infinity());
    search_->find(Motion<Precision, Space>{x, {}, 0, fixed, true}, activation_.dhat / share_,
                  found_);
    lower(found_.point_triangle, x);
    lower(found_.edge_edge, x);
    kernels::RaiseActivation<Array<double, Space>, Space> const raise{
        gap_, activation_.of_vertex, activation_.dhat, share_, first_};
    short_ = maximum<Space>("contact_start_gaps", n, 0, raise) > 0;
    first_ = false;
    if (!short_) forget();
  }
  /// For checkpoints: a_v of each vertex of the mesh, m.
  void set(Array<double, Space> const& of_vertex) {
    if (share_ == 0) return;
    assign(activation_.of_vertex, of_vertex);
    first_ = false;
    short_ = true;  // the next step finds out
  }

private:
  template <PairKind kind>
  void lower(CandidateList<kind, Space> const& list, Positions const& x) const {
    using Kernel = kernels::LowerGaps<kind, Precision, Space>;
    for_each<Space>("contact_gaps", list.count(), Kernel{list.ids(), activation_, x, gap_});
  }
  void forget() {
    search_.reset();
    found_ = {};
    gap_ = {};
  }

  SurfaceViews<Space> surface_;
  Activation<Space> activation_;
  double share_ = 0, edge_length_ = 0;
  typename Policy::Params params_;
  bool short_ = false, first_ = true;
  std::shared_ptr<PairSearch<Policy>> search_;
  Candidates<Space> found_;
  Array<double, Space> gap_;
};

}  // namespace taut
