// A smoother of levels with matrices that is chosen at run time, so that one hierarchy serves all
// of them: on its way down and up, on each level, and as the solver of the coarsest.
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/mpm/descent_smoother.hpp>
#include <taut/mpm/smoother.hpp>

#include <array>
#include <string>
#include <string_view>
#include <variant>

namespace taut {

class AnySmoother {
public:
  /// Of the one that is meant; HOT's by default.
  using Params = std::variant<SymmetricGaussSeidel::Params, ForwardBackward::Params,
                              DampedJacobi::Params, Chebyshev::Params, DescentSmoother::Params>;

  struct Named {
    std::string_view name;
    Params params;
    /// The cycle is the same symmetric operator for all right-hand sides.
    bool fixed_metric;
  };
  /// All that have a name.
  static std::array<Named, 11> const& all() {
    static std::array<Named, 11> const list{{
        {"symmetric_gauss_seidel", SymmetricGaussSeidel::Params(), true},
        {"forward_backward", ForwardBackward::Params(), true},
        {"backward_forward", ForwardBackward::Params{true, false}, true},
        {"forward", ForwardBackward::Params{false, false}, false},
        {"backward", ForwardBackward::Params{true, true}, false},
        {"jacobi", DampedJacobi::Params{.damping = 0}, true},
        {"jacobi_tenth", DampedJacobi::Params{.damping = 0.1}, true},  // HOT's
        {"optimal_jacobi", DescentSmoother::Params{.conjugate = false}, false},
        {"chebyshev", Chebyshev::Params(), true},
        {"chebyshev_power", Chebyshev::Params{.safety = 1, .power_steps = 512}, true},
        {"pcg", DescentSmoother::Params(), false},
    }};
    return list;
  }
  /// Throws Error if there is none of that name.
  static Named const& named(std::string_view name) {
    std::string known;
    for (Named const& one : all()) {
      if (one.name == name) return one;
      known += (known.empty() ? "" : ", ") + std::string(one.name);
    }
    throw Error("smoother \"{}\" does not exist; choose one of {}", name, known);
  }

  AnySmoother() : AnySmoother(Params()) {}
  explicit AnySmoother(Params const& params)
      : chosen_(std::visit([](auto const& given) -> Chosen { return of(given); }, params)) {}

  template <class A, class V>
  void setup(A const& a, V& v) {
    std::visit([&](auto& smoother) { smoother.setup(a, v); }, chosen_);
  }
  template <class A, class T, class S>
  void first(A const& a, LevelVectors<T, S> const& v) const {
    std::visit([&](auto const& smoother) { smoother.first(a, v); }, chosen_);
  }
  template <class A, class T, class S>
  void second(A const& a, LevelVectors<T, S> const& v) const {
    std::visit([&](auto const& smoother) { smoother.second(a, v); }, chosen_);
  }

private:
  using Chosen =
      std::variant<SymmetricGaussSeidel, ForwardBackward, DampedJacobi, Chebyshev, DescentSmoother>;
  static SymmetricGaussSeidel of(SymmetricGaussSeidel::Params const& p) {
    return SymmetricGaussSeidel(p);
  }
  static ForwardBackward of(ForwardBackward::Params const& p) { return ForwardBackward(p); }
  static DampedJacobi of(DampedJacobi::Params const& p) { return DampedJacobi(p); }
  static Chebyshev of(Chebyshev::Params const& p) { return Chebyshev(p); }
  static DescentSmoother of(DescentSmoother::Params const& p) { return DescentSmoother(p); }

  Chosen chosen_;
};

}  // namespace taut
