// A term of one's own: springs between vertices. Write one element; StencilTerm makes it a term of
// the potential.
#include "bar.hpp"

#include <taut/core/potential/stencil_term.hpp>
#include <taut/integrators/ncg.hpp>

#include <cmath>

/// E = k/2 (|x1 - x0| - rest)^2 for spring e.
struct Spring {
  static constexpr int vertices = 2;
  double stiffness;  ///< N/m
  double rest;       ///< m

  KOKKOS_FUNCTION double value(int, taut::Vec3<double> const (&x)[2]) const {
    double const stretch = taut::norm(x[1] - x[0]) - rest;
    return 0.5 * stiffness * stretch * stretch;
  }
  KOKKOS_FUNCTION taut::Vec3<double> gradient(int, taut::Vec3<double> const (&x)[2], int a) const {
    taut::Vec3<double> const d = x[1] - x[0];
    double const length = taut::norm(d);
    double const force = stiffness * (length - rest) / length;
    return (a == 0 ? -force : force) * d;
  }
  /// k (n n' + max(0, 1 - rest / length) (I - n n')): what a compressed spring lacks across is left
  /// out.
  KOKKOS_FUNCTION taut::Mat3<double> curvature(int, taut::Vec3<double> const (&x)[2], int a,
                                               int b) const {
    taut::Vec3<double> const d = x[1] - x[0];
    double const length = taut::norm(d), across = Kokkos::max(0.0, 1 - rest / length);
    taut::Mat3<double> const nn = (1 / (length * length)) * taut::outer(d, d);
    taut::Mat3<double> const h = (1 - across) * nn + across * taut::identity3<double>();
    return (a == b ? stiffness : -stiffness) * h;
  }
};

int main() {
  Kokkos::ScopeGuard const kokkos;
  using namespace taut;
  Bar const bar;
  // Strings along the upper side, from the fixed end to the free one.
  std::vector<std::array<int, 2>> strings;
  std::vector<Point> const& p = bar.rest.points;
  for (int i = 0; i < bar.unknowns.size(); ++i)
    for (int j = 0; j < bar.unknowns.size(); ++j) {
      bool const top = p[i][1] > 0.2 - 1e-9 && p[j][1] == p[i][1] && p[j][2] == p[i][2];
      if (top && p[j][0] - p[i][0] > 2 - 1e-9) strings.push_back({i, j});
    }
  auto const sag = [&](double stiffness) {
    ElasticTets<Elastic<StableNeoHookean>> const tets(bar.rest, lame_parameters(3e5, 0.4));
    StencilTerm<Spring> const spring({stiffness, 2}, strings, bar.unknowns.size());
    Potential scene(bar.unknowns, Inertia(bar.unknowns), BodyForce(bar.unknowns, {0, -9.81, 0}),
                    tets, spring);
    ImplicitEuler<Ncg<DaiKou, BlockJacobi>> stepper;
    State<> state = bar.state();
    for (int step = 0; step < 40; ++step) {
      if (!stepper.step(scene, state, 0.01).converged()) return std::nan("");
    }
    return bar.lowest(state);
  };
  double const without = sag(0), with = sag(5e5);
  std::printf("lowest point after 0.4 s: %.3f m without, %.3f m with strings\n", without, with);
  return with > without + 0.05 ? 0 : 1;
}
