// The multigrid cycle as a preconditioner of any minimiser whose unknowns are the nodes of a grid:
// for nonlinear conjugate gradients and L-BFGS, where it makes HOT (Wang et al. 2020), and for
// Newton's linear solver (PN-MGPCG). The fine level is the assembled Hessian of the objective.
//
// Nodes that nothing couples to (fixed ones) have no part in the coarser levels.
#pragma once

#include <taut/core/potential/preconditioning.hpp>
#include <taut/mpm/multigrid.hpp>

#include <cstdint>

namespace taut {

namespace kernels {

/// Marks the nodes whose blocks are all zero but for the diagonal.
template <class S, class T, int radius>
struct FindUncoupled {
  GridMatrix<S, T, radius> a;
  Kokkos::View<std::uint8_t*, typename S::memory> uncoupled;
  KOKKOS_FUNCTION void operator()(int i) const {
    bool coupled = false;
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dz = -radius; dz <= radius && !coupled; ++dz) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          for (T const entry : a.block(i, dx, dy, dz).a) coupled = coupled || entry != 0;
        }
    uncoupled(i) = coupled ? 0 : 1;
  }
};

}  // namespace kernels

/// `radius` is how far a kernel couples nodes: 2 for quadratic splines, 3 for cubic ones. `T` is
/// the scalar of all levels.
template <class Smoother_ = ForwardBackward, class Embedding_ = LinearEmbedding, class T = float,
          int radius_ = 2>
struct CyclePolicies {
  using Smoother = Smoother_;
  using Embedding = Embedding_;
  using Scalar = T;
  static constexpr int radius = radius_;
};

template <class P = Mixed, class S = DefaultSpace, class Policies = CyclePolicies<>>
class GridMultigrid {
public:
  using T = typename Policies::Scalar;
  static constexpr int radius = Policies::radius;
  using Vectors = VectorField<typename P::real, S>;
  using Fine = MatrixLevel<S, T, radius>;
  using Cycle = Multigrid<Fine, typename Policies::Smoother, typename Policies::Smoother,
                          typename Policies::Embedding, T>;

  struct Params {
    Refresh refresh = Refresh::rarely();
    /// Those that the unknowns are, whenever `update` is called: of the grid that outlives this.
    GridNodes<S> const* nodes = nullptr;
    typename Cycle::Params cycle = {};
  };
  static constexpr char const* name = "multigrid";

  GridMultigrid() : GridMultigrid(Params()) {}
  explicit GridMultigrid(Params const& params) : params_(params), cycle_(params.cycle) {}

  Refresh refresh() const { return params_.refresh; }
  void resize(int) {}
  LocalMatrices<P, S> const& curvature() const { return no_curvature_; }
  bool pointwise() const { return false; }

  /// Assembles the Hessian at x, and builds the hierarchy. Throws Error unless the unknowns are the
  /// nodes of the grid, coupled no farther than the radius.
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    if (params_.nodes == nullptr) {
      throw Error("multigrid: there is no grid; give Params::nodes those of the particles' grid");
    }
    if (params_.nodes->count != e.size()) {
      throw Error(
          "multigrid: {} unknowns are not the {} nodes of the grid; give Params::nodes those of "
          "the grid that the potential is over",
          e.size(), params_.nodes->count);
    }
    auto hessian = e.pattern(x);
    e.assemble(x, hessian);
    update(hessian);
  }
  /// From a Hessian that is assembled already.
  void update(BlockCsr<S, double> const& hessian) {
    GridNodes<S> const& nodes = *params_.nodes;
    grow(uncoupled_, "multigrid_uncoupled", static_cast<std::size_t>(nodes.count));
    fine_.resize(nodes, FixedNodes<S>(uncoupled_));
    copy(hessian, fine_.matrix());
    for_each<S>("multigrid_uncoupled", nodes.count,
                kernels::FindUncoupled<S, T, radius>{fine_.matrix(), uncoupled_});
    fine_.finish();
    cycle_.build(fine_);
  }

  /// z = P g. Allocates nothing.
  void apply(Vectors const& g, Vectors const& z) const { cycle_.apply(g, z); }

  MultigridReport const& report() const { return cycle_.report(); }
  Fine const& fine() const { return fine_; }

private:
  Params params_;
  LocalMatrices<P, S> no_curvature_;
  Fine fine_;
  Cycle cycle_;
  Kokkos::View<std::uint8_t*, typename S::memory> uncoupled_;
};

}  // namespace taut
