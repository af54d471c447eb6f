// The adaptive rule of IPC: what it makes of a balance of gradients, and that a term hands it the
// right one.
#include "contact_scenes.hpp"

#include <taut/contact/obstacle.hpp>
#include <taut/contact/obstacle_shapes.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

using namespace taut;
using namespace taut::scenes;
using Catch::Matchers::WithinRel;

namespace {

using S = DefaultSpace;

/// Forces of all else that are `factor` times those of a barrier of K = 1, so that K should be
/// `factor`; `mass` says what the least K is.
template <class Term>
double adapted_form(Term const& term, VectorField<double, S> const& x,
                    VectorField<double, S> const& p, FixedMask<S> const& fixed, double factor,
                    double mass) {
  int const n = static_cast<int>(x.extent(0));
  double const h = 0.01, scale = h * h;
  StepStart<Fp64, S> start{x, h, {}};
  start.stiffness = Array<double, S>("stiffness", n);
  start.gradient = VectorField<double, S>("gradient", n);
  start.scale = scale;
  start.mean_mass = mass;
  term.begin_step(start);  // nothing pushes: the least K
  double const least = term.quadratic_form(x, p, 1);
  // The gradient of the barrier of the least K, against which all else is to push.
  VectorField<double, S> const g("g", n);
  term.add_gradient(x, 1, fixed, g);
  auto const from = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), g);
  auto const to = Kokkos::create_mirror_view(start.gradient);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) to(i, c) = -factor * scale * from(i, c);
  assign(start.gradient, to);
  term.begin_step(start);
  return term.quadratic_form(x, p, 1) / least;
}

}  // namespace

TEST_CASE("IPC's stiffness balances gradients, within its bounds", "[contact]") {
  IpcAdaptiveStiffness rule;
  StiffnessBalance balance{
      .push = 6, .square = 2, .gap = 0.01, .inertia = 1e-9, .size = 1, .curvature = 100};
  double const low = 1;  // 1e11 1e-9 / 100
  rule.adapt(balance);
  CHECK_THAT(rule.stiffness, WithinRel(3 * low, 1e-15));
  balance.push = -1;  // all else pulls them apart
  rule.adapt(balance);
  CHECK_THAT(rule.stiffness, WithinRel(low, 1e-15));
  balance.push = 1e9;
  rule.adapt(balance);
  CHECK_THAT(rule.stiffness, WithinRel(100 * low, 1e-15));
  balance.square = balance.push = 0;  // nothing acts
  rule.adapt(balance);
  CHECK_THAT(rule.stiffness, WithinRel(low, 1e-15));
  balance.gap = 0.9e-9;
  rule.adapt(balance);
  CHECK_THAT(rule.stiffness, WithinRel(100 * low, 1e-15));
  rule.reset();
  CHECK(rule.stiffness == 1);
}

TEST_CASE("terms adapt to what pushes against them", "[contact]") {
  Squashed const s;
  auto const x = soups::to_field<double, S>(s.x), p = soups::to_field<double, S>(s.p);
  Unknowns<Fp64, S> const unknowns(std::vector<double>(s.x.size(), 1), 0.5);
  SECTION("pairs") {
    Contact<PairEnergy<>, Bvh<S>, AdditiveCcd, IpcAdaptiveStiffness, Fp64> const contact(
        unknowns, s.surface, s.rest, {.dhat = Squashed::dhat, .start_share = 0});
    CHECK_THAT(adapted_form(contact, x, p, unknowns.fixed, 7, 1), WithinRel(7, 1e-9));
    CHECK_THAT(adapted_form(contact, x, p, unknowns.fixed, 0.5, 1), WithinRel(1, 1e-9));
    CHECK_THAT(adapted_form(contact, x, p, unknowns.fixed, 700, 1), WithinRel(100, 1e-9));
  }
  SECTION("an obstacle") {
    double low = 1e9;
    for (Point const& v : s.x) low = std::min(low, v[1]);
    Obstacle<HalfSpace, Normalised<LogBarrier>, IpcAdaptiveStiffness, Fp64> const floor(
        unknowns, s.surface, s.rest, HalfSpace{}, {.dhat = Squashed::dhat, .start_share = 0},
        RigidPose{.translation = {0, low - 0.3 * Squashed::dhat, 0}});
    CHECK_THAT(adapted_form(floor, x, p, unknowns.fixed, 7, 1), WithinRel(7, 1e-9));
  }
}
