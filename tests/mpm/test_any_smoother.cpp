// Every smoother that has a name: on the way down and up, in V- and W-cycles, and as the solver of
// the coarsest level.
#include <taut/mpm/any_smoother.hpp>

#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;
using Cycle = Multigrid<Fine, AnySmoother, AnySmoother, LinearEmbedding, double>;

/// (x - x*)'A (x - x*)
double energy_of_error(Dense const& a, Eigen::VectorXd const& x, Eigen::VectorXd const& exact) {
  return (x - exact).dot(a * (x - exact));
}

}  // namespace

TEST_CASE("smoothers leave their residual, and lower the error each time", "[smoother]") {
  Sample<Case<Right, double, 2>> const s(ragged(2), every_fifth(ragged(2).size()));
  Dense const a = dense(s.level.matrix());
  int const n = s.size();
  LevelVectors<double, Right> v;
  v.resize(n);
  for (auto const& [name, params, fixed_metric] : AnySmoother::all()) {
    CAPTURE(name);
    AnySmoother smoother(params);
    smoother.setup(s.level, v);
    v.b = random_field<Right, double>(n, 5);
    Eigen::VectorXd const b = flat(v.b, n), exact = solve_symmetric(a, b);
    assign(v.x, 7.0);  // its old value is of no account
    smoother.first(s.level, v);
    Eigen::VectorXd const x = flat(v.x, n);
    CHECK(difference(v.r, b - a * x) < 1e-12);
    double const start = energy_of_error(a, 0 * exact, exact);
    double const first = energy_of_error(a, x, exact);
    CHECK(first < 0.9 * start);
    smoother.second(s.level, v);
    CHECK(flat(v.b, n) == b);
    CHECK(energy_of_error(a, flat(v.x, n), exact) < 0.9 * first);
  }
}

TEST_CASE("Gauss-Seidel backward is the transpose of forward, and both in turn are symmetric",
          "[smoother]") {
  Sample<Case<Right, double, 2>> const s(ragged(4, 6));
  Dense const a = dense(s.level.matrix()), one = Dense::Identity(a.rows(), a.cols());
  Dense const forward = smoother_of(ForwardBackward(), s.level);
  Dense const backward = smoother_of(ForwardBackward({true, false}), s.level);
  CHECK((forward - backward.transpose()).norm() < 1e-13 * forward.norm());
  CHECK((forward - forward.transpose()).norm() > 1e-2 * forward.norm());
  // One symmetric sweep is forward from nothing and backward on what is left.
  Dense const both = forward + backward * (one - a * forward);
  CHECK((smoother_of(SymmetricGaussSeidel(), s.level) - both).norm() < 1e-13 * both.norm());
}

TEST_CASE("descent smoothers take the steps of their definition", "[smoother]") {
  Sample<Case<Right, double, 2>> const s(ragged(2));
  int const n = s.size();
  Dense inverse = Dense::Zero(3 * n, 3 * n);
  for (int i = 0; i < n; ++i) {
    inverse.block(3 * i, 3 * i, 3, 3) = test::inverse(s.matrix.block(3 * i, 3 * i, 3, 3));
  }
  LevelVectors<double, Right> v;
  v.resize(n);
  Eigen::VectorXd const b = flat(v.b = random_field<Right, double>(n, 5), n);
  for (bool const conjugate : {false, true}) {
    DescentSmoother const smoother({.iterations = 3, .conjugate = conjugate});
    smoother.first(s.level, v);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * n);
    auto const descend = [&] {
      Eigen::VectorXd r = b - s.matrix * x, d = Eigen::VectorXd::Zero(3 * n);
      double before = 1;
      for (int k = 0; k < 3; ++k) {
        Eigen::VectorXd const z = inverse * r;
        double const rho = r.dot(z), beta = k > 0 && conjugate ? rho / before : 0;
        d = z + beta * d;
        double const alpha = rho / d.dot(s.matrix * d);
        x += alpha * d;
        r -= alpha * s.matrix * d;
        before = rho;
      }
    };
    descend();
    CHECK(difference(v.x, x) < 1e-12);
    smoother.second(s.level, v);
    descend();
    CHECK(difference(v.x, x) < 1e-12);
  }
}

