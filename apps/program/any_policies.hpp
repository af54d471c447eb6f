// Line search and stopping rule chosen at run time: the program instantiates each minimiser once
// and picks its policies by name.
#pragma once

#include <taut/integrators/line_search.hpp>
#include <taut/integrators/one_of.hpp>
#include <taut/integrators/stopping.hpp>

#include <variant>

namespace taut {

class AnyLineSearch {
public:
  using Params =
      std::variant<SufficientDecrease::Params, NewtonStep::Params, ExactLineSearch::Params>;

  AnyLineSearch() : AnyLineSearch(Params()) {}
  explicit AnyLineSearch(Params const& params)
      : search_(make_one_of<SufficientDecrease, NewtonStep, ExactLineSearch>(params)) {}

  StepBound const& bound() const {
    return std::visit([](auto const& search) -> StepBound const& { return search.bound(); },
                      search_);
  }
  template <class E>
  Step operator()(Line<E>& line, double first) const {
    return std::visit([&](auto const& search) { return search(line, first); }, search_);
  }

private:
  std::variant<SufficientDecrease, NewtonStep, ExactLineSearch> search_;
};

/// One of `Rules`.
template <class... Rules>
class OneOfStoppings {
public:
  using Params = std::variant<typename Rules::Params...>;

  OneOfStoppings() : OneOfStoppings(Params()) {}
  explicit OneOfStoppings(Params const& params) : rule_(make_one_of<Rules...>(params)) {}

  void start(Scale const& scale) {
    std::visit([&](auto& rule) { rule.start(scale); }, rule_);
  }
  Stop check(Progress const& progress) {
    return std::visit([&](auto& rule) { return rule.check(progress); }, rule_);
  }
  void forget() {
    std::visit([](auto& rule) { rule.forget(); }, rule_);
  }
  void join(OneOfStoppings const& part) {
    std::visit([&]<class Rule>(Rule& rule) { join_rule(rule, std::get<Rule>(part.rule_)); }, rule_);
  }
  void resume(Scale const& scale) {
    std::visit([&](auto& rule) { resume_rule(rule, scale); }, rule_);
  }
  double error_estimate() const {
    return std::visit([](auto const& rule) { return rule.error_estimate(); }, rule_);
  }
  double negligible() const {
    return std::visit([](auto const& rule) { return rule.negligible(); }, rule_);
  }

protected:
  std::variant<Rules...> rule_;
};

using AnyStopping = OneOfStoppings<DecrementWindow, EnergyDrop, GradientNorm>;

}  // namespace taut
