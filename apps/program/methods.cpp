#include <taut/apps/program/methods.hpp>

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

}  // namespace taut
