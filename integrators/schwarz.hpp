// Two-level additive Schwarz preconditioner,
//   P = sum_k R_k' (R_k H R_k')^-1 R_k + R_0' (R_0 H R_0')^-1 R_0,
// with the aggregates k = consecutive runs of the unknowns, which lie close together in an order
// that preserves locality, and the translations of the aggregates (or of longer runs) as coarse
// space R_0. Where 3x3 blocks see one unknown at a time, this sees a patch of the body and,
// coarsely, all of it; what it gains grows with the stiffness. It is made from the assembled
// Hessian, so rebuild it rarely.
#pragma once

#include <taut/core/sparse/aggregate_inverse.hpp>
#include <taut/core/sparse/coarse_level.hpp>
#include <taut/integrators/preconditioner.hpp>

namespace taut {

/// `Storage` is the scalar in which the inverses of the aggregates are kept and applied.
template <class P = Mixed, class S = DefaultSpace, class Storage = float>
class Schwarz {
public:
  using Vectors = VectorField<typename P::real, S>;

  struct Params {
    Refresh refresh = Refresh::rarely();
    int aggregate = 32;  ///< unknowns per aggregate: 8, 16, 24 or 32
    int max_coarse =
        1024;      ///< runs of the coarse level, which is solved serially; 0: no coarse level
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
    update(hessian, e.scale().has_inertia);
  }
  /// From a Hessian that is assembled already.
  void update(BlockCsr<S, double> const& hessian, bool has_inertia = true) {
    floored_pivots_ = local_.factorize(hessian);
    has_coarse_level_ = params_.max_coarse > 0 && local_.aggregates() > 1;
    if (!has_coarse_level_) return;
    int const joined = (local_.aggregates() + params_.max_coarse - 1) / params_.max_coarse;
    // Rigid motion costs little with inertia, and nothing without.
    double const shift = has_inertia ? 1e-13 : 1e-8;
    has_coarse_level_ =
        coarse_.factorize(hessian, joined * params_.aggregate, shift) == Definiteness::positive;
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
  Params params_;
  LocalMatrices<P, S> no_curvature_;
  AggregateInverse<S, Storage> local_;
  CoarseLevel<S> coarse_;
  bool has_coarse_level_ = false;
  int floored_pivots_ = 0;
};

}  // namespace taut
