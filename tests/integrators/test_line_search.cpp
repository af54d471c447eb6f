// Line searches on a line: length, energy, gradient and place after each of them.
#include "toy_objectives.hpp"

#include <taut/integrators/line_search.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <cmath>
#include <limits>

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// The line from the start of a chain along -g (times a factor), in fp64.
template <class Bond>
struct Setting {
  using Chain = toy::Chain<Bond>;
  Chain chain;
  typename Chain::Positions x;
  DescentFields<Fp64, DefaultSpace> fields;
  double slope = 0;

  explicit Setting(double length = 1, toy::ChainParams const& params = {})
      : chain(params), x(chain.start()) {
    fields.resize(chain.size());
    chain.gradient(x, fields.gradient);
    for (int i = 0; i < chain.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        fields.direction(i, c) = -length * fields.gradient(i, c);
        slope += fields.gradient(i, c) * fields.direction(i, c);
      }
  }
  Line<Chain> line() { return {chain, x, fields, {}, slope, 0, 0}; }

  /// Whether x is where a step of this length leads.
  bool arrived(double alpha) const {
    auto const from = chain.start();
    bool same = true;
    for (int i = 0; i < chain.size(); ++i)
      for (int c = 0; c < 3; ++c)
        same = same && x(i, c) == from(i, c) + alpha * fields.direction(i, c);
    return same;
  }
  double energy_change() const { return chain.value(x) - chain.value(chain.start()); }
  /// g'p at x, over g'p at the beginning.
  double slope_ratio() {
    chain.gradient(x, fields.gradient_before);
    double sum = 0;
    for (int i = 0; i < chain.size(); ++i)
      for (int c = 0; c < 3; ++c) sum += fields.gradient_before(i, c) * fields.direction(i, c);
    return sum / slope;
  }
};

}  // namespace

TEST_CASE("the Newton step minimises a quadratic along the line") {
  Setting<toy::Anisotropic> s;
  auto line = s.line();
  Step const step = NewtonStep()(line, 0);
  CHECK(s.arrived(step.length));
  CHECK(step.length == -s.slope / s.chain.quadratic_form(s.chain.start(), s.fields.direction));
  CHECK_FALSE(step.evaluated);
  CHECK_FALSE(step.cut);
  CHECK_THAT(step.energy_change, WithinRel(s.energy_change(), 1e-9));
  CHECK_THAT(s.slope_ratio(), WithinAbs(0, 1e-9));
}

TEST_CASE("a given first length is tried first") {
  Setting<toy::Anisotropic> s;
  auto line = s.line();
  double const length = 0.25 * line.newton_length();
  CHECK(NewtonStep()(line, length).length == length);
  auto again = s.line();
  CHECK(SufficientDecrease()(again, length).length == length);
}

TEST_CASE("the displacement clamp of the paper") {
  Setting<toy::Anisotropic> s;
  auto line = s.line();
  double const largest = line.largest_norm();
  NewtonStep const search({.bound = {.max_displacement = 1e-3}});
  Step const step = search(line, 0);
  CHECK(step.cut);
  CHECK_THAT(step.length, WithinRel(1e-3 / largest, 1e-15));
  CHECK(step.aimed > step.length);
  // With the clamped length, as the paper does.
  double const form = s.chain.quadratic_form(s.x, s.fields.direction);
  CHECK_THAT(step.energy_change,
             WithinRel(step.length * s.slope + 0.5 * step.length * step.length * form, 1e-14));
}

TEST_CASE("no step goes further than the asked fraction of what the terms allow") {
  Setting<toy::Barrier> s;
  auto line = s.line();
  double const valid = s.chain.max_step(s.x, s.fields.direction, toy::infinity);
  REQUIRE(10 * valid < 1e3);
  Step const step = SufficientDecrease({.bound = {.fraction = 0.3}})(line, 10 * valid);
  CHECK(step.cut);
  CHECK(step.length <= 0.3 * valid);
  CHECK(step.aimed == 10 * valid);
  CHECK(step.found);
  CHECK(step.energy_change < 0);
}

namespace {

/// A chain that certifies, with p'Hp, `part` of its largest step, and counts who asks for more.
struct CertifyingChain : toy::Chain<toy::Barrier> {
  using Chain = toy::Chain<toy::Barrier>;
  using Chain::max_step;
  using Chain::quadratic_form;
  double part = 0;
  mutable int searches = 0;

  double quadratic_form(Positions const& x, Field const& p, double& certified) const {
    Field const back("back", size());
    for (int i = 0; i < size(); ++i)
      for (int c = 0; c < 3; ++c) back(i, c) = -p(i, c);
    certified = part * std::min(Chain::longest_step(x, p), Chain::longest_step(x, back));
    return Chain::quadratic_form(x, p);
  }
  double max_step(Positions const& x, Field const& p, double at_most, double certified) const {
    if (2 * at_most <= certified) return at_most;
    ++searches;
    return Chain::max_step(x, p, at_most);
  }
};

}  // namespace

