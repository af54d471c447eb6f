// The multigrid cycle as a preconditioner of any minimiser over particles, made from these at once:
// by default in float and without a fine matrix, whose level is smoothed by Chebyshev's polynomial
// on products with 45 numbers per particle (and patches where cells are cut, if asked for:
// cut_cells.hpp), above coarser levels that are assembled from the particles and smoothed by
// Gauss-Seidel.
// `assembled`: with the fine matrix, as HOT has it (Wang et al. 2020).
//
// For potentials in which each material is one term's, a ghost penalty may hold light nodes, and
// others act on single nodes; where more is coupled GridMultigrid takes the Hessian that the
// potential assembles.
#pragma once

#include <taut/core/potential/preconditioning.hpp>
#include <taut/mpm/cut_cells.hpp>
#include <taut/mpm/geometric_levels.hpp>
#include <taut/mpm/light_nodes.hpp>
#include <taut/mpm/multigrid.hpp>
#include <taut/mpm/particle_operator.hpp>

namespace taut {

/// `T` is the scalar of the coarser levels, `FineT` that of the fine one. Floats do for a metric:
/// iterations hardly change, and what a step ends at is the gradient's to say.
template <bool assembled_ = false, class FineSmoother_ = Chebyshev,
          class Smoother_ = ForwardBackward, class Embedding_ = LinearEmbedding, class T = float,
          Spline K = QuadraticSpline, class FineT = T>
struct ParticleCyclePolicies {
  using FineSmoother = FineSmoother_;
  using Smoother = Smoother_;
  using Embedding = Embedding_;
  using Scalar = T;
  using FineScalar = FineT;
  using Kernel = K;
  static constexpr bool assembled = assembled_;
};

/// A stronger cycle where the plain one does not suffice: light nodes are solved with exactly
/// (light_nodes.hpp), and so is the first coarser level that is not too large. Coarse nodes far
/// apart in a body, or of bodies that lie side by side, fall together on the levels below it, which
/// hold stiff parts of it together by soft ones.
struct Strengthening {
  /// Once the cycle has been applied so often in a minimisation, every update makes it strong; 1:
  /// it always is, 0: it never is.
  int from = 0;
  double light = 0.1;       ///< what LightNodes takes
  int most_light = 3000;    ///< nodes; where there are more they stay as they are
  int sparse_nodes = 2000;  ///< of the coarsest level
};

template <class P = Mixed, class S = DefaultSpace, class Policies = ParticleCyclePolicies<>>
class ParticleMultigrid {
public:
  using Real = typename P::real;
  using Kernel = typename Policies::Kernel;
  using Vectors = VectorField<Real, S>;
  using FineReal = typename Policies::FineScalar;
  using Operator = ParticleOperator<Kernel, FineReal, S>;
  static constexpr bool assembled = Policies::assembled;
  using Fine = std::conditional_t<assembled, MatrixLevel<S, FineReal, Kernel::width - 1>,
                                  PatchedLevel<Operator, S, FineReal, Kernel::width - 1>>;
  using Cycle = Multigrid<Fine, typename Policies::FineSmoother, typename Policies::Smoother,
                          typename Policies::Embedding, typename Policies::Scalar>;

  struct Params {
    Refresh refresh = Refresh::rarely();
    CutCells cut_cells = {};           ///< where there is no fine matrix
    Strengthening strengthening = {};  ///< the same
    /// Coarser levels from the particles by their own kernels instead of P'AP
    /// (geometric_levels.hpp): the baseline, where there is a fine matrix, linear embedding and one
    /// scalar.
    bool geometric = false;
    typename Cycle::Params cycle = {};
  };
  static constexpr char const* name = "particle_multigrid";
  static constexpr bool rounded = !std::same_as<FineReal, Real>;

  ParticleMultigrid() : ParticleMultigrid(Params()) {}
  /// Throws Error where levels are to be geometric and cannot be.
  explicit ParticleMultigrid(Params const& params) : params_(params), cycle_(params.cycle) {
    if (params.geometric && !may_be_geometric) {
      throw Error(
          "particle_multigrid: levels are geometric only above a fine matrix, with the stencil and "
          "the scalar of that");
    }
  }

  Refresh refresh() const { return params_.refresh; }
  void resize(int n) { local_ = local_memory_.resize("node_curvature", n); }
  LocalMatrices<P, S> const& curvature() const { return no_curvature_; }
  bool pointwise() const { return false; }

