// Line search and stopping rule chosen at run time: the program instantiates each minimiser once
// and picks its policies by name.
#pragma once

#include <taut/integrators/line_search.hpp>
#include <taut/integrators/stopping.hpp>

#include <variant>

namespace taut {

class AnyLineSearch {
public:
  using Params =
      std::variant<SufficientDecrease::Params, NewtonStep::Params, ExactLineSearch::Params>;

  AnyLineSearch() = default;
  explicit AnyLineSearch(Params const& params) {
    if (auto const* newton = std::get_if<NewtonStep::Params>(&params)) {
      search_ = NewtonStep(*newton);
    } else if (auto const* exact = std::get_if<ExactLineSearch::Params>(&params)) {
      search_ = ExactLineSearch(*exact);
    } else {
      search_ = SufficientDecrease(std::get<SufficientDecrease::Params>(params));
    }
  }

  template <class E>
  Step operator()(Line<E>& line, double first) const {
    return std::visit([&](auto const& search) { return search(line, first); }, search_);
  }

private:
  std::variant<SufficientDecrease, NewtonStep, ExactLineSearch> search_;
};

class AnyStopping {
public:
  using Params = std::variant<DecrementWindow::Params, EnergyDrop::Params, GradientNorm::Params>;

  AnyStopping() = default;
  explicit AnyStopping(Params const& params) {
    if (auto const* drop = std::get_if<EnergyDrop::Params>(&params)) {
      rule_ = EnergyDrop(*drop);
    } else if (auto const* norm = std::get_if<GradientNorm::Params>(&params)) {
      rule_ = GradientNorm(*norm);
    } else {
      rule_ = DecrementWindow(std::get<DecrementWindow::Params>(params));
    }
  }

  void start(Scale const& scale) {
    std::visit([&](auto& rule) { rule.start(scale); }, rule_);
  }
  Stop check(Progress const& progress) {
    return std::visit([&](auto& rule) { return rule.check(progress); }, rule_);
  }
  void forget() {
    std::visit([](auto& rule) { rule.forget(); }, rule_);
  }
  double error_estimate() const {
    return std::visit([](auto const& rule) { return rule.error_estimate(); }, rule_);
  }
  double negligible() const {
    return std::visit([](auto const& rule) { return rule.negligible(); }, rule_);
  }

private:
  std::variant<DecrementWindow, EnergyDrop, GradientNorm> rule_;
};

}  // namespace taut
