// The README's example, word for word: what a stranger writes against the installed package.
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/presets/elastic.hpp>
using namespace taut;

int main() {
  Kokkos::ScopeGuard const kokkos;
  Body<> body(make_shape(BoxShape{{2, 0.4, 0.4}}, 15), 1000);  // m, cells, kg/m^3
  body.fix([](Point const& x) { return x[0] < -0.999; });
  Potential scene(body.unknowns, Inertia(body.unknowns), BodyForce(body.unknowns, {0, -9.81, 0}),
                  ElasticTets<Elastic<StableNeoHookean>>(body.rest, lame_parameters(1e6, 0.4)));
  ImplicitEuler<Ncg<DaiKou, BlockJacobi>> stepper({.stop = {.tolerance = 1e-3}});
  State<> state(body.positions());
  bool converged = true;
  for (int frame = 0; frame < 30; ++frame) {
    converged &= stepper.step(scene, state, 1.0 / 60).converged();
  }
  return converged ? 0 : 1;
}
