// Contact, with a barrier of one's own: a block falls onto another one that is held.
#include <taut/contact/contact.hpp>
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/connected.hpp>
#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/materials/neo_hookean.hpp>

#include <cstdio>

/// g = (1 - x)^3 / x of the relative distance x: grows faster than a logarithm.
struct Reciprocal {
  static constexpr char const* name = "reciprocal";
  static constexpr double curvature_at_half = 14;

  template <class T>
  KOKKOS_FUNCTION static T value(taut::RelativeDistance<T> const& s) {
    return s.room * s.room * s.room / s.x;
  }
  template <class T>
  KOKKOS_FUNCTION static T slope(taut::RelativeDistance<T> const& s) {
    return -s.room * s.room * (1 + 2 * s.x) / (s.x * s.x);
  }
  template <class T>
  KOKKOS_FUNCTION static T curvature(taut::RelativeDistance<T> const& s) {
    return 2 * s.room * (1 + s.x + s.x * s.x) / (s.x * s.x * s.x);
  }
  /// g(after) - g(before), without subtracting one from the other.
  template <class T>
  KOKKOS_FUNCTION static T change(taut::RelativeDistance<T> const& before,
                                  taut::RelativeDistance<T> const& after,
                                  taut::RelativeStep<T> const& step) {
    T const a = after.room, b = before.room;
    return -step.x * ((a * a + a * b + b * b) * before.x + b * b * b) / (after.x * before.x);
  }
};

/// The upper block, 1 m above the lower one.
taut::TetMesh two_blocks() {
  taut::TetMesh mesh = taut::make_shape(taut::BoxShape{{1, 0.5, 1}}, 4);
  auto const count = static_cast<std::int32_t>(mesh.points.size());
  taut::TetMesh const upper = taut::make_shape(taut::BoxShape{{0.5, 0.5, 0.5}}, 3);
  for (taut::Point const& x : upper.points) mesh.points.push_back({x[0], x[1] + 0.6, x[2]});
  for (taut::Tet tet : upper.tets) {
    for (std::int32_t& v : tet) v += count;
    mesh.tets.push_back(tet);
  }
  return mesh;
}

int main() {
  Kokkos::ScopeGuard const kokkos;
  using namespace taut;
  Body<> body(two_blocks(), 1000);
  body.fix([](Point const& x) { return x[1] < -0.24; });
  // What is connected is one body: pairs of one body act from closer by than pairs of two.
  Surface const surface = make_surface(boundary_faces(body.rest.tets),
                                       smallest_connected(body.rest.points.size(), body.rest.tets));

  Contact<PairEnergy<Normalised<Reciprocal>>> const contact(body.unknowns, surface,
                                                            body.rest.points, {});
  Potential scene(body.unknowns, Inertia(body.unknowns), BodyForce(body.unknowns, {0, -9.81, 0}),
                  ElasticTets<Elastic<NeoHookean>>(body.rest, lame_parameters(3e5, 0.4)), contact);
  ImplicitEuler<Ncg<DaiKou, BlockJacobi>> stepper;
  State<> state(body.positions());
  bool converged = true;
  for (int frame = 0; frame < 40; ++frame) {
    converged &= stepper.step(scene, state, 0.01).converged();
  }
  ContactReport const report = contact.report(state.x);
  std::printf("%d contacts, the smallest gap is %.2f of dhat = %.3f m\n", report.contacts,
              report.smallest_gap, contact.dhat());
  return converged && report.contacts > 0 && report.smallest_gap > 0 ? 0 : 1;
}
