#include <taut/apps/program/methods.hpp>

#include <taut/core/report/error.hpp>

#include <algorithm>
#include <array>

namespace taut {

std::span<MethodTitle const> method_titles() {
  static constexpr std::array titles{
      MethodTitle{"dk", "DK", "nonlinear CG, Dai and Kou's beta (default)"},
      MethodTitle{"dk+", "DK+", "the same, kept from becoming too negative"},
      MethodTitle{"hz", "HZ", "nonlinear CG, Hager and Zhang"},
      MethodTitle{"hs", "HS", "nonlinear CG, Hestenes and Stiefel"},
      MethodTitle{"prp", "PRP", "nonlinear CG, Polak, Ribiere and Polyak"},
      MethodTitle{"prp+", "PRP+", "the same, kept positive"},
      MethodTitle{"ls", "LS", "nonlinear CG, Liu and Storey (what the PNCG paper prints as PRP)"},
      MethodTitle{"fr", "FR", "nonlinear CG, Fletcher and Reeves"},
      MethodTitle{"cd", "CD", "nonlinear CG, conjugate descent"},
      MethodTitle{"bfgs", "SSML-BFGS", "three-term memoryless BFGS"},
      MethodTitle{"lbfgs", "L-BFGS", "limited-memory BFGS, window solver.history"},
      MethodTitle{"chebyshev", "Chebyshev", "semi-iteration of Wang and Yang 2016"},
      MethodTitle{"newton", "Newton", "projected Newton with PCG: the reference of all charts"},
      MethodTitle{"gradient", "gradient", "preconditioned gradient descent: the floor"}};
  return titles;
}

void require_of_meshes(SolverOptions const& options) {
  std::string const& method = options.text("method");
  auto const titles = method_titles();
  if (std::none_of(titles.begin(), titles.end(),
                   [&](MethodTitle const& title) { return title.name == method; })) {
    throw Error(
        "solver.method = \"{}\" is of scenes of material points: choose lbfgs, newton, chebyshev "
        "or a nonlinear CG",
        method);
  }
  if (options.text("preconditioner") == "multigrid") {
    throw Error(
        "solver.preconditioner = \"multigrid\" needs the nodes of a grid, which a scene of meshes "
        "does not have: choose schwarz_32, or add a table [grid]");
  }
  std::string const& stopping = options.text("stopping");
  if (stopping == "characteristic_norm" || stopping == "momentum_norm") {
    throw Error(
        "solver.stopping = \"{}\" is of scenes of material points: choose decrement_window, "
        "energy_drop or gradient_norm",
        stopping);
  }
}

}  // namespace taut
