// Schwarz preconditioner: exact solves with the rows of 32 unknowns at a time, combined over a
// hierarchy of coarse levels in which short runs of unknowns move as rigid bodies
// (core/sparse/schwarz_levels.hpp). Where 3x3 blocks see one unknown at a time, this sees a patch
// of the body and, coarsely, all of it; what it gains grows with the stiffness, and where bodies
// are thin. It is made from the assembled Hessian, so rebuild it rarely.
#pragma once

#include <taut/core/sparse/schwarz_levels.hpp>
#include <taut/integrators/preconditioner.hpp>

#include <vector>

namespace taut {

/// `Storage` is the scalar in which matrices and inverses are kept and applied.
template <class P = Mixed, class S = DefaultSpace, class Storage = float>
class Schwarz {
public:
  using Vectors = VectorField<typename P::real, S>;
  using Levels = SchwarzLevels<S, Storage, typename P::real>;
  /// Per unknown (bodies.hpp); empty: not known.
  using BodyOf = Kokkos::View<int const*, typename S::memory>;

  struct Params {
    Refresh refresh = Refresh::rarely();
    typename Levels::Params levels = {};
  };
  static constexpr char const* name = "schwarz";

  Schwarz() : Schwarz(Params()) {}
  explicit Schwarz(Params const& params) : params_(params), levels_(params.levels) {}

  Refresh refresh() const { return params_.refresh; }
  void resize(int) {}
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
  /// From a Hessian that is assembled already. Without positions the runs of the coarse levels are
  /// translated only.
  void update(BlockCsr<S, double> const& hessian, bool has_inertia = true,
              VectorField<typename P::position, S> const& x = {}, BodyOf const& body_of = {}) {
    // Rigid motion costs little with inertia, and nothing without.
    double const shift = has_inertia ? 1e-13 : 1e-8;
    auto const of = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), body_of);
    levels_.update(hessian, shift, x, {of.data(), of.data() + of.extent(0)});
  }

  /// z = P g. Allocates nothing.
  void apply(Vectors const& g, Vectors const& z) const { levels_.apply(g, z); }

  Levels const& levels() const { return levels_; }
  /// Bytes held between updates.
  std::size_t memory() const { return levels_.memory(); }

private:
  Params params_;
  LocalMatrices<P, S> no_curvature_;
  Levels levels_;
};

}  // namespace taut
