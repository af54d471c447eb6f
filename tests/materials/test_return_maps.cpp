// Return maps: what a material can bear comes back bitwise, what it cannot lands on the yield
// surface, and mapping twice is mapping once.
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <taut/materials/granular.hpp>
#include <taut/materials/von_mises.hpp>

#include <algorithm>
#include <limits>

#include "matrix_rows.hpp"
#include "samples.hpp"
#include "support/data.hpp"

namespace {

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::matrix_of;
using test::with_stretches;

static_assert(ReturnMap<NeverYields> && ReturnMap<VonMises> && ReturnMap<VonMisesFixedCorotated> &&
              ReturnMap<SnowClamp> && ReturnMap<DruckerPrager>);

template <class T>
Mat3<T> cast(Mat3<double> const& F) {
  Mat3<T> r;
  for (int k = 0; k < 9; ++k) r.a[k] = T(F.a[k]);
  return r;
}
template <class T>
bool same_bits(Mat3<T> const& a, Mat3<T> const& b) {
  return std::equal(a.a, a.a + 9, b.a);
}
template <class T>
double distance(Mat3<T> const& a, Mat3<T> const& b) {
  return double(std::sqrt(contract(a - b, a - b)));
}
template <class T>
Vec3<double> log_strain(Mat3<T> const& F) {
  Vec3<T> const s = svd(F).s;
  return {std::log(double(s[0])), std::log(double(s[1])), std::log(double(s[2]))};
}

/// Gradients of all kinds: small and large strains, compressed, flat and inverted.
std::vector<Mat3<double>> trials() {
  std::mt19937 random(11);
  std::vector<Mat3<double>> all = {identity3<double>(),
                                   Mat3<double>{},
                                   with_stretches(random, 1, 1, 1),
                                   with_stretches(random, 1.3, 1.3, 1.3),
                                   with_stretches(random, 0.8, 0.8, 0.8),
                                   with_stretches(random, 1.1, 0.8, -0.3),
                                   with_stretches(random, 2.0, 1.5, 0.0)};
  std::uniform_real_distribution<double> small(-0.02, 0.02), large(-0.7, 0.7);
  for (int k = 0; k < 30; ++k) {
    all.push_back(with_stretches(random, std::exp(small(random)), std::exp(small(random)),
                                 std::exp(small(random))));
    all.push_back(with_stretches(random, std::exp(large(random)), std::exp(large(random)),
                                 std::exp(large(random))));
  }
  return all;
}

/// What every map promises; returns how many trials yielded.
template <class T, class Map>
int check_map(Map const& map) {
  double const close = 300 * double(std::numeric_limits<T>::epsilon());
  int yields = 0;
  for (Mat3<double> const& trial : trials()) {
    Mat3<T> const F = cast<T>(trial);
    typename Map::template State<T> state;
    Returned<T> const once = map.map(F, state);
    if (!once.yielded) CHECK(same_bits(once.F, F));
    if (!once.yielded) continue;
    ++yields;
    auto const after = map.stiffening(state);
    Returned<T> const twice = map.map(once.F, state);
    CHECK(distance(twice.F, once.F) <= close * (1 + std::sqrt(double(contract(once.F, once.F)))));
    CHECK_THAT(double(map.stiffening(state)), WithinRel(double(after), close));
    Vec3<double> const s = svd(trial).s;
    if (s[1] + s[2] < 1e-6) continue;  // has no rotation of its own
    // Objective: turned before and after, in the reference and in space.
    std::mt19937 random(5);
    Mat3<double> const Q = test::random_rotation(random), R = test::random_rotation(random);
    typename Map::template State<T> other;
    Returned<T> const turned = map.map(cast<T>(Q * trial * R), other);
    CHECK(distance(turned.F, cast<T>(Q) * once.F * cast<T>(R)) < 1e3 * close);
  }
  // What is not a number is no business of a map, and ends nowhere in a loop.
  Mat3<T> nan = identity3<T>();
  nan(1, 2) = std::numeric_limits<T>::quiet_NaN();
  typename Map::template State<T> state;
  CHECK_FALSE(map.map(nan, state).yielded);
  CHECK(map.stiffening(state) == map.stiffening(typename Map::template State<T>()));
  return yields;
}

}  // namespace

