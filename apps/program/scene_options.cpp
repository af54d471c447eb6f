#include <taut/apps/program/scene_options.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/lbfgs.hpp>

namespace taut {

std::span<OptionKey const> solver_keys() {
  static std::vector<OptionKey> const keys{
      {"method",
       std::string("dk"),
       {},
       {"dk",        "dk+",       "hz",          "hs",
        "prp",       "prp+",      "ls",          "fr",
        "cd",        "bfgs",      "lbfgs",       "chebyshev",
        "newton",    "gradient",  "hot",         "hot_quadratic",
        "lbfgs_h",   "lbfgs_gmg", "lbfgs_plain", "pn_pcg",
        "pn_pcg_mf", "pn_sgspcg", "pn_mgpcg",    "pn_gmgpcg",
        "gast15",    "admm"},
       "the minimiser: nonlinear conjugate gradients by its beta, or another one; a scene of "
       "material points that does not say takes lbfgs"},
      {"precision",
       std::string("fp64"),
       {},
       {"fp64", "mixed", "fp32"},
       "mixed: fp32 kernels with fp64 positions and sums"},
      {"preconditioner",
       std::string("auto"),
       {},
       {"auto", "identity", "jacobi", "block_jacobi", "schwarz_16", "schwarz_32", "multigrid"},
       "schwarz: dense aggregates of 16 or 32 vertices on levels of smoothed aggregation, of "
       "meshes; multigrid: a cycle over the nodes of a grid, of material points; auto: multigrid "
       "for these, and for meshes schwarz_32 where a step reaches over several elements, otherwise "
       "block_jacobi (`taut plan` says why)"},
      {"refresh",
       std::string("auto"),
       {},
       {"auto", "always", "lagged", "rare"},
       "when the preconditioner is rebuilt: at each iterate; every refresh_every; the same and "
       "where the steps collapse; auto: rare for schwarz and multigrid, always "
       "for the others"},
      {"refresh_every",
       30,
       {.min = 1, .max = 1e6},
       {},
       "iterations between refreshes that are lagged or rare"},
      {"curvature",
       std::string("clamp"),
       {},
       {"clamp", "limit", "project"},
       "how negative curvature is removed: clamped per element, limited lambda, projected exactly"},
      {"line_search",
       std::string("newton_armijo"),
       {},
       {"newton", "newton_armijo", "exact"},
       "one Newton step; the same with a check of sufficient decrease; exact"},
      {"stopping",
       std::string("decrement_window"),
       {},
       {"decrement_window", "energy_drop", "gradient_norm", "characteristic_norm", "momentum_norm",
        "budget"},
       "what ends a step: sum of the last energy decrements below 1/2 M (tolerance L)^2; energy "
       "drop relative to the first; gradient norm relative to the first; HOT's norm, of material "
       "points (its authors take a tolerance of 1e-7); that of Gast et al. 2015, in kg m/s, of "
       "material points; max_iterations alone"},
      {"tolerance", 1e-3, {.min = 0, .max = 1, .open_min = true}, {}, "of the stopping rule"},
      {"window",
       0,
       {.min = 0, .max = 1000},
       {},
       "decrements summed at least by decrement_window; 0: 8, or 4 with multigrid, or 1 for "
       "newton"},
      {"max_iterations", 2000, {.min = 1, .max = 1e9}, {}, "budget of a time step"},
      {"smoother",
       std::string("auto"),
       {},
       {"auto", "symmetric_gauss_seidel", "forward_backward", "backward_forward", "forward",
        "backward", "jacobi", "jacobi_tenth", "optimal_jacobi", "chebyshev", "chebyshev_power",
        "pcg"},
       "of the levels of hot, lbfgs_gmg, pn_mgpcg and pn_gmgpcg; forward, backward, optimal_jacobi "
       "and pcg are no fixed symmetric operators"},
      {"coarse_solver",
       std::string("auto"),
       {},
       {"auto", "pcg", "pcg_own", "direct", "smoother"},
       "of their coarsest level, of three: PCG to half of the unsmoothed right-hand side (auto) or "
       "of its own; or smoothing; direct: levels down to 60 nodes, which are inverted"},
      {"cycle", std::string("v"), {}, {"v", "w"}, "of multigrid"},
      {"strong_cycle",
       std::string("auto"),
       {},
       {"auto", "always", "never"},
       "of multigrid of material points, which then also solves exactly with nodes that hardly any "
       "particle sees, where they are no more than 3000, and with the first coarser level of at "
       "most 2000 nodes; auto: once it has been applied 400 times in a step"},
      {"forget",
       false,
       {},
       {},
       "lbfgs forgets its pairs when the metric is refreshed (HOT's --adaptiveH, with refresh = "
       "lagged, refresh_every = 16)"},
      {"flexible",
       false,
       {},
       {},
       "newton and pn_...: flexible conjugate gradients, which bear a metric that is no fixed "
       "operator, for one more scalar product"},
      {"history", 8, {.min = 1, .max = max_lbfgs_window}, {}, "pairs kept by lbfgs"},
      {"chebyshev_rho",
       0.99,
       {.min = 0, .max = 1, .open_max = true},
       {},
       "spectral radius that chebyshev assumes; 0: measured"},
      {"hessian",
       std::string("assembled"),
       {},
       {"assembled", "matrix_free", "direct"},
       "of newton: PCG on the assembled matrix or without one, or a sparse factorisation"},
      {"linear_tolerance",
       0.1,
       {.min = 0, .max = 1, .open_min = true, .open_max = true},
       {},
       "largest forcing term of newton's inner solve"},
      {"max_linear_iterations", 10000, {.min = 1, .max = 1e9}, {}, "budget of an inner solve"},
      {"safeguard",
       true,
       {},
       {},
       "restart where descent is lost or a bound has cut the step; off: the paper as printed"},
      {"islands",
       true,
       {},
       {},
       "bodies that may touch have a direction weight, a step, a bound and an end of their own: "
       "nonlinear CG with inertia and a pointwise preconditioner, on several bodies"},
      {"regions",
       false,
       {},
       {},
       "nonlinear CG, instead of islands: what contact acts on has a direction weight and a step "
       "of its own, and what is free has others"},
      {"rigid_predictor",
       true,
       {},
       {},
       "a step starts nearer to a rigid motion of each free body, the less of its own motion the "
       "body kept in the step before; off: from the predictor of single vertices"},
      {"sleep_speed",
       0.0,
       {.min = 0, .max = 1e9, .unit = "m/s"},
       {},
       "bodies that have been slower for sleep_steps steps leave the steps until something comes "
       "to "
       "act on them; 0: none does. What creeps slower than this stops"},
      {"sleep_steps", 20, {.min = 1, .max = 1e6}, {}, "slow steps in a row before bodies sleep"},
  };
  return keys;
}

std::span<OptionKey const> contact_keys() {
  static std::vector<OptionKey> const keys{
      {"dhat",
       0.0,
       {.min = 0, .max = 1e9, .unit = "m"},
       {},
       "distance at which contact begins to act; 0: 0.3 of the mean edge of the finest object's "
       "surface"},
      {"cap",
       0.5,
       {.min = 0, .max = 1, .open_min = true, .open_max = true},
       {},
       "of its distance at rest: no pair of one body acts from further away"},
      {"start_share",
       0.9,
       {.min = 0, .max = 1, .open_max = true},
       {},
       "of the gap that they start with: two bodies, or one and an obstacle, act from no further "
       "away until they have been further apart; 0: from dhat, so that what starts closer is "
       "pushed apart"},
      {"stiffness",
       std::string("elastic_inclusive"),
       {},
       {"elastic_inclusive", "given", "ipc_adaptive"},
       "of a pair: what its vertices resist with in this step; `pressure` times area over dhat; or "
       "IPC's, one for all pairs"},
      {"pressure",
       0.0,
       {.min = 0, .max = 1e15, .unit = "Pa"},
       {},
       "of stiffness = \"given\": modulus of the layer of air, of thickness dhat, between bodies"},
      {"stiffness_factor",
       1.0,
       {.min = 0, .max = 1e9, .open_min = true},
       {},
       "multiplies stiffness = \"elastic_inclusive\""},
      {"friction",
       0.0,
       {.min = 0, .max = 100},
       {},
       "coefficient of Coulomb's law between bodies, and between them and obstacles without one"},
      {"stick_speed",
       0.0,
       {.min = 0, .max = 1e9, .unit = "m/s"},
       {},
       "what is slower sticks, and creeps; 0: 1e-3 of the diagonal of the box of the bodies per "
       "second"},
      {"friction_passes",
       1,
       {.min = 1, .max = 100},
       {},
       "minimisations of a step, each with the normal forces of the one before"},
      {"barrier",
       std::string("log"),
       {},
       {"log", "ipc", "log_squared", "cubic"},
       "energy over distance of a pair; all but log in fp64 alone"},
      {"curvature",
       std::string("gauss_newton"),
       {},
       {"gauss_newton", "truncated", "exact"},
       "of the barrier's energy: without the motion of the closest points, so that it is positive; "
       "as in the PNCG paper; exact. All but gauss_newton in fp64 alone"},
      {"mollifier",
       true,
       {},
       {},
       "takes nearly parallel edges out smoothly; off, as in the PNCG paper, in fp64 alone"},
      {"search",
       std::string("bvh"),
       {},
       {"bvh", "spatial_hash", "brute_force"},
       "how pairs are found; all find the same, and all but bvh in fp64 alone"},
      {"bound",
       std::string("additive_ccd"),
       {},
       {"additive_ccd", "closing", "half_dhat"},
       "how far a step may go: certified by continuous collision detection, or by the fastest "
       "closing; half_dhat is the PNCG paper's, NO guarantee. All but additive_ccd in fp64 alone"},
  };
  return keys;
}

Options::Options(std::span<OptionKey const> keys) {
  for (OptionKey const& key : keys) values_.emplace(key.name, key.fallback);
}

Options::Options(std::span<OptionKey const> keys, Section const& section) : Options(keys) {
  std::vector<std::string_view> names;
  for (OptionKey const& key : keys) names.push_back(key.name);
  section.allow(names);
  for (OptionKey const& key : keys) {
    OptionValue& value = values_.find(key.name)->second;
    if (bool* flag = std::get_if<bool>(&value)) {
      *flag = section.flag(key.name, *flag);
    } else if (int* integer = std::get_if<int>(&value)) {
      *integer = section.integer(key.name, key.range, *integer);
    } else if (double* number = std::get_if<double>(&value)) {
      *number = section.number(key.name, key.range, *number);
    } else {
      std::string& text = std::get<std::string>(value);
      text = section.choice(key.name, key.choices, text);
    }
  }
}

ContactOptions::ContactOptions(Section const& section) : Options(contact_keys(), section) {
  if (text("stiffness") == "given" && number("pressure") == 0) {
    throw Error(
        "{}: stiffness = \"given\" needs a pressure: give the modulus in Pa of the layer between "
        "bodies, about that of the softest of them",
        section.where());
  }
}

}  // namespace taut
