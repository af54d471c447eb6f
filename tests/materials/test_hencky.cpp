// Hencky's energy, and plasticity within it: derivatives, the return maps, closed forms of shear
// and of a pulled bar, and that it is the least that flow can make of a step.
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/materials/hencky.hpp>

#include "samples.hpp"

namespace {

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::frobenius;
using test::with_stretches;
using Parameters = HenckyParameters<double>;

static_assert(ElementMaterial<Hencky>);

Lame<double> const solid = lame_parameters(2e5, 0.3);

Mat3<double> diagonal(double a, double b, double c) { return {{a, 0, 0, 0, b, 0, 0, 0, c}}; }

/// Of a point that remembers this.
Parameters of(Parameters const& p, double limit, double gained = 0) {
  return Hencky::with(p, YieldMemory<double>{limit, gained});
}

struct Sample {
  char const* name;
  Parameters p;
  Mat3<double> F;
};

/// Elastic and flowing, compressed and stretched, with and without hardening; far from the kinks of
/// the second derivative at yield and where sand opens.
std::vector<Sample> samples() {
  std::mt19937 random(4);
  Parameters const elastic = hencky(solid);
  Parameters const perfect = hencky(solid, VonMises{solid.mu, 4e3});
  Parameters const hardens = hencky(solid, VonMises{solid.mu, 4e3, 5e4});
  Parameters const sand = hencky(solid, DruckerPrager{solid.mu, solid.lambda, 30});
  double const r = perfect.yield;
  std::vector<Sample> all;
  for (auto const& [name, p] : {std::pair{"elastic", elastic}, std::pair{"perfect", of(perfect, r)},
                                std::pair{"hardens", of(hardens, 2 * r)}}) {
    all.push_back({name, p, with_stretches(random, 1.4, 1.1, 0.8)});
    all.push_back({name, p, with_stretches(random, 0.9, 0.6, 0.4)});
    all.push_back({name, p, with_stretches(random, 3.0, 2.9, 2.8)});
    all.push_back({name, p, with_stretches(random, 1.003, 1.001, 0.998)});
    all.push_back({name, p, with_stretches(random, 1.5, 1.5, 0.7)});
    all.push_back({name, p, with_stretches(random, 1.5, 0.7, 0.7)});
    all.push_back({name, p, with_stretches(random, 1.5, 0.7 + 1e-9, 0.7)});
    all.push_back({name, p, with_stretches(random, 0.8, 0.8, 0.8)});
    all.push_back({name, p, identity3<double>()});
  }
  for (auto const& [limit, gained] :
       {std::pair{0.1, 0.0}, std::pair{0.02, 0.05}, std::pair{0.3, 0.0}})
    for (auto const& F :
         {with_stretches(random, 1.1, 0.9, 0.8), with_stretches(random, 0.8, 0.8, 0.6),
          with_stretches(random, 1.3, 1.2, 0.9)}) {
      all.push_back({"sand", of(sand, limit, gained), F});
    }
  return all;
}

Mat3<double> kirchhoff(Parameters const& p, Mat3<double> const& F) {
  return Hencky::stress(Hencky::evaluate(p, F)) * transpose(F);
}

}  // namespace

