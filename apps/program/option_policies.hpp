// What [solver] says of the policies that all minimisers share, meshes' and particles'.
#pragma once

#include <taut/apps/program/any_policies.hpp>
#include <taut/apps/program/scene_options.hpp>
#include <taut/core/potential/preconditioning.hpp>

namespace taut {

inline AnyLineSearch::Params line_search_of(SolverOptions const& options) {
  std::string const& name = options.text("line_search");
  if (name == "newton") return NewtonStep::Params{};
  if (name == "exact") return ExactLineSearch::Params{};
  return SufficientDecrease::Params{};
}

/// Of the rules that meshes and material points share. `window`: that of the method, where the
/// scene asks for none.
inline AnyStopping::Params stopping_of(SolverOptions const& options, int window) {
  std::string const& name = options.text("stopping");
  double const tolerance = options.number("tolerance");
  if (name == "energy_drop") return EnergyDrop::Params{.tolerance = tolerance};
  if (name == "gradient_norm") return GradientNorm::Params{tolerance, true};
  int const asked = options.integer("window");
  return DecrementWindow::Params{.tolerance = name == "budget" ? 0 : tolerance,
                                 .window = asked > 0 ? asked : window};
}

/// What the word rare stands for.
inline Refresh rare_refresh(SolverOptions const& options) {
  return {.interval = options.integer("refresh_every"), .trigger = Refresh::rarely().trigger};
}
/// `automatic`: what the word auto stands for.
inline Refresh refresh_of(SolverOptions const& options, Refresh const& automatic) {
  std::string const& when = options.text("refresh");
  if (when == "auto") return automatic;
  if (when == "lagged") return Refresh::lagged(options.integer("refresh_every"));
  if (when == "rare") return rare_refresh(options);
  return {};
}

}  // namespace taut