TEST_CASE("a step within what p'Hp has certified is not looked for again, a longer one is") {
  static_assert(CertifyingObjective<CertifyingChain>);
  static_assert(!CertifyingObjective<toy::Chain<toy::Barrier>>);
  for (double factor : {1.0, -1.0}) {
    Setting<toy::Barrier> s(factor);
    CertifyingChain chain;
    auto const search = [&](double part) {
      chain.part = part;
      chain.searches = 0;
      auto const x = chain.start();
      Line<CertifyingChain> line(chain, x, s.fields, {}, s.slope, 0, 0);
      return NewtonStep()(line, 0);
    };
    auto plain = s.line();
    Step const expected = NewtonStep()(plain, 0);
    REQUIRE(expected.length * factor > 0);
    for (double part : {0.0, 1e-6, 1.0}) {
      Step const step = search(part);
      CHECK(step.length == expected.length);
      CHECK(step.cut == expected.cut);
      CHECK(step.bound == expected.bound);
      CHECK(chain.searches == 1);  // the bound cuts this step
    }
    // A short step needs no search, unless nothing is certified.
    auto const short_step = [&](double part, bool form_first) {
      chain.part = part;
      chain.searches = 0;
      auto const x = chain.start();
      Line<CertifyingChain> line(chain, x, s.fields, {}, s.slope, 0, 0);
      if (form_first) line.curvature();
      double const length = 1e-3 * std::abs(expected.length);
      CHECK(line.max_length(length, factor < 0) == length);
      return chain.searches;
    };
    CHECK(short_step(1.0, true) == 0);
    CHECK(short_step(0.0, true) == 1);
    CHECK(short_step(1.0, false) == 1);  // p'Hp was not asked for: nothing is known
  }
}

TEST_CASE("an uphill direction is followed backwards, within the same bounds") {
  Setting<toy::Barrier> s(-1);
  Setting<toy::Barrier> const downhill(1);  // whose fields live as long as it does
  auto const& backwards = downhill.fields.direction;
  double const valid = s.chain.max_step(s.x, backwards, toy::infinity);
  SECTION("newton") {
    auto line = s.line();
    REQUIRE(line.newton_length() < -valid);
    Step const step = NewtonStep()(line, 0);
    CHECK(step.cut);
    CHECK(step.length < 0);
    CHECK(-step.length <= valid);
    CHECK(std::isfinite(s.chain.value(s.x)));
    CHECK(s.arrived(step.length));
  }
  SECTION("sufficient decrease") {
    auto line = s.line();
    Step const step = SufficientDecrease()(line, 0);
    CHECK(step.found);
    CHECK(-step.length <= valid);
    CHECK(step.energy_change < 0);
  }
  SECTION("exact") {
    auto line = s.line();
    Step const step = ExactLineSearch({.bound = {.fraction = 0.999}})(line, 0);
    CHECK(step.found);
    CHECK(step.length < 0);
    CHECK(-step.length < valid);
    CHECK((step.cut || std::abs(s.slope_ratio()) < 1e-9));
  }
  // The direction itself is what it was.
  CHECK(s.fields.direction(5, 1) == -backwards(5, 1));
}

TEST_CASE("sufficient decrease shortens a step that is too long") {
  Setting<toy::Quartic> s;
  auto line = s.line();
  double const length = 20 * line.newton_length();
  SufficientDecrease::Params const params;
  Step const step = SufficientDecrease(params)(line, length);
  REQUIRE(step.found);
  CHECK(step.backtracks > 0);
  CHECK(step.evaluated);
  CHECK(s.arrived(step.length));
  CHECK_THAT(step.energy_change, WithinRel(s.energy_change(), 1e-9));
  CHECK(step.energy_change <= params.armijo * step.length * s.slope);
  // The gradient of the new place has been left in gradient_before.
  typename toy::Chain<toy::Quartic>::Field const g("g", s.chain.size());
  s.chain.gradient(s.x, g);
  CHECK(g(5, 1) == s.fields.gradient_before(5, 1));
}

TEST_CASE("sufficient decrease gives up where nothing decreases, and leaves x alone") {
  Setting<toy::Quartic> s(-1);  // uphill
  s.slope = -s.slope;           // by a gradient that is wrong
  auto line = s.line();
  Step const step = SufficientDecrease()(line, 1e-3);
  CHECK_FALSE(step.found);
  CHECK(step.backtracks == SufficientDecrease::Params().max_backtracks);
  CHECK(s.arrived(0));
}

TEST_CASE("without inertia a step without curvature has a reach") {
  Setting<toy::Quartic> s(1, {.has_inertia = false});
  // Neighbours that coincide: no curvature is left after filtering.
  for (int i = 0; i < s.chain.size(); ++i)
    for (int c = 0; c < 3; ++c) s.x(i, c) = 1e-3 * i;
  auto line = s.line();
  CHECK(line.newton_length() == std::numeric_limits<double>::infinity());
  Step const step = NewtonStep({.bound = {.reach = 2}})(line, 0);
  CHECK_THAT(step.length * line.largest_norm(), WithinRel(2 * s.chain.scale().length, 1e-14));
}

TEST_CASE("the exact line search finds the minimum along the line") {
  SECTION("close to the first length") {
    Setting<toy::Quartic> s;
    auto line = s.line();
    Step const step = ExactLineSearch()(line, 0);
    CHECK(step.found);
    CHECK_THAT(s.slope_ratio(), WithinAbs(0, 1e-9));
    CHECK(s.energy_change() < 0);
  }
  SECTION("far beyond it") {
    Setting<toy::Anisotropic> s;
    auto line = s.line();
    double const minimum = line.newton_length();
    CHECK_THAT(ExactLineSearch()(line, 1e-3 * minimum).length, WithinRel(minimum, 1e-9));
  }
  SECTION("far before it") {
    Setting<toy::Anisotropic> s;
    auto line = s.line();
    double const minimum = line.newton_length();
    CHECK_THAT(ExactLineSearch()(line, 1e3 * minimum).length, WithinRel(minimum, 1e-9));
  }
  SECTION("up to where a barrier forbids more") {
    Setting<toy::Barrier> s;
    auto line = s.line();
    Step const step = ExactLineSearch({.bound = {.fraction = 0.999}})(line, 0);
    CHECK(step.found);
    CHECK(step.length < s.chain.max_step(s.chain.start(), s.fields.direction, toy::infinity));
    CHECK((step.cut || std::abs(s.slope_ratio()) < 1e-9));
  }
}