TEST_CASE("energy, stress and second derivative of Hencky's model belong together", "[hencky]") {
  std::mt19937 random(9);
  for (auto const& [name, p, F] : samples()) {
    CAPTURE(name, svd(F).s[0], svd(F).s[1], svd(F).s[2], p.limit);
    auto const state = Hencky::evaluate(p, F);
    Mat3<double> const P = Hencky::stress(state);
    SingularFrame<double> const frame = kernels::hencky_frame<false>(state);
    double const modulus = 2e5, h = 1e-5;
    for (int k = 0; k < 6; ++k) {
      Mat3<double> const dF = test::random_matrix(random);
      double const up = Hencky::energy(p, F + h * dF), down = Hencky::energy(p, F - h * dF);
      CHECK_THAT(contract(P, dF), WithinAbs((up - down) / (2 * h), 1e-7 * modulus));
      Mat3<double> const Pu = Hencky::stress(Hencky::evaluate(p, F + h * dF)),
                         Pd = Hencky::stress(Hencky::evaluate(p, F - h * dF));
      Mat3<double> const dP = (1 / (2 * h)) * (Pu - Pd);
      CHECK_THAT(frobenius(frame.apply(dF) - dP), WithinAbs(0, 2e-6 * modulus * frobenius(dF)));
      // vertex_pair is the same second derivative.
      Vec3<double> const a{0.3, -0.7, 1.1}, b{-0.2, 0.9, 0.4}, u{0.6, 0.1, -0.8};
      Vec3<double> const whole = frame.apply(outer(u, b)) * a;
      Vec3<double> const pair =
          frame.vertex_pair(transpose_times(frame.V, a), transpose_times(frame.V, b)) * u;
      CHECK_THAT(norm(whole - pair), WithinAbs(0, 1e-10 * modulus));
    }
    // What minimisers use is its projection, nowhere negative and never less.
    for (int k = 0; k < 6; ++k) {
      Mat3<double> const dF = test::random_matrix(random);
      double const form = Hencky::quadratic(state, dF);
      CHECK(form >= -1e-10 * modulus);
      CHECK(form >= contract(frame.apply(dF), dF) - 1e-9 * modulus);
    }
  }
}

TEST_CASE("the change of Hencky's energy is as exact for small steps as for large ones",
          "[hencky]") {
  std::mt19937 random(3);
  for (auto const& [name, p, F] : samples()) {
    CAPTURE(name);
    auto const state = Hencky::evaluate(p, F);
    Mat3<double> const dF = test::random_matrix(random, 0.05);
    CHECK_THAT(Hencky::change(p, state, dF),
               WithinAbs(Hencky::energy(p, F) - Hencky::energy(p, F - dF), 1e-9));
    // Against the stress in the middle: what is left is of third order.
    for (double h : {1e-3, 1e-5, 1e-7}) {
      Mat3<double> const P = Hencky::stress(Hencky::evaluate(p, F - (h / 2) * dF));
      CHECK_THAT(Hencky::change(p, state, h * dF),
                 WithinAbs(h * contract(P, dF), 1e3 * h * h * h + 1e-15 * 2e5));
    }
  }
}

TEST_CASE("the stress is continuous where a material begins to yield", "[hencky]") {
  std::mt19937 random(5);
  Parameters const metal = hencky(solid, VonMises{solid.mu, 4e3, 2e4});
  Mat3<double> const F = with_stretches(random, 1.1, 1.0, 0.95);
  double const size = Hencky::evaluate(metal, F).size;
  auto const just = [&](double factor) { return of(metal, factor * size); };
  auto const below = Hencky::evaluate(just(1 - 1e-9), F),
             above = Hencky::evaluate(just(1 + 1e-9), F);
  CHECK(below.over > 0);
  CHECK(above.over == 0);
  CHECK_THAT(frobenius(Hencky::stress(below) - Hencky::stress(above)), WithinAbs(0, 1e-9 * 2e5));
  CHECK_THAT(Hencky::energy(just(1 - 1e-9), F),
             WithinRel(Hencky::energy(just(1 + 1e-9), F), 1e-14));
  CHECK(below.tangent < 0.5 * above.tangent);
}

