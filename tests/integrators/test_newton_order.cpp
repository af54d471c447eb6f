// Newton's method: its order of convergence, and that it ends at round-off.
#include "newton_samples.hpp"

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <utility>
#include <vector>

namespace {

using namespace taut;
using namespace taut::test;

/// Errors after each step, from `e.start()`.
template <class M, class E>
std::vector<double> errors(typename M::Params params, E e, NewtonReport* report = nullptr) {
  auto const minimum = minimum_of(e);
  auto const x = e.start();
  std::vector<double> result{distance(x, minimum)};
  params.stop.tolerance = 1e-12;
  M method(params);
  NewtonReport const made =
      method.minimise(e, x, [&](auto const& step) { result.push_back(distance(step.x, minimum)); });
  if (report) *report = made;
  return result;
}

/// The smallest order log(e2 / e1) / log(e1 / e0) of steps that are close, but not yet at
/// round-off.
double order(std::vector<double> const& errors, double close) {
  double least = toy::infinity;
  for (std::size_t k = 2; k < errors.size(); ++k) {
    if (errors[k - 2] > close || errors[k] < 1e-11) continue;
    least = std::min(least,
                     std::log(errors[k] / errors[k - 1]) / std::log(errors[k - 1] / errors[k - 2]));
  }
  return least;
}

/// The largest e+ / e^1.5 of steps that are close, but not yet at round-off, and how many these
/// are.
std::pair<double, int> superlinear(std::vector<double> const& errors) {
  std::pair<double, int> result{0, 0};
  for (std::size_t k = 1; k < errors.size(); ++k) {
    if (errors[k - 1] > 0.2 || errors[k - 1] < 1e-8) continue;
    result.first = std::max(result.first, errors[k] / std::pow(errors[k - 1], 1.5));
    ++result.second;
  }
  return result;
}

template <class M>
typename M::Params exactly_solved() {
  typename M::Params params;
  params.forcing = {.largest = 1e-13, .fixed = true};
  return params;
}

}  // namespace

TEMPLATE_TEST_CASE("Newton minimises a quadratic in one step", "", Exact, Assembled, MatrixFree) {
  Chain<toy::Anisotropic> chain({.size = 40, .pinned = 2});
  auto const x = chain.start();
  TestType newton(exactly_solved<TestType>());
  int steps = 0;
  auto const report = newton.minimise(chain, x, [&](auto const& step) {
    ++steps;
    CHECK(step.length == 1);
  });
  CHECK(report.converged());
  CHECK(report.iterations == 2);  // one to arrive, one to see it
  CHECK(steps == 2);
  CHECK(report.error_estimate_m < 1e-10);
  typename Chain<toy::Anisotropic>::Field const g("g", chain.size()), zero("zero", chain.size());
  chain.gradient(x, g);
  CHECK(distance(g, zero) < 1e-10);
}

TEMPLATE_TEST_CASE("Newton converges quadratically to round-off", "", Exact, Assembled,
                   MatrixFree) {
  NewtonReport report;
  std::vector<double> const e =
      errors<TestType>(exactly_solved<TestType>(), Chain<toy::Barrier>({.size = 60}), &report);
  CAPTURE(e);
  CHECK(report.converged());
  CHECK(e.back() < 1e-12);
  CHECK(e.size() < 15);
  double const least = order(e, 1e-3);
  CHECK(least > 1.9);
  CHECK(least < 2.5);  // some steps were judged
}

TEST_CASE("a forcing term keeps the order and saves linear iterations") {
  Chain<toy::Barrier> const chain({.size = 60}, {.stiffness = 2000, .strength = 10});
  NewtonReport tight, adaptive, loose;
  errors<Assembled>(exactly_solved<Assembled>(), chain, &tight);
  std::vector<double> const e = errors<Assembled>({}, chain, &adaptive);
  Assembled::Params fixed;
  fixed.forcing = {.largest = 0.1, .fixed = true};
  std::vector<double> const linear = errors<Assembled>(fixed, chain, &loose);
  CAPTURE(e, linear);
  CHECK(linear.back() < 1e-11);
  CHECK(e.back() < 1e-11);
  // e+ < e^1.5 for steps that are close; a fixed tolerance of 0.1 gives e+ = 0.1 e at the end.
  auto const [kept, judged] = superlinear(e);
  CHECK(kept < 1);
  CHECK(judged >= 3);
  CHECK(superlinear(linear).first > 3);
  CHECK(adaptive.linear_iterations < 0.7 * tight.linear_iterations);
  CHECK(adaptive.iterations < loose.iterations);
}