TEST_CASE("return maps leave alone what is elastic, and mapping twice is mapping once",
          "[return_map]") {
  CHECK(check_map<double>(NeverYields{}) == 0);
  VonMises const metal{.mu = 26e9, .yield_stress = 4e8, .hardening = 1e8};
  VonMisesFixedCorotated const reference{.mu = 26e9, .yield_stress = 4e8};
  SnowClamp const snow;
  DruckerPrager const sand{.mu = 1e6, .lambda = 2e6};
  CHECK(check_map<double>(metal) > 40);
  CHECK(check_map<double>(reference) > 40);
  CHECK(check_map<double>(snow) > 40);
  CHECK(check_map<double>(sand) > 30);
  CHECK(check_map<float>(metal) > 40);
  CHECK(check_map<float>(reference) > 40);
  CHECK(check_map<float>(snow) > 40);
  CHECK(check_map<float>(sand) > 30);
}

TEST_CASE("von Mises in logarithmic strain ends on the surface and keeps the volume",
          "[return_map]") {
  double const hardening = GENERATE(0.0, 1e8, 1e11);
  VonMises const metal{.mu = 26e9, .yield_stress = 4e8, .hardening = hardening};
  std::mt19937 random(2);
  for (double size : {0.02, 0.2, 0.9}) {
    Mat3<double> const F = with_stretches(random, std::exp(size), 1.02, std::exp(-size / 2));
    VonMises::State<double> state{.strain = 0.3};
    Returned<double> const r = metal.map(F, state);
    if (!r.yielded) {
      CHECK(state.strain == 0.3);
      CHECK(hardening == 1e11);
      continue;
    }
    CHECK(state.strain > 0.3);
    CHECK_THAT(determinant(r.F), WithinRel(determinant(F), 1e-14));
    Vec3<double> const e = log_strain(r.F), before = log_strain(F);
    double const tau = 2 * metal.mu * norm(kernels::deviator(e));
    CHECK_THAT(tau, WithinRel(std::sqrt(2.0 / 3) * (4e8 + hardening * state.strain), 1e-11));
    // Radial: towards the axis of pressure.
    Vec3<double> const a = kernels::deviator(e), b = kernels::deviator(before);
    CHECK_THAT(dot(a, b), WithinRel(norm(a) * norm(b), 1e-12));
    // What of the deviator is gone is the plastic strain.
    CHECK_THAT(norm(b) - norm(a), WithinRel(std::sqrt(1.5) * (state.strain - 0.3), 1e-9));
  }
}

TEST_CASE("a bar that is pulled yields at its yield stress", "[return_map]") {
  // In uniaxial stress, |dev tau| = sqrt(2/3) |tau_1|: with e = (a, -nu a, -nu a), tau_1 = E a.
  double const young = 2e11, poisson = 0.3, yield = 3e8;
  VonMises const metal{.mu = lame_parameters(young, poisson).mu, .yield_stress = yield};
  for (double factor : {0.999, 1.001}) {
    double const a = factor * yield / young;
    Mat3<double> const F = {
        {std::exp(a), 0, 0, 0, std::exp(-poisson * a), 0, 0, 0, std::exp(-poisson * a)}};
    VonMises::State<double> state;
    CHECK(metal.map(F, state).yielded == (factor > 1));
  }
}

TEST_CASE("the maps of the reference give its numbers", "[return_map]") {
  SECTION("von Mises") {
    for (auto const& v : test::hot_vectors("von_mises")) {
      CAPTURE(v["name"].get<std::string>());
      VonMisesFixedCorotated const map{.mu = v["mu"], .yield_stress = v["yield_stress"]};
      VonMisesFixedCorotated::State<double> state;
      Returned<double> const r = map.map(matrix_of(v["F"]), state);
      CHECK(r.yielded == v["yielded"].get<bool>());
      CHECK(distance(r.F, matrix_of(v["F_new"])) < 1e-12);
    }
  }
  SECTION("snow") {
    std::mt19937 random(3);
    for (auto const& v : test::hot_vectors("snow")) {
      SnowClamp const map{.compression = v["theta_c"],
                          .stretch = v["theta_s"],
                          .psi = v["psi"],
                          .least = v["psi"] == 0 ? -2 : 0.6,
                          .most = v["psi"] == 0 ? 5.0 : 20.0};
      SnowClamp::State<double> state;
      auto const s = v["sigma"].get<std::vector<double>>();
      Returned<double> const r = map.map(with_stretches(random, s[0], s[1], s[2]), state);
      Vec3<double> const found = svd(r.F).s;
      for (int c = 0; c < 3; ++c) {
        CHECK_THAT(found[c], WithinAbs(v["sigma_new"][c].get<double>(), 1e-14));
      }
      CHECK_THAT(state.volume, WithinRel(v["Jp_new"].get<double>(), 1e-13));
      CHECK_THAT(map.stiffening(state), WithinRel(v["modulus_factor"].get<double>(), 1e-12));
    }
  }
}

