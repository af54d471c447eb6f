// Pointwise preconditioners, when they are rebuilt, and that one which is not pointwise does the
// same.
#include "oracle.hpp"

#include <taut/integrators/any_preconditioner.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Block Jacobi as a stranger would write it: applied from outside, counting.
template <class P = Fp64, class S = DefaultSpace>
class OwnBlockJacobi {
public:
  struct Params {
    Refresh refresh = {};
  };
  explicit OwnBlockJacobi(Params const& params)
      : inner_(typename BlockJacobi<P, S>::Params{.refresh = params.refresh}) {}
  Refresh refresh() const { return inner_.refresh(); }
  void resize(int n) { inner_.resize(n); }
  LocalMatrices<P, S> const& curvature() const { return inner_.curvature(); }
  bool pointwise() const { return false; }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    inner_.update(e, x);
  }
  void apply(VectorField<typename P::real, S> const& g,
             VectorField<typename P::real, S> const& z) const {
    inner_.apply(g, z);
  }

private:
  BlockJacobi<P, S> inner_;
};

template <template <class...> class Preconditioner>
using NcgWith = Ncg<DaiKou, Preconditioner, SufficientDecrease, DecrementWindow, Fp64>;

/// V diag(lambda) V' for a random rotation V.
template <class T>
Sym3<T> random_block(Vec3<double> const& lambda, std::mt19937& random) {
  std::normal_distribution<double> normal;
  double q[4], norm2 = 0;
  for (double& c : q) norm2 += square(c = normal(random));
  for (double& c : q) c /= std::sqrt(norm2);
  Vec3<double> const u{q[1], q[2], q[3]};
  Mat3<double> cross{{0, u[2], -u[1], -u[2], 0, u[0], u[1], -u[0], 0}};
  Mat3<double> const v = identity3<double>() + 2 * q[0] * cross + 2.0 * (cross * cross);
  Mat3<double> a{};
  for (int k = 0; k < 3; ++k) a = a + lambda[k] * outer(v.column(k), v.column(k));
  return {{T(a(0, 0)), T(a(1, 1)), T(a(2, 2)), T(a(0, 1)), T(a(1, 2)), T(a(0, 2))}};
}

}  // namespace

TEMPLATE_TEST_CASE("inverses of blocks are floored", "", float, double) {
  using T = TestType;
  double const epsilon = std::numeric_limits<T>::epsilon(), floor = 1e-4;
  std::mt19937 random(7);
  for (int sample = 0; sample < 20000; ++sample) {
    CAPTURE(sample);
    // Eigenvalues over nine decades, zeros and slightly negative ones among them, in any unit.
    double const unit = std::pow(10.0, std::uniform_real_distribution<>(-12, 9)(random));
    Vec3<double> lambda{unit, 0, 0};
    for (int k = 1; k < 3; ++k) {
      double const decades = std::uniform_real_distribution<>(-10, 0)(random);
      lambda[k] = decades < -9 ? -epsilon * unit : decades < -8 ? 0 : unit * std::pow(10, decades);
    }
    auto const inverse = floored_inverse(random_block<T>(lambda, random), floor, 0.0);
    Sym3<double> scaled;
    for (int k = 0; k < 6; ++k) scaled.s[k] = unit * double(inverse.s[k]);
    auto const eigen = symmetric_eigen(scaled);
    // The block itself is known to epsilon times its largest eigenvalue, and so is its inverse,
    // whose largest one is 1 / floor. Cramer's rule loses some more digits,
    // none of which a preconditioner misses.
    for (int k = 0; k < 3; ++k) {
      Vec3<double> sorted = lambda;
      std::sort(sorted.v, sorted.v + 3);
      double const expected = std::max(sorted[k] / unit, floor);
      CHECK_THAT(1 / eigen.values[k],
                 WithinAbs(expected, 20 * epsilon + 1e-9 * expected +
                                         4 * epsilon / floor * expected * expected));
    }
  }
  Sym3<T> const zero{};
  CHECK(floored_inverse(zero, 1e-4, 0.5).s[1] == 2);
  CHECK(floored_inverse(zero, 1e-4, 0.0).s[2] == 1);
}

