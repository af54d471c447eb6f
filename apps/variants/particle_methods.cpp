#include <taut/apps/program/particle_methods_impl.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/admm.hpp>
#include <taut/integrators/inverse_by_pcg.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/mpm/any_smoother.hpp>
#include <taut/mpm/particle_hessian.hpp>
#include <taut/mpm/particle_splitting.hpp>

namespace taut {
namespace {

using P = ParticlePrecision;
using S = DefaultSpace;

/// As Wang et al. 2020 have it: fine matrix, symmetric Gauss-Seidel or what it is compared with,
/// all in fp64.
template <class Smoother, class Embedding>
using HotPolicies = ParticleCyclePolicies<true, Smoother, Smoother, Embedding, double>;
using Cycle = ParticleMultigrid<P, S>;
using HotCycle = ParticleMultigrid<P, S, HotPolicies<AnySmoother, LinearEmbedding>>;
using HotQuadraticCycle =
    ParticleMultigrid<P, S, HotPolicies<SymmetricGaussSeidel, QuadraticEmbedding>>;
template <class Precision, class Space>
using MatrixOfParticles = ParticleHessian<Precision, Space, true>;
template <class Precision, class Space>
using NumbersOfParticles = ParticleHessian<Precision, Space, false>;
using HessianByPcg = InverseByPcg<P, S, MatrixOfParticles<P, S>>;

/// Chosen at run time, so that each minimiser is compiled once.
template <class Precision, class Space>
class GridPreconditioner
    : public OneOfPreconditioners<Precision, Space, Cycle, HotCycle, HotQuadraticCycle,
                                  HessianByPcg, BlockJacobi<Precision, Space>,
                                  Jacobi<Precision, Space>, Identity<Precision, Space>> {
public:
  using GridPreconditioner::OneOfPreconditioners::OneOfPreconditioners;
};

class AnyForcing {
public:
  using Params = std::variant<ForcingTerm::Params, RootForcing::Params, MomentumForcing::Params>;
  explicit AnyForcing(Params const& params)
      : rule_(make_one_of<ForcingTerm, RootForcing, MomentumForcing>(params)) {}
  void start(ParticlePotential& e) {
    std::visit([&](auto& rule) { rule.start(e); }, rule_);
  }
  void restart() {
    std::visit([](auto& rule) { rule.restart(); }, rule_);
  }
  LinearTolerance operator()(GradientNorms const& norms) {
    return std::visit([&](auto& rule) { return rule(norms); }, rule_);
  }

private:
  std::variant<ForcingTerm, RootForcing, MomentumForcing> rule_;
};

class Builder : ParticleOptions {
public:
  using ParticleOptions::ParticleOptions;

  Made make() const {
    if (method_ == "newton" || method_.starts_with("pn_") || method_ == "gast15") return newton();
    bool const hot = method_.starts_with("hot") || method_ == "lbfgs_h" || method_ == "lbfgs_gmg";
    if (method_.starts_with("lbfgs") || hot) {
      using Minimiser = Lbfgs<GridPreconditioner, AnyLineSearch, ParticleStopping, P, S>;
      Minimiser::Params params;
      params.lbfgs.window = options_.integer("history");
      // A cycle is close to the inverse, in size too.
      params.lbfgs.newton_step = !hot && !multigrid();
      params.lbfgs.newton_after_backtracks = params.lbfgs.newton_first_step = !hot;
      params.lbfgs.forget_when_renewed = options_.flag("forget");
      return preconditioned<Minimiser>(params, window());
    }
    if (method_ == "admm") {
      using Minimiser = Admm<ParticleSplitting<P, S>, ParticleStopping, P, S>;
      Minimiser::Params params;
      params.stop = stopping(8);
      params.budget.max_iterations = options_.integer("max_iterations");
      params.copies.cycle.visits = visits();
      return std::make_unique<ParticleMinimiserHolder<Minimiser>>(params);
    }
    if (method_ == "chebyshev") {
      throw Error(
          "solver.method = \"chebyshev\" is compiled for meshes alone: choose lbfgs, newton or a "
          "nonlinear CG");
    }
    using Minimiser = Ncg<AnyBeta, GridPreconditioner, AnyLineSearch, ParticleStopping, P, S>;
    Minimiser::Params params;
    params.beta = AnyBeta(method_);
    params.splitting.by_islands = false;  // all bodies share the nodes of one grid
    return preconditioned<Minimiser>(params, window());
  }

private:
  /// With the preconditioner that was asked for.
  template <class Minimiser>
  Made preconditioned(typename Minimiser::Params params, int window) const {
    params.preconditioner = preconditioner();
    return hold<Minimiser>(params, window);
  }