  /// A minimisation begins.
  void start() {
    applied_ = 0;
    strong_ = has_light_ = false;
  }
  /// Takes the Hessian at x, and builds the hierarchy.
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    Strengthening const& strong = params_.strengthening;
    operator_.linearise(e, x, local_);
    if constexpr (!assembled) {
      strong_ = strong.from > 0 && applied_ + 1 >= strong.from;
      has_light_ = strong_ && light_.build(operator_, strong.light, strong.most_light);
      if (rounded && has_light_) {
        for (auto& v : rounded_) grow(v, "rounded_vector", operator_.nodes().count);
      }
      cycle_.set_sparse_nodes(strong_ ? strong.sparse_nodes : params_.cycle.sparse_nodes);
    }
    if constexpr (assembled) {
      fine_.resize(operator_.nodes(), operator_.fixed());
      operator_.matrix(fine_.matrix());
    } else {
      fine_.resize(operator_.nodes(), operator_.fixed(), operator_);
      fine_.set(params_.cut_cells);
    }
    fine_.finish();
    if constexpr (may_be_geometric && ShowsTerms<E>) {
      if (params_.geometric) {
        levels_.start(operator_, local_, e);
        return cycle_.build(fine_, &levels_);
      }
    } else if (params_.geometric) {
      throw Error("particle_multigrid: no term of this potential shows its particles");
    }
    cycle_.build(fine_);
  }

  /// z = P g. Allocates nothing.
  void apply(Vectors const& g, Vectors const& z) const {
    ++applied_;
    if (!has_light_) return cycle_.apply(g, z);
    if constexpr (rounded) {
      int const n = fine_.size();
      for_each<S>("round_gradient", n, kernels::ConvertVectors<S, Real, FineReal>{g, rounded_[0]});
      apply_strong(rounded_[0], rounded_[1]);
      for_each<S>("widen_step", n, kernels::ConvertVectors<S, FineReal, Real>{rounded_[1], z});
    } else {
      apply_strong(g, z);
    }
  }

  /// Whether it is made anew in every iteration, and what it is made of is the Hessian there; not
  /// where that is rounded.
  bool holds_hessian() const requires(!rounded) { return params_.refresh.interval == 1; }
  void hessian_product(Vectors const& d, Vectors const& hd) const requires(!rounded) {
    fine_.product(d, hd);
  }

  MultigridReport const& report() const { return cycle_.report(); }
  /// Bytes of the hierarchy and of what it is made from.
  std::size_t memory() const { return cycle_.report().memory + operator_.memory(); }
  /// Whether the last update has strengthened the cycle.
  bool strong() const { return strong_; }
  /// Nodes that the last cycle solves with exactly.
  int light_nodes() const { return has_light_ ? light_.nodes() : 0; }
  Cycle const& cycle() const { return cycle_; }
  Fine const& fine() const { return fine_; }
  Operator const& hessian() const { return operator_; }

private:
  static constexpr bool may_be_geometric = assembled && !rounded &&
                                           Cycle::radius == Kernel::width - 1 &&
                                           std::same_as<typename Policies::Scalar, Real>;
  using FineVectors = VectorField<FineReal, S>;

  void apply_strong(FineVectors const& g, FineVectors const& z) const {
    light_.apply(
        g, z, [&](FineVectors const& x, FineVectors const& y) { operator_.product(x, y); },
        [&](FineVectors const& r, FineVectors const& x) { cycle_.apply(r, x); });
  }

  struct NoLevels {};
  using Levels = std::conditional_t<may_be_geometric, GeometricLevels<Kernel, P, S>, NoLevels>;

  Params params_;
  Levels levels_;
  LocalMatrices<P, S> no_curvature_;
  BlockField<Real, S> local_;
  Resizable<BlockField<Real, S>> local_memory_;
  Operator operator_;
  Fine fine_;
  Cycle cycle_;
  LightNodes<S, FineReal, Kernel::width - 1> light_;
  FineVectors rounded_[2];   ///< what a strong cycle starts from, and what it makes of it
  mutable int applied_ = 0;  ///< times in this minimisation
  bool strong_ = false;
  bool has_light_ = false;  ///< and light nodes are solved with exactly
};

}  // namespace taut
