// The gaps that bodies begin a step with: of a vertex, the least distance of all pairs of two
// bodies that it is part of. Below how much of it pairs of the vertex act is told in
// start_activation.hpp; a pair acts below the least of its four. Where all act below dhat nothing
// is searched.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>
#include <taut/contact/start_activation.hpp>

#include <limits>
#include <memory>

namespace taut {
namespace kernels {

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
  /// `start` keeps the a_v of the vertices of the mesh.
  StartGaps(SurfaceViews<Space> const& surface, Activation<Space> const& activation,
            StartActivation<Space> const& start, double edge_length,
            typename Policy::Params const& params)
      : surface_(surface),
        activation_(activation),
        start_(start),
        edge_length_(edge_length),
        params_(params) {}

  /// Looks at the gaps that a step begins with.
  void begin_step(Positions const& x, FixedMask<Space> const& fixed) {
    if (!start_.is_short()) return;
    if (!search_) {
      search_ = std::make_shared<PairSearch<Policy>>(surface_, edge_length_, params_);
      gap_ = Array<double, Space>("contact_gap", start_.of_vertex().extent(0));
    }
    assign_on<Space>(gap_, std::numeric_limits<double>::infinity());
    search_->find(Motion<Precision, Space>{x, {}, 0, fixed, true}, start_.full_gap(), found_);
    lower(found_.point_triangle, x);
    lower(found_.edge_edge, x);
    start_.raise(gap_);
    if (!start_.is_short()) forget();
  }
  /// For checkpoints, as StartActivation.
  void set(Array<double, Space> const& of_vertex) { start_.set(of_vertex); }

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
  StartActivation<Space> start_;
  double edge_length_ = 0;
  typename Policy::Params params_;
  std::shared_ptr<PairSearch<Policy>> search_;
  Candidates<Space> found_;
  Array<double, Space> gap_;
};

}  // namespace taut
