// Each material flows by its own map, and a particle's one number is what that map remembers.
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <taut/mpm/plastic_flow.hpp>

#include <algorithm>

using namespace taut;
using Catch::Matchers::WithinAbs;

namespace {

using Host = Space<Kokkos::DefaultHostExecutionSpace>;

static_assert(Flow<FlowOfMaterials<Host>>);

Mat3<double> stretched(double a, double b, double c) {
  Mat3<double> F = identity3<double>();
  F(0, 0) = a, F(1, 1) = b, F(2, 2) = c;
  return F;
}

bool same(Mat3<double> const& a, Mat3<double> const& b) { return std::equal(a.a, a.a + 9, b.a); }

}  // namespace

TEST_CASE("a scene's materials flow each in their own way", "[plasticity]") {
  MaterialFlow metal{.kind = FlowKind::von_mises,
                     .metal = {.mu = 1, .yield_stress = 0.1, .hardening = 0.2}};
  MaterialFlow hot{.kind = FlowKind::von_mises_fixed_corotated, .metal_of_hot = {1, 0.1}};
  MaterialFlow snow{.kind = FlowKind::snow};
  MaterialFlow sand{.kind = FlowKind::sand, .sand = {.mu = 1, .lambda = 1}};
  std::vector<MaterialFlow> const all{MaterialFlow(), metal, hot, snow, sand};
  FlowOfMaterials<Host> const flow(all);
  for (Mat3<double> const& trial :
       {stretched(1.3, 0.9, 0.8), stretched(0.7, 0.8, 0.9), stretched(1.1, 1.2, 1.3)}) {
    for (int m = 0; m < 5; ++m) {
      CAPTURE(m);
      Mat3<double> F = trial;
      double plastic = all[m].initial(), stiffness = 1;
      flow(m, F, plastic, stiffness);
      VonMises::State<double> strain{0};
      SnowClamp::State<double> volume{1};
      DruckerPrager::State<double> gain{0, 0};
      VonMisesFixedCorotated::State<double> none;
      Mat3<double> expected = trial;
      double remembered = 0;
      if (m == 1) expected = metal.metal.map(trial, strain).F, remembered = strain.strain;
      if (m == 2) expected = hot.metal_of_hot.map(trial, none).F;
      if (m == 3) expected = snow.snow.map(trial, volume).F, remembered = volume.volume;
      if (m == 4) expected = sand.sand.map(trial, gain).F, remembered = gain.gained;
      CHECK(same(F, expected));
      CHECK(plastic == remembered);
      CHECK(stiffness == (m == 3 ? snow.snow.stiffening(volume) : 1));
      // What has flowed is borne from there on, but by sand that owes volume.
      if (m == 4 && plastic != 0) continue;
      Mat3<double> again = F;
      double const before = plastic;
      flow(m, again, plastic, stiffness);
      CHECK(same(again, F));
      CHECK(plastic == before);
    }
  }
}

TEST_CASE("sand that has expanded bears nothing until it is compact again", "[plasticity]") {
  MaterialFlow const sand{.kind = FlowKind::sand, .sand = {.mu = 1, .lambda = 1}};
  double gained = sand.initial(), stiffness = 1;
  Mat3<double> F = stretched(1.1, 1.1, 1.1);
  sand(F, gained, stiffness);
  CHECK_THAT(gained, WithinAbs(3 * std::log(1.1), 1e-12));
  CHECK(norm(F.column(0)) == 1);
  F = stretched(0.95, 0.95, 0.95);
  sand(F, gained, stiffness);
  CHECK_THAT(gained, WithinAbs(3 * std::log(1.1 * 0.95), 1e-12));
  F = stretched(0.9, 0.9, 0.9);
  sand(F, gained, stiffness);
  CHECK(gained == 0);
  CHECK_THAT(determinant(F), WithinAbs(std::pow(1.1 * 0.95 * 0.9, 3), 1e-12));
}
