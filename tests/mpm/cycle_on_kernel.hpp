// L-BFGS on a multigrid cycle whose stencils are as wide as a kernel asks for.
#pragma once

#include <taut/integrators/lbfgs.hpp>
#include <taut/mpm/particle_multigrid.hpp>

namespace taut::test {

template <Spline K>
struct CycleOnKernel {
  template <class Precision, class Space>
  using Cycle = ParticleMultigrid<
      Precision, Space,
      ParticleCyclePolicies<false, Chebyshev, ForwardBackward, LinearEmbedding, float, K>>;
  using Minimiser = Lbfgs<Cycle, SufficientDecrease, DecrementWindow, Fp64>;
};

}  // namespace taut::test
