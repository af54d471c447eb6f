// A time integrator of one's own: the implicit midpoint rule. With the midpoint y = (x + x+)/2 a
// step minimises 1/2 |y - (x + h/2 v)|^2_M + (h/2)^2 V(y); then x+ = 2 y - x and v+ = 2 (y - x) /
// (h/2) - v. It keeps the energy of an undamped swing, which implicit Euler loses.
#include "bar.hpp"

#include <taut/core/exec/copy.hpp>
#include <taut/integrators/ncg.hpp>

using namespace taut;

template <class Minimiser>
class ImplicitMidpoint {
public:
  template <class Potential>
  MinimiserReport step(Potential& potential, State<>& state, double h) {
    potential.begin_step(state.x, h * h / 4, h / 2, true);
    auto const target = potential.template term<Inertia<>>().target();
    State<>::Positions const y("midpoint", state.size());
    axpy(target, 1, state.x, h / 2, state.v);
    assign(y, target);
    potential.predict(y);
    pin(potential.unknowns(), state.x, y);
    MinimiserReport const report = minimiser_.minimise(potential, y);
    axpy(state.v, 4 / h, y, -4 / h, state.x, -1, state.v);
    axpy(state.x, 2, y, -1, state.x);
    state.time += h;
    state.last_step = h;
    ++state.steps;
    return report;
  }

private:
  using Field = State<>::Positions;
  /// to = a x + b y + c z
  static void axpy(Field const& to, double a, Field const& x, double b, Field const& y,
                   double c = 0, Field const& z = {}) {
    for_each<DefaultSpace>("axpy", int(to.extent(0)), Axpy{to, x, y, z, a, b, c});
  }
  struct Axpy {
    Field to, x, y, z;
    double a, b, c;
    KOKKOS_FUNCTION void operator()(int i) const {
      for (int k = 0; k < 3; ++k) {
        to(i, k) = a * x(i, k) + b * y(i, k) + (c != 0 ? c * z(i, k) : 0);
      }
    }
  };
  /// Fixed vertices stay where they are.
  static void pin(Unknowns<> const& unknowns, Field const& from, Field const& to) {
    for_each<DefaultSpace>("pin", int(to.extent(0)), Pin{unknowns.fixed, from, to});
  }
  struct Pin {
    FixedMask<DefaultSpace> fixed;
    Field from, to;
    KOKKOS_FUNCTION void operator()(int i) const {
      for (int k = 0; k < 3; ++k) {
        if (fixed(i)) to(i, k) = from(i, k);
      }
    }
  };

  Minimiser minimiser_;
};

/// Height of the swing back after the first fall, relative to the fall.
template <class Stepper>
double rebound(Bar const& bar) {
  Potential scene(bar.unknowns, Inertia(bar.unknowns), BodyForce(bar.unknowns, {0, -9.81, 0}),
                  ElasticTets<Elastic<StableNeoHookean>>(bar.rest, lame_parameters(4e6, 0.4)));
  Stepper stepper;
  State<> state = bar.state();
  double const rest = bar.lowest(state);
  double fall = 0, back = 0;
  for (int step = 0; step < 120; ++step) {
    stepper.step(scene, state, 0.01);
    double const depth = rest - bar.lowest(state);
    if (depth > fall) back = fall = depth;
    back = std::min(back, depth);
  }
  return 1 - back / fall;
}

int main() {
  Kokkos::ScopeGuard const kokkos;
  Bar const bar;
  using Minimiser = Ncg<DaiKou, BlockJacobi>;
  double const euler = rebound<ImplicitEuler<Minimiser>>(bar);
  double const midpoint = rebound<ImplicitMidpoint<Minimiser>>(bar);
  std::printf("the bar swings back by %.0f %% (implicit Euler), %.0f %% (midpoint)\n", 100 * euler,
              100 * midpoint);
  return midpoint > euler + 0.05 ? 0 : 1;
}
