// A beta of one's own: the hybrid of Dai and Yuan with Hestenes and Stiefel, max(0, min(HS, DY)).
#include "bar.hpp"

#include <taut/integrators/ncg.hpp>

struct DaiYuanHybrid {
  static constexpr char const* name = "hsdy";
  taut::Coefficients operator()(taut::Dots const& d) const {
    double const hs = d.g1_P1_y / d.y_p, dy = d.g1_P1_g1 / d.y_p;
    return {.beta = std::max(0.0, std::min(hs, dy))};
  }
};

template <class Beta>
int iterations(Bar const& bar) {
  using namespace taut;
  Potential scene(bar.unknowns, Inertia(bar.unknowns), BodyForce(bar.unknowns, {0, -9.81, 0}),
                  ElasticTets<Elastic<StableNeoHookean>>(bar.rest, lame_parameters(1e6, 0.4)));
  ImplicitEuler<Ncg<Beta, BlockJacobi>> stepper;
  State<> state = bar.state();
  int total = 0;
  for (int step = 0; step < 10; ++step) {
    MinimiserReport const report = stepper.step(scene, state, 0.01);
    if (!report.converged()) return -1;
    total += report.iterations;
  }
  return total;
}

int main() {
  Kokkos::ScopeGuard const kokkos;
  Bar const bar;
  int const own = iterations<DaiYuanHybrid>(bar), dai_kou = iterations<taut::DaiKou>(bar);
  std::printf("iterations in 10 steps: own %d, Dai-Kou %d\n", own, dai_kou);
  return own > 0 && dai_kou > 0 ? 0 : 1;
}
