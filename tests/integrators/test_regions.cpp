// Nonlinear CG by regions (regions.hpp).
#include "oracle.hpp"

#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace taut;
using Catch::Matchers::WithinRel;

namespace {

/// A chain of which something acts on all unknowns from one on.
template <class Bond>
struct Touched : toy::Chain<Bond> {
  using Base = toy::Chain<Bond>;
  int from = 10;
  using Base::Base;
  void mark_acting(typename Base::Positions const&,
                   Array<int, typename Base::Space> const& marks) const {
    for (int i = 0; i < this->size(); ++i) marks(i) = i >= from ? 1 : 0;
  }
};

using Method = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;

Method method(bool by_regions, int iterations = 2000) {
  return Method({.stop = {.tolerance = 1e-6},
                 .budget = {.max_iterations = iterations},
                 .splitting = {.by_regions = by_regions}});
}

/// Of both regions, (x - from) . g with the gradient at some place.
template <class Chain, class X>
std::vector<double> slopes(Chain const& chain, X const& place, X const& x, X const& from) {
  typename Chain::Field const g("g", chain.size());
  chain.gradient(place, g);
  std::vector<double> sum(2);
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) sum[i >= chain.from] += (x(i, c) - from(i, c)) * g(i, c);
  return sum;
}

}  // namespace

TEST_CASE("a step by regions ends at the minimum over the plane of their directions", "[regions]") {
  Touched<toy::Anisotropic> chain;
  auto const x = chain.start(), from = chain.start();
  method(true, 1).minimise(chain, x);
  std::vector<double> const before = slopes(chain, from, x, from),
                            after = slopes(chain, x, x, from);
  for (int r = 0; r < 2; ++r) {
    CAPTURE(r, before[r]);
    CHECK(before[r] < 0);
    CHECK(std::abs(after[r]) < 1e-12 * std::abs(before[r]));
  }
  // With one length for all it does not.
  auto const plain = chain.start();
  method(false, 1).minimise(chain, plain);
  std::vector<double> const left = slopes(chain, plain, plain, from);
  CHECK(std::abs(left[0] + left[1]) < 1e-12 * std::abs(before[0]));
  CHECK(std::abs(left[0]) > 1e-3 * std::abs(before[0]));
  CHECK(chain.value(x) < chain.value(plain));
}

TEST_CASE("one region is plain nonlinear CG, bit by bit", "[regions]") {
  Touched<toy::Anisotropic> chain;
  chain.from = GENERATE(0, 24);
  auto const x = chain.start(), plain = chain.start();
  auto const report = method(true).minimise(chain, x), other = method(false).minimise(chain, plain);
  CHECK(report.iterations == other.iterations);
  bool same = true;
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) same = same && x(i, c) == plain(i, c);
  CHECK(same);
}

TEMPLATE_TEST_CASE("regions lead to the same minimum", "[regions]", toy::Anisotropic,
                   toy::Barrier) {
  Touched<TestType> chain;
  chain.from = GENERATE(1, 10, 23);
  auto const x = chain.start();
  auto const report = method(true).minimise(chain, x);
  CHECK(report.converged());
  auto const expected = toy::minimum<TestType>(chain, chain.start());
  double off = 0;
  for (int i = 0; i < chain.size(); ++i)
    for (int c = 0; c < 3; ++c) off = std::max(off, std::abs(x(i, c) - expected(i, c)));
  CHECK(off < 2e-6);
  CHECK(report.energy_change < 0);
}

TEST_CASE("a plane in which curvature is not definite is gone along the sum", "[regions]") {
  double const slope[2] = {-1, -3}, descent = 6;
  PlaneStep const definite = step_in_plane({2, 5}, 7 + 2 * 1.5, slope, descent);
  // The way to the minimum is alpha with [2 1.5; 1.5 5] alpha = (1, 3), or in proportion to it.
  double const length = -definite.slope / definite.form;
  double const a = length * definite.alpha[0], b = length * definite.alpha[1];
  CHECK_THAT(2 * a + 1.5 * b, WithinRel(1.0, 1e-14));
  CHECK_THAT(1.5 * a + 5 * b, WithinRel(3.0, 1e-14));
  CHECK_THAT(definite.slope, WithinRel(-descent, 1e-14));
  CHECK_THAT(square(length) * definite.form, WithinRel(2 * a * a + 5 * b * b + 3 * a * b, 1e-14));

  PlaneStep const lost = step_in_plane({2, 5}, 7 + 2 * 4, slope, descent);
  CHECK(lost.alpha[0] == 1);
  CHECK(lost.alpha[1] == 1);
  CHECK(lost.slope == -4);
  CHECK(lost.form == 15);
}
