// Two-level additive Schwarz preconditioner,
//   P = sum_k R_k' (R_k H R_k')^-1 R_k + R_0' (R_0 H R_0')^-1 R_0,
// with the aggregates k = consecutive runs of the unknowns, which lie close together in an order
// that preserves locality, and the affine motions of longer runs, of one body each, as coarse space
// R_0 (coarse_level.hpp). Where 3x3 blocks see one unknown at a time, this sees a patch of the body
// and, coarsely, all of it; what it gains grows with the stiffness. It is made from the assembled
// Hessian, so rebuild it rarely.
#pragma once

#include <taut/core/sparse/aggregate_inverse.hpp>
#include <taut/core/sparse/coarse_level.hpp>
#include <taut/integrators/preconditioner.hpp>

#include <algorithm>

namespace taut {

/// `Storage` is the scalar in which the inverses of the aggregates are kept and applied.
template <class P = Mixed, class S = DefaultSpace, class Storage = float>
class Schwarz {
public:
  using Vectors = VectorField<typename P::real, S>;
  /// Per unknown (bodies.hpp); empty: not known.
  using BodyOf = Kokkos::View<int const*, typename S::memory>;

  struct Params {
    Refresh refresh = Refresh::rarely();
    int aggregate = 32;  ///< unknowns per aggregate: 8, 16, 24 or 32
    /// Functions of the coarse level, which is solved serially; 0: no coarse level
    int max_coarse = 1024;
    /// Unknowns in a run of the coarse level that moves in an affine way. On small meshes, where
    /// shorter ones cost little, runs are shorter until there are `least_runs` of them.
    int run = 128, shortest_run = 32, least_runs = 32;
    int team = 0;  ///< threads per aggregate; 0: Kokkos chooses. The result is the same
  };
  static constexpr char const* name = "schwarz";

  Schwarz() : Schwarz(Params()) {}
  explicit Schwarz(Params const& params) : params_(params) {}

  Refresh refresh() const { return params_.refresh; }
  void resize(int n) { local_ = AggregateInverse<S, Storage>(n, params_.aggregate, params_.team); }
  LocalMatrices<P, S> const& curvature() const { return no_curvature_; }
  bool pointwise() const { return false; }

  /// Allocates, for contacts may have changed the pattern of H.
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    auto hessian = e.pattern(x);
    e.assemble(x, hessian);
    BodyOf body_of;
    if constexpr (requires { e.bodies().of; }) body_of = e.bodies().of;
    update(hessian, e.scale().has_inertia, x, body_of);
  }
  /// From a Hessian that is assembled already. With positions, the runs of the coarse level keep to
  /// one body each, and move in an affine way; without, they are aggregates, or longer if there are
  /// too many, and are translated.
  void update(BlockCsr<S, double> const& hessian, bool has_inertia = true,
              VectorField<typename P::position, S> const& x = {}, BodyOf const& body_of = {}) {
    floored_pivots_ = local_.factorize(hessian);
    has_coarse_level_ = params_.max_coarse > 0 && local_.aggregates() > 1;
    if (!has_coarse_level_) return;
    // Rigid motion costs little with inertia, and nothing without.
    double const shift = has_inertia ? 1e-13 : 1e-8;
    has_coarse_level_ = coarse_.factorize(hessian, runs(hessian.rows(), x.extent(0) > 0, body_of),
                                          shift, x) == Definiteness::positive;
  }

  /// z = P g. Allocates nothing.
  void apply(Vectors const& g, Vectors const& z) const {
    local_.apply(g, z);
    if (has_coarse_level_) coarse_.add(g, z);
  }

  /// Pivots of the last update that were not positive and were replaced by the diagonal: H was not
  /// positive definite there.
  int floored_pivots() const { return floored_pivots_; }
  /// False where one aggregate holds all unknowns, on request, and where H is so far from positive
  /// semi-definite that its Galerkin matrix is indefinite.
  bool has_coarse_level() const { return has_coarse_level_; }
  /// Bytes held between updates.
  std::size_t memory() const { return local_.memory() + coarse_.memory(); }

private:
  RunBegins runs(int n, bool affine, BodyOf const& body_of) const {
    if (!affine) {
      int const joined = (local_.aggregates() + params_.max_coarse - 1) / params_.max_coarse;
      return equal_runs(n, joined * params_.aggregate);
    }
    int const most = std::max(params_.max_coarse / CoarseFunctions<S>::most, 1);
    int const shortest = std::min(params_.shortest_run, params_.run);
    int const wanted = std::clamp(n / std::max(params_.least_runs, 1), shortest, params_.run);
    int const length = std::max(wanted, (n + most - 1) / most);
    if (body_of.extent_int(0) != n) return equal_runs(n, length);
    auto const of = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body_of);
    return runs_of_bodies({of.data(), of.extent(0)}, length);
  }

  Params params_;
  LocalMatrices<P, S> no_curvature_;
  AggregateInverse<S, Storage> local_;
  CoarseLevel<S> coarse_;
  bool has_coarse_level_ = false;
  int floored_pivots_ = 0;
};

}  // namespace taut