TEST_CASE("inverses of blocks next to nothing are numbers") {
  std::mt19937 random(5);
  for (float unit : {1e-30f, 1e-36f, 1e-39f, 1e-44f}) {
    CAPTURE(unit);
    auto const inverse =
        floored_inverse(random_block<float>({unit, 1e-3 * unit, 0}, random), 1e-6, 0.0);
    for (float number : inverse.s) CHECK(std::isfinite(number));
    CHECK(inverse.s[0] + inverse.s[1] + inverse.s[2] > 1e28f);
  }
}

TEST_CASE("vanishing curvature is floored when there is no inertia") {
  toy::Chain<toy::Quartic> chain({.size = 4, .has_inertia = false});
  toy::Chain<toy::Quartic>::Positions const x("x", 4);
  for (int i = 0; i < 4; ++i)
    x(i, 0) = i == 0 ? 0 : 2 + 0.01 * i;  // one long bond, others collapsed
  toy::Chain<toy::Quartic>::Field const g("g", 4), z("z", 4);

  Jacobi<Fp64> jacobi({.floor = 1e-3});
  jacobi.resize(4);
  chain.gradient(x, g, jacobi.curvature().diagonal);
  double const largest = jacobi.curvature().diagonal(0, 0);
  REQUIRE(jacobi.curvature().diagonal(3, 0) == 0);
  jacobi.update(chain, x);
  jacobi.apply(g, z);
  CHECK_THAT(z(3, 0), WithinRel(g(3, 0) / (1e-3 * largest), 1e-13));

  BlockJacobi<Fp64> block({.floor = 1e-3});
  block.resize(4);
  chain.gradient(x, g, block.curvature().blocks);
  block.update(chain, x);
  block.apply(g, z);
  CHECK_THAT(z(3, 0), WithinRel(g(3, 0) / (1e-3 * largest), 1e-13));
}

TEST_CASE("a preconditioner that is applied from outside gives the same iterates") {
  for (Refresh const refresh : {Refresh(), Refresh::lagged(4), Refresh::rarely()}) {
    CAPTURE(refresh.interval);
    toy::Chain<toy::Barrier> chain;
    auto const x = chain.start(), y = chain.start();
    auto const inside =
        NcgWith<BlockJacobi>({.preconditioner = {.refresh = refresh}}).minimise(chain, x);
    auto const outside =
        NcgWith<OwnBlockJacobi>({.preconditioner = {.refresh = refresh}}).minimise(chain, y);
    CHECK(inside.converged());
    CHECK(inside.iterations == outside.iterations);
    CHECK(inside.refreshes == outside.refreshes);
    for (int i = 0; i < chain.size(); ++i)
      for (int c = 0; c < 3; ++c) CHECK_THAT(x(i, c), WithinAbs(y(i, c), 1e-9));
  }
}

TEST_CASE("preconditioners are rebuilt when they are due, without a restart") {
  auto const run = [](Refresh const& refresh) {
    toy::Chain<toy::Quartic> chain;
    return NcgWith<BlockJacobi>(
               {.preconditioner = {.refresh = refresh}, .budget = {.max_iterations = 40}})
        .minimise(chain, chain.start());
  };
  CHECK(run({}).refreshes == 40);
  CHECK(run(Refresh::lagged(8)).refreshes == 5);
  CHECK(run(Refresh::lagged(1000)).refreshes == 1);
  // Much too eager a trigger: any step that is shorter than an earlier one.
  Refresh eager = Refresh::lagged(1000);
  eager.trigger = 1;
  CHECK(run(eager).refreshes > 5);
  CHECK(run(eager).refreshes < 40);
}

TEST_CASE("preconditioners can be chosen by name") {
  using Any = AnyPreconditioner<Fp64>;
  Any jacobi(Any::by_name("jacobi"));
  jacobi.resize(3);
  CHECK(jacobi.pointwise());
  CHECK(jacobi.curvature().diagonal.extent(0) == 3);
  Any const schwarz(Any::by_name("schwarz"));
  CHECK_FALSE(schwarz.pointwise());
  CHECK(schwarz.refresh().interval == Refresh::rarely().interval);
  CHECK_THROWS_WITH(Any::by_name("ilu"),
                    ContainsSubstring("\"ilu\"") && ContainsSubstring("block_jacobi, jacobi"));
}