TEST_CASE("the power rule finds the largest eigenvalue", "[smoother]") {
  Sample<Case<Right, double, 2>> const s(ragged(2));
  int const n = s.size();
  Dense diagonal = Dense::Zero(3 * n, 3 * n);
  for (int i = 0; i < n; ++i)
    diagonal.block(3 * i, 3 * i, 3, 3) = s.matrix.block(3 * i, 3 * i, 3, 3);
  double const most = eigenpairs(s.matrix, diagonal).values.maxCoeff();
  LevelVectors<double, Right> v;
  v.resize(n);
  double const found = largest_by_power(s.level, v, 512, 1e-8);
  CHECK(found <= most * (1 + 1e-12));
  CHECK(found > 0.999 * most);
  CHECK(largest_by_power(s.level, v, 6, 0) < found);
}

TEST_CASE("cycles of symmetric smoothers are metrics, and the others are not symmetric",
          "[smoother]") {
  auto const places = reached(5, 3);
  std::vector<std::uint8_t> fixed;
  for (Place const& p : places) fixed.push_back(p[0] <= -3);
  Sample<Case<Right, double, 2>> const s(places, fixed);
  Dense const a = dense(s.level.matrix());
  for (auto const& [name, params, fixed_metric] : AnySmoother::all()) {
    for (int const visits : {1, 2}) {
      CAPTURE(name, visits);
      Cycle cycle({.direct_nodes = 10, .visits = visits, .fine = params, .smoother = params});
      cycle.build(s.level);
      REQUIRE(cycle.report().nodes.size() >= 3);
      if (fixed_metric) {
        check_metric(matrix_of(cycle, s.level), a, 1e-12);
      } else {
        // <Mx, y> against <x, My>, which does not ask M to be linear.
        int const n = s.size();
        auto const x = random_field<Right, double>(n, 8), y = random_field<Right, double>(n, 9);
        VectorField<double, Right> const mx("mx", n), my("my", n);
        cycle.apply(x, mx);
        cycle.apply(y, my);
        double const left = flat(mx, n).dot(flat(y, n)), right = flat(x, n).dot(flat(my, n));
        CHECK(std::abs(left - right) > 1e-9 * flat(mx, n).norm() * flat(y, n).norm());
        // But it is a good step all the same.
        Eigen::VectorXd const exact = solve_symmetric(a, flat(x, n));
        CHECK(energy_of_error(a, flat(mx, n), exact) < 0.3 * energy_of_error(a, 0 * exact, exact));
      }
    }
  }
}

TEST_CASE("the coarsest level by any solver comes to what its inverse does", "[smoother]") {
  Sample<Case<Right, double, 2>> const s(reached(5));
  int const n = s.size();
  auto const g = random_field<Right, double>(n, 4);
  VectorField<double, Right> const z("z", n);
  Cycle exact({.max_levels = 2, .direct_nodes = 10000});
  exact.build(s.level);
  REQUIRE(exact.report().direct);
  exact.apply(g, z);
  Eigen::VectorXd const expected = flat(z, n);
  auto const error = [&](Cycle::Params params) {
    params.max_levels = 2;
    params.direct_nodes = 0;
    Cycle cycle(params);
    cycle.build(s.level);
    CHECK_FALSE(cycle.report().direct);
    cycle.apply(g, z);
    return difference(z, expected);
  };
  CHECK(error({.coarse_tolerance = 1e-12, .coarse_by_own = true}) < 1e-11);
  CHECK(error({.coarse_tolerance = 1e-12}) < 1e-11);
  CHECK(error({.coarse_tolerance = 0.5, .coarse_by_own = true}) > 1e-7);
  for (auto const& [name, params, fixed_metric] : AnySmoother::all()) {
    CAPTURE(name);
    double const few = error({.coarse_sweeps = 1, .smoother = params});
    CHECK(error({.coarse_sweeps = 60, .smoother = params}) < 0.1 * few);
  }
}

TEST_CASE("a smoother that does not exist is an error that lists the others", "[smoother]") {
  CHECK_THROWS_AS(AnySmoother::named("best"), Error);
  CHECK(AnySmoother::named("chebyshev").fixed_metric);
}
