// How a potential over particles is split for ADMM (integrators/admm.hpp): deformation gradients
// are copied (particle_split.hpp), inertia, all that acts on single nodes and a ghost penalty stay.
// The operator is M + h^2 Sum_p V_p k_p D_p' D_p, with D_p x = F_p(x), matrix-free, and its
// preconditioner a cycle of multigrid that is built once per minimisation.
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/particle_split.hpp>

namespace taut {

template <class P = Mixed, class S = DefaultSpace,
          class Policies = ParticleCyclePolicies<false, Chebyshev, ForwardBackward, LinearEmbedding,
                                                 float, QuadraticSpline, typename P::real>>
class ParticleSplitting {
  using Multigrid_ = ParticleMultigrid<P, S, Policies>;

public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;
  using Positions = VectorField<typename P::position, S>;
  using Cycle = typename Multigrid_::Cycle;

  struct Params {
    double stiffness = 2;   ///< k over |d2Psi/dF2 (I)| / 3 of each material
    double relaxation = 1;  ///< 1 to 2: of what particles take from x
    typename Cycle::Params cycle = {};
  };

  ParticleSplitting() : ParticleSplitting(Params()) {}
  explicit ParticleSplitting(Params const& params) : params_(params), cycle_(params.cycle) {}

  /// Throws Error without inertia, and unless a term has particles that can be split.
  template <class E>
  void start(E& e, Positions const& x) {
    if (!e.scale().has_inertia) throw Error("ADMM over particles: a step needs inertia");
    first_ = true;
    local_ = local_memory_.resize("split_local", e.size());
    // Blocks of what acts on nodes alone; the numbers are then replaced.
    operator_.linearise(e, x, local_);
    bool found = false;
    e.for_each_term([&](auto& term) {
      if constexpr (requires { term.start_split(x, 1.0, 1.0, state_, operator_); }) {
        term.start_split(x, params_.stiffness, scale_of(e), state_, operator_);
        found = true;
      }
    });
    if (!found) throw Error("ADMM: no term of this potential has particles that it can split");
    fine_.resize(operator_.nodes(), operator_.fixed(), operator_);
    fine_.finish();
    cycle_.build(fine_);
  }
  template <class E>
  void update(E& e, Positions const& x, Vectors const& g) {
    e.for_each_term([&](auto& term) {
      if constexpr (requires { term.split(x, 1.0, 1.0, first_, e.fixed(), state_, g); }) {
        term.split(x, scale_of(e), params_.relaxation, first_, e.fixed(), state_, g);
      }
    });
    first_ = false;
  }
  void product(Vectors const& d, Vectors const& hd) const { fine_.product(d, hd); }
  void apply(Vectors const& r, Vectors const& z) const { cycle_.apply(r, z); }

private:
  static_assert(!Policies::assembled, "taut: ParticleSplitting has no fine matrix");
  static_assert(!Multigrid_::rounded, "taut: ParticleSplitting solves with its fine level");
  /// h^2 in front of all energies but that of inertia.
  template <class E>
  static double scale_of(E& e) {
    double const step = e.scale().time_step;
    return step * step;
  }

  Params params_;
  SplitParticleState<Real, S> state_;
  typename Multigrid_::Operator operator_;
  typename Multigrid_::Fine fine_;
  Cycle cycle_;
  BlockField<Real, S> local_;
  Resizable<BlockField<Real, S>> local_memory_;
  bool first_ = true;
};

}  // namespace taut