  template <template <class, class> class Hessian>
  struct With {
    template <class Precision, class Space>
    using Linear = Pcg<Precision, Space, Hessian>;
  };
  template <template <class, class> class Hessian>
  Made newton_with() const {
    using Minimiser = Newton<With<Hessian>::template Linear, GridPreconditioner, AnyLineSearch,
                             ParticleStopping, P, S, AnyForcing>;
    typename Minimiser::Params params;
    params.linear.max_iterations = options_.integer("max_linear_iterations");
    params.linear.flexible = options_.flag("flexible");
    if (method_ == "newton") {
      params.forcing = ForcingTerm::Params{.largest = options_.number("linear_tolerance")};
    } else if (method_ == "gast15") {
      MomentumForcing::Params forcing;
      if (stopping_is("momentum_norm")) forcing.tolerance = options_.number("tolerance");
      params.forcing = forcing;
    } else {
      RootForcing::Params forcing;
      if (stopping_is("characteristic_norm")) forcing.tolerance = options_.number("tolerance");
      params.forcing = forcing;
    }
    return preconditioned<Minimiser>(params, 1);
  }
  Made newton() const {
    std::string const& hessian = options_.text("hessian");
    if (method_ != "newton") {
      bool const without_matrix = method_ == "pn_pcg_mf" || method_ == "gast15";
      return without_matrix ? newton_with<NumbersOfParticles>() : newton_with<MatrixOfParticles>();
    }
    if (hessian == "direct") {
      throw Error(
          "solver.hessian = \"direct\" is compiled for meshes alone: choose assembled or "
          "matrix_free");
    }
    return hessian == "matrix_free" ? newton_with<NumbersOfParticles>()
                                    : newton_with<MatrixOfParticles>();
  }

  GridPreconditioner<P, S>::Params preconditioner() const {
    std::string const name = particle_preconditioner(options_);
    constexpr Refresh once{.interval = std::numeric_limits<int>::max()};
    if (method_ == "hot") return hot_cycle(once);
    if (method_ == "lbfgs_gmg") return hot_cycle(once, true);
    if (method_ == "pn_mgpcg") return hot_cycle({});
    if (method_ == "pn_gmgpcg") return hot_cycle({}, true);
    if (options_.text("smoother") != "auto" || options_.text("coarse_solver") != "auto") {
      throw Error(
          "solver.smoother and solver.coarse_solver are of the methods whose cycle has a matrix: "
          "hot, lbfgs_gmg, pn_mgpcg and pn_gmgpcg; this is {}",
          method_);
    }
    if (method_ == "pn_sgspcg") {
      // Forward from nothing and backward on what is left are one symmetric sweep.
      return HotCycle::Params{
          .refresh = {},
          .cycle = {.max_levels = 1, .fine = ForwardBackward::Params()},
      };
    }
    if (method_ == "hot_quadratic") {
      HotQuadraticCycle::Params params{.refresh = refresh_of(options_, once)};
      params.cycle = hot_levels<HotQuadraticCycle>();
      return params;
    }
    if (method_ == "lbfgs_h") return HessianByPcg::Params{};
    if (multigrid()) return cycle();
    Refresh const refresh = refresh_of(options_, {});
    if (name == "block_jacobi") return BlockJacobi<P, S>::Params{.refresh = refresh};
    if (name == "jacobi") return Jacobi<P, S>::Params{.refresh = refresh};
    if (name == "identity") return Identity<P, S>::Params{};
    throw Error(
        "solver.preconditioner = \"{}\" is one of meshes: choose multigrid, block_jacobi, jacobi "
        "or "
        "identity",
        name);
  }

  /// Three levels, the coarsest solved by PCG to half of what comes down.
  template <class HotLike>
  typename HotLike::Cycle::Params hot_levels() const {
    return {.max_levels = 3, .direct_nodes = 0, .visits = visits(), .coarse_tolerance = 0.5};
  }
  /// The same with what was asked for.
  HotCycle::Params hot_cycle(Refresh const& automatic, bool geometric = false) const {
    HotCycle::Params params{.refresh = refresh_of(options_, automatic), .geometric = geometric};
    params.cycle = hot_levels<HotCycle>();
    std::string const &coarse = options_.text("coarse_solver"),
                      &smoother = options_.text("smoother");
    if (coarse == "pcg_own") params.cycle.coarse_by_own = true;
    if (coarse == "smoother" || coarse == "direct") params.cycle.coarse_tolerance = 0;
    if (coarse == "direct") {
      HotCycle::Cycle::Params const down;
      params.cycle.max_levels = down.max_levels;
      params.cycle.direct_nodes = down.direct_nodes;
    }
    if (smoother != "auto") {
      params.cycle.fine = params.cycle.smoother = AnySmoother::named(smoother).params;
    }
    return params;
  }
};

std::unique_ptr<ParticleMinimiser::Interface> build(SolverOptions const& options) {
  return Builder(options).make();
}

bool const filled = other_particle_minimiser.fill(build);

}  // namespace
}  // namespace taut
