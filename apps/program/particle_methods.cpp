#include <taut/apps/program/option_policies.hpp>
#include <taut/apps/program/particle_methods.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/admm.hpp>
#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/inverse_by_pcg.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/momentum_norm.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/mpm/any_smoother.hpp>
#include <taut/mpm/particle_hessian.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/particle_splitting.hpp>

#include <array>

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

/// Those of meshes, HOT's and that of Gast et al.
class ParticleStopping
    : public OneOfStoppings<AnyStopping, CharacteristicNorm<S>, MomentumNorm<S>> {
public:
  using OneOfStoppings::OneOfStoppings;
  Stop judge(ParticlePotential& e, VectorField<P::real, S> const& g) {
    return std::visit(
        [&]<class Rule>(Rule& rule) {
          if constexpr (GradientRule<Rule, ParticlePotential>) return rule.judge(e, g);
          return Stop::none;
        },
        rule_);
  }
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

template <class Minimiser>
struct Holder final : ParticleMinimiser::Interface {
  Minimiser minimiser;
  explicit Holder(typename Minimiser::Params const& params) : minimiser(params) {}
  NewtonReport minimise(ParticlePotential& potential, ParticleMinimiser::Positions const& x,
                        Observer<P, S> const& observer) override {
    return NewtonReport{minimiser.minimise(potential, x, observer)};
  }
};

class Builder {
public:
  using Made = std::unique_ptr<ParticleMinimiser::Interface>;

  explicit Builder(SolverOptions const& options)
      : options_(options), method_(options.text("method")) {}

  Made make() const {
    if (method_ == "newton" || method_.starts_with("pn_") || method_ == "gast15") return newton();
    bool const hot = method_.starts_with("hot") || method_ == "lbfgs_h" || method_ == "lbfgs_gmg";
    if (method_.starts_with("lbfgs") || hot) {
      using Minimiser = Lbfgs<GridPreconditioner, AnyLineSearch, ParticleStopping, P, S>;
      Minimiser::Params params;
      params.lbfgs.window = options_.integer("history");
      // A cycle is close to the inverse, in size too.
      params.lbfgs.newton_step = !hot && !multigrid();
      params.lbfgs.newton_first_step = !hot;
      params.lbfgs.forget_when_renewed = options_.flag("forget");
      return hold<Minimiser>(params, window());
    }
    if (method_ == "admm") {
      using Minimiser = Admm<ParticleSplitting<P, S>, ParticleStopping, P, S>;
      Minimiser::Params params;
      params.stop = stopping(8);
      params.budget.max_iterations = options_.integer("max_iterations");
      params.copies.cycle.visits = visits();
      return std::make_unique<Holder<Minimiser>>(params);
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
    return hold<Minimiser>(params, window());
  }

private:
  template <class Minimiser>
  Made hold(typename Minimiser::Params params, int window) const {
    params.preconditioner = preconditioner();
    params.line_search = line_search_of(options_);
    if constexpr (requires { params.linear; }) {
      if (auto* armijo = std::get_if<SufficientDecrease::Params>(&params.line_search)) {
        armijo->max_backtracks = newton_backtracks;
      }
    }
    params.stop = stopping(window);
    params.budget.max_iterations = options_.integer("max_iterations");
    params.safeguard.on = options_.flag("safeguard");
    return std::make_unique<Holder<Minimiser>>(params);
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
    return hold<Minimiser>(params, 1);
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

  bool stopping_is(std::string_view name) const { return options_.text("stopping") == name; }
  ParticleStopping::Params stopping(int window) const {
    double const tolerance = options_.number("tolerance");
    if (stopping_is("characteristic_norm")) {
      return CharacteristicNorm<S>::Params{.tolerance = tolerance};
    }
    if (stopping_is("momentum_norm")) return MomentumNorm<S>::Params{.tolerance = tolerance};
    return stopping_of(options_, window);
  }

  bool multigrid() const { return particle_preconditioner(options_) == "multigrid"; }
  /// A cycle reaches everything at once: fewer decrements tell what is left (mpm/grid_multigrid.hpp
  /// with a window of 4 was never off by more than a factor of two).
  int window() const { return multigrid() ? 4 : 8; }

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
    if (multigrid()) {
      return Cycle::Params{.refresh = refresh_of(options_, Refresh::lagged(8)),
                           .cycle = {.visits = visits()}};
    }
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

  int visits() const { return options_.text("cycle") == "w" ? 2 : 1; }
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

  SolverOptions const& options_;
  std::string const method_;
};

}  // namespace

std::string particle_preconditioner(SolverOptions const& options) {
  std::string const& method = options.text("method");
  if (method == "lbfgs_h") return "inverse_by_pcg";
  if (method == "pn_sgspcg") return "symmetric_gauss_seidel";
  if (method.starts_with("pn_pcg") || method == "gast15" || method == "lbfgs_plain") {
    return "block_jacobi";
  }
  std::string const& asked = options.text("preconditioner");
  bool const hot = method.starts_with("hot") || method.ends_with("gmg") || method == "pn_mgpcg" ||
                   method == "pn_gmgpcg";
  return asked == "auto" || hot ? "multigrid" : asked;
}

std::span<MethodTitle const> particle_method_titles() {
  static constexpr std::array titles{
      MethodTitle{"lbfgs", "L-BFGS", "with the cycle of multigrid as metric: the default"},
      MethodTitle{"hot", "HOT", "as published: fine matrix, symmetric Gauss-Seidel, 3 levels"},
      MethodTitle{"hot_quadratic", "HOT-quadratic", "the same with quadratic embedding"},
      MethodTitle{"lbfgs_h", "LBFGS-H", "L-BFGS, the first Hessian inverted by PCG as metric"},
      MethodTitle{"lbfgs_gmg", "LBFGS-GMG", "HOT with levels made of the particles, not of P'AP"},
      MethodTitle{"lbfgs_plain", "L-BFGS (block Jacobi)", "L-BFGS with block Jacobi as metric"},
      MethodTitle{"pn_pcg", "PN-PCG", "projected Newton, PCG with block Jacobi on the matrix"},
      MethodTitle{"pn_pcg_mf", "PN-PCG(MF)", "the same without a matrix"},
      MethodTitle{"pn_sgspcg", "PN-SGS-PCG", "the same with symmetric Gauss-Seidel"},
      MethodTitle{"pn_mgpcg", "PN-MGPCG", "projected Newton, PCG with HOT's cycle"},
      MethodTitle{"pn_gmgpcg", "PN-GMG-PCG", "projected Newton, PCG with the cycle of lbfgs_gmg"},
      MethodTitle{"gast15", "Gast15", "projected Newton of Gast et al. 2015, without a matrix"},
      MethodTitle{"admm", "ADMM", "alternating directions, particles' own gradients (Fang 2019)"}};
  return titles;
}

ParticleMinimiser::ParticleMinimiser(Params const& options) : minimiser_(Builder(options).make()) {}

}  // namespace taut
