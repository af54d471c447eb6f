#include <taut/apps/program/scene_options.hpp>
#include <taut/integrators/lbfgs.hpp>

namespace taut {

std::span<SolverKey const> solver_keys() {
  static std::vector<SolverKey> const keys{
      {"method",
       std::string("dk"),
       {},
       {"dk", "dk+", "hz", "hs", "prp", "prp+", "ls", "fr", "cd", "bfgs", "lbfgs", "chebyshev",
        "newton", "gradient"},
       "the minimiser: nonlinear conjugate gradients by its beta, or another one"},
      {"precision",
       std::string("fp64"),
       {},
       {"fp64", "mixed", "fp32"},
       "mixed: fp32 kernels with fp64 positions and sums"},
      {"preconditioner",
       std::string("block_jacobi"),
       {},
       {"identity", "jacobi", "block_jacobi", "schwarz_16", "schwarz_32"},
       "schwarz: dense aggregates of 16 or 32 vertices with a coarse level"},
      {"refresh",
       std::string("auto"),
       {},
       {"auto", "always", "lagged", "rare"},
       "when the preconditioner is rebuilt: at each iterate; every refresh_every; the same and "
       "where the steps collapse; auto: rare for schwarz, always for the others"},
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
       {"decrement_window", "energy_drop", "gradient_norm", "budget"},
       "what ends a step: sum of the last energy decrements below 1/2 M (tolerance L)^2; energy "
       "drop "
       "relative to the first; gradient norm relative to the first; max_iterations alone"},
      {"tolerance", 1e-3, {.min = 0, .max = 1, .open_min = true}, {}, "of the stopping rule"},
      {"window",
       0,
       {.min = 0, .max = 1000},
       {},
       "decrements summed at least by decrement_window; 0: 8, or 1 for newton"},
      {"max_iterations", 2000, {.min = 1, .max = 1e9}, {}, "budget of a time step"},
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
  };
  return keys;
}

SolverOptions::SolverOptions() {
  for (SolverKey const& key : solver_keys()) values_.emplace(key.name, key.fallback);
}

SolverOptions::SolverOptions(Section const& solver) : SolverOptions() {
  std::vector<std::string_view> names;
  for (SolverKey const& key : solver_keys()) names.push_back(key.name);
  solver.allow(names);
  for (SolverKey const& key : solver_keys()) {
    OptionValue& value = values_.find(key.name)->second;
    if (bool* flag = std::get_if<bool>(&value)) {
      *flag = solver.flag(key.name, *flag);
    } else if (int* integer = std::get_if<int>(&value)) {
      *integer = solver.integer(key.name, key.range, *integer);
    } else if (double* number = std::get_if<double>(&value)) {
      *number = solver.number(key.name, key.range, *number);
    } else {
      std::string& text = std::get<std::string>(value);
      text = solver.choice(key.name, key.choices, text);
    }
  }
}

}  // namespace taut
