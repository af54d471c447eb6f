// A preconditioner that is chosen at run time, so that a program compiles its minimisers once.
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/integrators/holds_hessian.hpp>
#include <taut/integrators/one_of.hpp>
#include <taut/integrators/preconditioner.hpp>
#include <taut/integrators/schwarz.hpp>

#include <string>
#include <string_view>

namespace taut {

/// One of `Ms`.
template <class P, class S, class... Ms>
class OneOfPreconditioners {
public:
  using Vectors = VectorField<typename P::real, S>;
  /// The Params of the one that is meant; of the first by default.
  using Params = std::variant<typename Ms::Params...>;

  /// Default Params of the preconditioner of that name. Throws `Error` if there is none.
  static Params by_name(std::string_view name) {
    Params params;
    bool const found = ((Ms::name == name && (params = typename Ms::Params(), true)) || ...);
    if (found) return params;
    std::string known;
    ((known += (known.empty() ? "" : ", ") + std::string(Ms::name)), ...);
    throw Error("preconditioner \"{}\" does not exist; choose one of {}", name, known);
  }

  OneOfPreconditioners() : OneOfPreconditioners(Params()) {}
  explicit OneOfPreconditioners(Params const& params) : chosen_(make_one_of<Ms...>(params)) {}

  Refresh refresh() const {
    return std::visit([](auto const& m) { return m.refresh(); }, chosen_);
  }
  void resize(int n) {
    std::visit([&](auto& m) { m.resize(n); }, chosen_);
  }
  LocalMatrices<P, S> const& curvature() const {
    return std::visit(
        [](auto const& m) -> auto const& { return m.curvature(); }, chosen_);
  }
  bool pointwise() const {
    return std::visit([](auto const& m) { return m.pointwise(); }, chosen_);
  }
  /// A minimisation begins.
  void start() {
    std::visit(
        [](auto& m) {
          if constexpr (requires { m.start(); }) m.start();
        },
        chosen_);
  }
  /// Whether the last update made a stronger one than the first.
  bool strong() const {
    return std::visit(
        [](auto const& m) {
          if constexpr (requires { m.strong(); }) return m.strong();
          return false;
        },
        chosen_);
  }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    std::visit([&](auto& m) { m.update(e, x); }, chosen_);
  }
  void apply(Vectors const& g, Vectors const& z) const {
    std::visit([&](auto const& m) { m.apply(g, z); }, chosen_);
  }

  bool holds_hessian() const requires(HoldsHessian<Ms, Vectors> || ...) {
    return std::visit(
        []<class M>(M const& m) {
          if constexpr (HoldsHessian<M, Vectors>) return bool(m.holds_hessian());
          return false;
        },
        chosen_);
  }
  void hessian_product(Vectors const& d, Vectors const& hd) const
      requires(HoldsHessian<Ms, Vectors> || ...) {
    std::visit(
        [&]<class M>(M const& m) {
          if constexpr (HoldsHessian<M, Vectors>) m.hessian_product(d, hd);
        },
        chosen_);
  }

private:
  std::variant<Ms...> chosen_;
};

/// Those that need to know nothing but the unknowns; block Jacobi by default.
template <class P = Mixed, class S = DefaultSpace>
class AnyPreconditioner : public OneOfPreconditioners<P, S, BlockJacobi<P, S>, Jacobi<P, S>,
                                                      Identity<P, S>, Schwarz<P, S>> {
public:
  using AnyPreconditioner::OneOfPreconditioners::OneOfPreconditioners;
};

}  // namespace taut