TEST_CASE("the stress of a trial is the elastic stress after the return map", "[hencky]") {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, 0.2);
  int yielded = 0, opened = 0;
  for (int k = 0; k < 60; ++k) {
    Mat3<double> const F = with_stretches(random, std::exp(normal(random)),
                                          std::exp(normal(random)), std::exp(normal(random)));
    VonMises const metal{solid.mu, 2e4, 3e4};
    double const strain = 0.1 * (k % 3);
    VonMises::State<double> state{strain};
    Returned<double> const mapped = metal.map(F, state);
    yielded += mapped.yielded;
    Parameters const p = hencky(solid, metal);
    Mat3<double> const tau =
        kirchhoff(Hencky::with(p, Hencky::remember(p, identity3<double>(), strain)), F);
    CHECK_THAT(frobenius(tau - kirchhoff(hencky(solid), mapped.F)), WithinAbs(0, 1e-10 * 2e5));

    // Sand, with its pressure at the trial itself: where passes end.
    DruckerPrager const sand{solid.mu, solid.lambda, 35};
    double const gained = 0.05 * (k % 2);
    DruckerPrager::State<double> volume{0, gained};
    Returned<double> const ground = sand.map(F, volume);
    Parameters const q = hencky(solid, sand);
    YieldMemory<double> const now = Hencky::remember(q, F, gained);
    Mat3<double> const borne = kirchhoff(Hencky::with(q, now), F);
    CHECK_THAT(frobenius(borne - kirchhoff(hencky(solid), ground.F)), WithinAbs(0, 1e-10 * 2e5));
    opened += now.limit == 0;
    if (now.limit == 0) CHECK(frobenius(borne) == 0);
  }
  CHECK(yielded > 30);
  CHECK(opened > 10);
  CHECK(opened < 50);
}

TEST_CASE("sheared metal bears the yield stress over the root of three", "[hencky]") {
  // Pure shear e = (g, 0, -g): tau_1 = -tau_3 = 2 mu g up to sigma_Y / sqrt 3, and with hardening
  // mu (e_1 - a sqrt(3)/2) = (sigma_Y + H a) / (2 sqrt 3) from there on.
  double const yield = 4e3, hardening = GENERATE(0.0, 5e4);
  VonMises const metal{solid.mu, yield, hardening};
  Parameters const p = of(hencky(solid, metal), hencky(solid, metal).yield);
  double const root = std::sqrt(3.0), at_yield = yield / (2 * root * solid.mu);
  for (double g : {0.5 * at_yield, 0.99 * at_yield, 1.01 * at_yield, 0.1, 0.5}) {
    Mat3<double> const tau = kirchhoff(p, diagonal(std::exp(g), 1, std::exp(-g)));
    double const a =
        g < at_yield ? 0 : (2 * root * solid.mu * g - yield) / (3 * solid.mu + hardening);
    double const expected = g < at_yield ? 2 * solid.mu * g : (yield + hardening * a) / root;
    CHECK_THAT(tau(0, 0), WithinRel(expected, 1e-12));
    CHECK_THAT(tau(2, 2), WithinRel(-expected, 1e-12));
    CHECK_THAT(tau(1, 1), WithinAbs(0, 1e-9 * yield));
  }
}

TEST_CASE("a pulled bar follows its hardening curve", "[hencky]") {
  // Uniaxial stress tau = sigma_Y + H a at the strain e = tau / E + a, across -nu tau / E - a / 2.
  double const young = 2e5, poisson = 0.3;
  VonMises const metal{solid.mu, 4e3, 5e4};
  Parameters const p = of(hencky(solid, metal), hencky(solid, metal).yield);
  for (double a : {1e-4, 0.01, 0.2}) {
    double const stress = metal.yield_stress + metal.hardening * a;
    double const along = std::exp(stress / young + a),
                 across = std::exp(-poisson * stress / young - a / 2);
    Mat3<double> const tau = kirchhoff(p, diagonal(along, across, across));
    CHECK_THAT(tau(0, 0), WithinRel(stress, 1e-11));
    CHECK_THAT(tau(1, 1), WithinAbs(0, 1e-10 * young));
    CHECK_THAT(tau(2, 2), WithinAbs(0, 1e-10 * young));
    // The map after the step has flowed by as much.
    VonMises::State<double> state;
    metal.map(diagonal(along, across, across), state);
    CHECK_THAT(state.strain, WithinRel(a, 1e-9));
  }
}

