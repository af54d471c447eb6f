// What minimisers of material points are made of, for the source files that compile them: the
// default (particle_methods.cpp), and all others (apps/variants/particle_methods.cpp).
#pragma once

#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/option_policies.hpp>
#include <taut/apps/program/particle_methods.hpp>
#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/momentum_norm.hpp>
#include <taut/mpm/particle_multigrid.hpp>

namespace taut {

/// Those of meshes, HOT's and that of Gast et al.
class ParticleStopping : public OneOfStoppings<AnyStopping, CharacteristicNorm<DefaultSpace>,
                                               MomentumNorm<DefaultSpace>> {
public:
  using OneOfStoppings::OneOfStoppings;
  Stop judge(ParticlePotential& e, VectorField<ParticlePrecision::real, DefaultSpace> const& g) {
    return std::visit(
        [&]<class Rule>(Rule& rule) {
          if constexpr (GradientRule<Rule, ParticlePotential>) return rule.judge(e, g);
          return Stop::none;
        },
        rule_);
  }
};

template <class Minimiser>
struct ParticleMinimiserHolder final : ParticleMinimiser::Interface {
  Minimiser minimiser;
  explicit ParticleMinimiserHolder(typename Minimiser::Params const& params) : minimiser(params) {}
  NewtonReport minimise(ParticlePotential& potential, ParticleMinimiser::Positions const& x,
                        Observer<ParticlePrecision, DefaultSpace> const& observer) override {
    return NewtonReport{minimiser.minimise(potential, x, observer)};
  }
};

/// After how many applications in a minimisation the cycle is made a strong one
/// (ParticleMultigrid). It costs as much as 50 to 80 plain iterations to make and three to apply:
/// where the plain one gets there in fewer (twist: 340, chain: 381) it has not been faster.
inline int strong_from(SolverOptions const& options) {
  std::string const& asked = options.text("strong_cycle");
  return asked == "never" ? 0 : asked == "always" ? 1 : 400;
}

/// What all of them take from the options.
class ParticleOptions {
public:
  explicit ParticleOptions(SolverOptions const& options)
      : options_(options), method_(options.text("method")) {}

protected:
  using P = ParticlePrecision;
  using S = DefaultSpace;
  using Made = std::unique_ptr<ParticleMinimiser::Interface>;

  template <class Minimiser>
  Made hold(typename Minimiser::Params params, int window) const {
    params.line_search = line_search_of(options_);
    if constexpr (requires { params.linear; }) {
      if (auto* armijo = std::get_if<SufficientDecrease::Params>(&params.line_search)) {
        armijo->max_backtracks = newton_backtracks;
      }
    }
    params.stop = stopping(window);
    params.budget.max_iterations = options_.integer("max_iterations");
    params.safeguard.on = options_.flag("safeguard");
    return std::make_unique<ParticleMinimiserHolder<Minimiser>>(params);
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
  int visits() const { return options_.text("cycle") == "w" ? 2 : 1; }
  ParticleMultigrid<P, S>::Params cycle() const {
    return {.refresh = refresh_of(options_, rare_refresh(options_)),
            .strengthening = {.from = strong_from(options_)},
            .cycle = {.visits = visits()}};
  }

  SolverOptions const& options_;
  std::string const method_;
};

/// Every minimiser but the default.
inline constinit LatePart<std::unique_ptr<ParticleMinimiser::Interface>(SolverOptions const&)>
    other_particle_minimiser;

}  // namespace taut
