// How a method is made from the options, for the source files that instantiate it per precision.
#pragma once

#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/option_policies.hpp>
#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/chebyshev.hpp>
#include <taut/integrators/direct.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>

namespace taut {

template <class P>
class MethodBuilder {
public:
  using Space = DefaultSpace;
  using Interface = typename AnyMinimiser<P>::Interface;
  using Preconditioner = AnyPreconditioner<P, Space>;

  explicit MethodBuilder(SolverOptions const& options) : options_(options) {}

  std::unique_ptr<Interface> make() const {
    require_of_meshes(options_);
    std::string const& method = options_.text("method");
    if (method == "newton") {
      if (options_.text("hessian") == "direct") return newton<Direct>();
      if (options_.text("hessian") == "matrix_free") return newton<MatrixFreePcg>();
      return newton<AssembledPcg>();
    }
    if (method == "lbfgs") {
      using Minimiser = Lbfgs<AnyPreconditioner, AnyLineSearch, AnyStopping, P, Space>;
      typename Minimiser::Params params;
      params.lbfgs.window = options_.integer("history");
      params.lbfgs.forget_when_renewed = options_.flag("forget");
      return hold<Minimiser>(params);
    }
    if (method == "chebyshev") {
      using Minimiser = Chebyshev<AnyPreconditioner, AnyLineSearch, AnyStopping, P, Space>;
      typename Minimiser::Params params;
      params.chebyshev.rho = options_.number("chebyshev_rho");
      return hold<Minimiser>(params);
    }
    using Minimiser = Ncg<AnyBeta, AnyPreconditioner, AnyLineSearch, AnyStopping, P, Space>;
    typename Minimiser::Params params;
    params.beta = AnyBeta(method);
    return hold<Minimiser>(params);
  }

private:
  template <class Minimiser>
  struct Holder final : Interface {
    Minimiser minimiser;
    explicit Holder(typename Minimiser::Params const& params) : minimiser(params) {}
    NewtonReport minimise(ProgramPotential<P>& potential,
                          VectorField<typename P::position, Space> const& x,
                          Observer<P, Space> const& observer) override {
      auto const report = minimiser.minimise(potential, x, observer);
      if constexpr (std::same_as<std::decay_t<decltype(report)>, NewtonReport>) {
        return report;
      } else {
        return NewtonReport{report};
      }
    }
  };

  template <class Minimiser>
  std::unique_ptr<Interface> hold(typename Minimiser::Params params) const {
    params.preconditioner = preconditioner();
    params.line_search = line_search_of(options_);
    params.stop = stopping_of(options_, 8);
    params.budget.max_iterations = options_.integer("max_iterations");
    params.safeguard.on = options_.flag("safeguard");
    if constexpr (requires { params.splitting; }) {
      params.splitting.by_islands = options_.flag("islands");
      params.splitting.by_regions = options_.flag("regions");
    }
    return std::make_unique<Holder<Minimiser>>(params);
  }

  template <template <class, class> class Linear>
  std::unique_ptr<Interface> newton() const {
    using Minimiser = Newton<Linear, AnyPreconditioner, AnyLineSearch, AnyStopping, P, Space>;
    typename Minimiser::Params params;
    params.line_search = line_search_of(options_);
    if (auto* armijo = std::get_if<SufficientDecrease::Params>(&params.line_search)) {
      armijo->max_backtracks = newton_backtracks;
    }
    params.preconditioner = preconditioner();
    if constexpr (requires { params.linear.max_iterations; }) {
      params.linear.max_iterations = options_.integer("max_linear_iterations");
      params.linear.flexible = options_.flag("flexible");
    }
    params.forcing.largest = options_.number("linear_tolerance");
    params.stop = stopping_of(options_, 1);
    params.budget.max_iterations = options_.integer("max_iterations");
    params.safeguard.on = options_.flag("safeguard");
    return std::make_unique<Holder<Minimiser>>(params);
  }

  typename Preconditioner::Params preconditioner() const {
    std::string const& name = options_.text("preconditioner");
    Refresh const refresh = refresh_of(options_, {});
    if (name == "identity") return typename Identity<P, Space>::Params{};
    if (name == "jacobi") return typename Jacobi<P, Space>::Params{.refresh = refresh};
    if (name == "block_jacobi" || name == "auto") {  // where there is no scene to choose for
      return typename BlockJacobi<P, Space>::Params{.refresh = refresh};
    }
    typename Schwarz<P, Space>::Params schwarz;
    schwarz.refresh = refresh_of(options_, rare_refresh(options_));
    schwarz.levels.aggregate = name == "schwarz_16" ? 16 : 32;
    return schwarz;
  }

  SolverOptions const& options_;
};

template <class P>
AnyMinimiser<P>::AnyMinimiser(SolverOptions const& options)
    : minimiser_(MethodBuilder<P>(options).make()) {}

}  // namespace taut