TEST_CASE("no flow makes less of a trial than the energy says", "[hencky]") {
  // Elastic energy behind a plastic increment D (traceless, along the principal axes), what D
  // dissipates, and what goes into hardening.
  VonMises const metal{solid.mu, 4e3, 5e4};
  double const before = 0.05;
  Parameters const p = hencky(solid, metal);
  Parameters const point = Hencky::with(p, Hencky::remember(p, identity3<double>(), before));
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 1);
  Vec3<double> const e{0.2, 0.05, -0.15};
  Mat3<double> const F = diagonal(std::exp(e[0]), std::exp(e[1]), std::exp(e[2]));
  auto const spent = [&](Vec3<double> const& D) {
    double const a = std::sqrt(2.0 / 3) * norm(D);
    Mat3<double> const rest =
        diagonal(std::exp(e[0] - D[0]), std::exp(e[1] - D[1]), std::exp(e[2] - D[2]));
    return Hencky::energy(hencky(solid), rest) +
           (metal.yield_stress + metal.hardening * before) * a + 0.5 * metal.hardening * a * a;
  };
  double const least = Hencky::energy(point, F);
  for (int k = 0; k < 200; ++k) {
    Vec3<double> const D = kernels::deviator(
        Vec3<double>{0.2 * normal(random), 0.2 * normal(random), 0.2 * normal(random)});
    CHECK(spent(D) >= least * (1 - 1e-12));
  }
  VonMises::State<double> state{before};
  Vec3<double> const s = svd(metal.map(F, state).F).s;
  Vec3<double> const flowed{e[0] - std::log(s[0]), e[1] - std::log(s[1]), e[2] - std::log(s[2])};
  CHECK_THAT(spent(flowed), WithinRel(least, 1e-12));
}

TEST_CASE("a pack of points gives what each gives alone", "[hencky]") {
  using Pack = HostPack<double>;
  constexpr int lanes = ScalarTraits<Pack>::lanes;
  std::vector<Sample> const all = samples();
  for (std::size_t first = 0; first < all.size(); ++first) {
    double limit[lanes], gained[lanes], F[9][lanes], dF[9][lanes];
    std::mt19937 random(2);
    for (int i = 0; i < lanes; ++i) {
      Sample const& s = all[(first + i) % all.size()];
      limit[i] = s.p.limit, gained[i] = s.p.gained;
      Mat3<double> const step = test::random_matrix(random, 0.02);
      for (int k = 0; k < 9; ++k) F[k][i] = s.F.a[k], dF[k][i] = step.a[k];
    }
    Mat3<Pack> packed, change;
    for (int k = 0; k < 9; ++k) packed.a[k] = load<Pack>(F[k]), change.a[k] = load<Pack>(dF[k]);
    Parameters const& shared = all[first].p;
    auto const p = Hencky::with(Hencky::cast<Pack>(shared),
                                YieldMemory<Pack>{load<Pack>(limit), load<Pack>(gained)});
    auto const state = Hencky::evaluate(p, packed);
    Mat3<Pack> const P = Hencky::stress(state), dP = Hencky::frame(state).apply(change);
    for (int i = 0; i < lanes; ++i) {
      Mat3<double> own, step;
      for (int k = 0; k < 9; ++k) own.a[k] = F[k][i], step.a[k] = dF[k][i];
      Parameters const q = of(shared, limit[i], gained[i]);
      auto const alone = Hencky::evaluate(q, own);
      Mat3<double> const P_alone = Hencky::stress(alone),
                         dP_alone = Hencky::frame(alone).apply(step);
      CHECK_THAT(lane(Hencky::energy(p, packed), i), WithinAbs(Hencky::energy(q, own), 1e-8));
      CHECK_THAT(lane(Hencky::change(p, state, change), i),
                 WithinAbs(Hencky::change(q, alone, step), 1e-8));
      for (int k = 0; k < 9; ++k) {
        CHECK_THAT(lane(P.a[k], i), WithinAbs(P_alone.a[k], 1e-10 * 2e5));
        CHECK_THAT(lane(dP.a[k], i), WithinAbs(dP_alone.a[k], 1e-8 * 2e5));
      }
    }
  }
}