TEST_CASE("snow stays within its bounds and counts the volume", "[return_map]") {
  SnowClamp const snow{.least = 0.9, .most = 1.1};
  for (Mat3<double> const& F : trials()) {
    SnowClamp::State<double> state;
    Returned<double> const r = snow.map(F, state);
    Vec3<double> const s = svd(r.F).s;
    CHECK(s[0] <= 1 + snow.stretch + 1e-14);
    CHECK(s[2] >= 1 - snow.compression - 1e-14);
    double const expected = std::clamp(determinant(F) / determinant(r.F), 0.9, 1.1);
    CHECK_THAT(state.volume, WithinRel(r.yielded ? expected : 1, 1e-12));
  }
}

TEST_CASE("sand slides at its angle of friction, keeps its volume, and bears no tension",
          "[return_map]") {
  DruckerPrager const sand{.mu = 3e5, .lambda = 5e5, .angle = 30};
  // tau on the surface: |dev tau| = -a tr tau, with tr tau = (3 lambda + 2 mu) tr e.
  auto const over = [&](Mat3<double> const& F, double q) {
    Vec3<double> const e = log_strain(F);
    double const trace = e[0] + e[1] + e[2];
    return 2 * sand.mu * norm(kernels::deviator(e)) +
           sand.slope(q) * (3 * sand.lambda + 2 * sand.mu) * trace;
  };
  std::mt19937 random(4);
  SECTION("sliding") {
    Mat3<double> const F = with_stretches(random, 1.3, 0.9, 0.8);
    DruckerPrager::State<double> state;
    Returned<double> const r = sand.map(F, state);
    REQUIRE(r.yielded);
    CHECK(over(F, 0) > 0);
    CHECK(std::abs(over(r.F, 0)) < 1e-9 * sand.mu);
    CHECK_THAT(determinant(r.F), WithinRel(determinant(F), 1e-14));
    CHECK(state.gained == 0);
    Vec3<double> const a = kernels::deviator(log_strain(r.F)), b = kernels::deviator(log_strain(F));
    CHECK_THAT(state.strain, WithinRel(norm(b) - norm(a), 1e-12));
  }
  SECTION("under pressure") {
    Mat3<double> const F = with_stretches(random, 0.9, 0.89, 0.88);
    DruckerPrager::State<double> state;
    CHECK(over(F, 0) < 0);
    CHECK_FALSE(sand.map(F, state).yielded);
    CHECK(state.strain == 0);
  }
  SECTION("expanding, and back") {
    Mat3<double> const F = with_stretches(random, 1.2, 1.1, 0.95);
    DruckerPrager::State<double> state;
    Returned<double> const r = sand.map(F, state);
    CHECK(distance(transpose(r.F) * r.F, identity3<double>()) < 1e-14);
    CHECK_THAT(state.gained, WithinRel(std::log(1.2 * 1.1 * 0.95), 1e-13));
    double const gained = state.gained;
    // Half of it lost again: still no load.
    double const half = std::exp(-gained / 6), whole = std::exp(-gained / 6 - 0.01);
    Returned<double> const again = sand.map(half * r.F, state);
    CHECK(distance(transpose(again.F) * again.F, identity3<double>()) < 1e-14);
    CHECK_THAT(state.gained, WithinRel(gained / 2, 1e-12));
    // All of it and 1 percent more along each axis: that one is borne.
    Returned<double> const loaded = sand.map(whole * again.F, state);
    CHECK(state.gained == 0);
    CHECK_THAT(std::log(determinant(loaded.F)), WithinRel(-0.03, 1e-11));
  }
  SECTION("hardening") {
    DruckerPrager const klar{.mu = 3e5, .lambda = 5e5, .angle = 35, .h1 = 9, .h2 = 0.2, .h3 = 10};
    auto const a = [](double degrees) {
      double const s = std::sin(degrees * std::acos(-1.0) / 180);
      return std::sqrt(2.0 / 3) * 2 * s / (3 - s);
    };
    CHECK_THAT(klar.slope(0.0), WithinRel(a(25), 1e-14));
    CHECK_THAT(klar.slope(1.0), WithinRel(a(35 - std::exp(-0.2)), 1e-14));
    CHECK_THAT(klar.slope(1e3), WithinRel(a(35), 1e-14));
  }
}
