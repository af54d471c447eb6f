#include <taut/apps/program/option_policies.hpp>
#include <taut/apps/program/particle_methods.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/mpm/grid_multigrid.hpp>

namespace taut {
namespace {

using P = ParticlePrecision;
using S = DefaultSpace;

/// Chosen at run time, so that each minimiser is compiled once.
template <class Precision, class Space>
class GridPreconditioner
    : public OneOfPreconditioners<Precision, Space, GridMultigrid<Precision, Space>,
                                  BlockJacobi<Precision, Space>, Jacobi<Precision, Space>,
                                  Identity<Precision, Space>> {
public:
  using GridPreconditioner::OneOfPreconditioners::OneOfPreconditioners;
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

  explicit Builder(ParticleMethod const& method) : options_(method.options), nodes_(method.nodes) {}

  Made make() const {
    std::string const& method = options_.text("method");
    if (method == "newton") return newton();
    if (method == "lbfgs") {
      using Minimiser = Lbfgs<GridPreconditioner, AnyLineSearch, AnyStopping, P, S>;
      Minimiser::Params params;
      params.lbfgs.window = options_.integer("history");
      return hold<Minimiser>(params, window());
    }
    if (method == "chebyshev") {
      throw Error(
          "solver.method = \"chebyshev\" is compiled for meshes alone: choose lbfgs, newton or a "
          "nonlinear CG");
    }
    using Minimiser = Ncg<AnyBeta, GridPreconditioner, AnyLineSearch, AnyStopping, P, S>;
    Minimiser::Params params;
    params.beta = AnyBeta(method);
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
    params.stop = stopping_of(options_, window);
    params.budget.max_iterations = options_.integer("max_iterations");
    params.safeguard.on = options_.flag("safeguard");
    return std::make_unique<Holder<Minimiser>>(params);
  }

  template <template <class, class> class Linear>
  Made newton_with() const {
    using Minimiser = Newton<Linear, GridPreconditioner, AnyLineSearch, AnyStopping, P, S>;
    typename Minimiser::Params params;
    params.linear.max_iterations = options_.integer("max_linear_iterations");
    params.forcing.largest = options_.number("linear_tolerance");
    return hold<Minimiser>(params, 1);
  }
  Made newton() const {
    std::string const& hessian = options_.text("hessian");
    if (hessian == "direct") {
      throw Error(
          "solver.hessian = \"direct\" is compiled for meshes alone: choose assembled or "
          "matrix_free");
    }
    return hessian == "matrix_free" ? newton_with<MatrixFreePcg>() : newton_with<AssembledPcg>();
  }

  bool multigrid() const { return particle_preconditioner(options_) == "multigrid"; }
  /// A cycle reaches everything at once: fewer decrements tell what is left (mpm/grid_multigrid.hpp
  /// with a window of 4 was never off by more than a factor of two).
  int window() const { return multigrid() ? 4 : 8; }

  GridPreconditioner<P, S>::Params preconditioner() const {
    std::string const name = particle_preconditioner(options_);
    if (multigrid()) {
      return GridMultigrid<P, S>::Params{.refresh = refresh_of(options_, Refresh::lagged(8)),
                                         .nodes = nodes_};
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

  SolverOptions const& options_;
  GridNodes<S> const* nodes_;
};

}  // namespace

std::string particle_preconditioner(SolverOptions const& options) {
  std::string const& asked = options.text("preconditioner");
  return asked == "auto" ? "multigrid" : asked;
}

ParticleMinimiser::ParticleMinimiser(Params const& method) : minimiser_(Builder(method).make()) {}

}  // namespace taut
