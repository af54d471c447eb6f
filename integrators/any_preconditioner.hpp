// A preconditioner that is chosen at run time, so that a program compiles its minimisers once.
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/integrators/preconditioner.hpp>
#include <taut/integrators/schwarz.hpp>

#include <string>
#include <string_view>
#include <variant>

namespace taut {

template <class P = Mixed, class S = DefaultSpace>
class AnyPreconditioner {
  template <class... Ms>
  struct Alternatives {
    using Preconditioner = std::variant<Ms...>;
    using Params = std::variant<typename Ms::Params...>;

    static Params by_name(std::string_view name) {
      Params params;
      bool const found = ((Ms::name == name && (params = typename Ms::Params(), true)) || ...);
      if (found) return params;
      std::string known;
      ((known += (known.empty() ? "" : ", ") + std::string(Ms::name)), ...);
      throw Error("preconditioner \"{}\" does not exist; choose one of {}", name, known);
    }
    static Preconditioner make(Params const& params) {
      Preconditioner made;
      ((std::holds_alternative<typename Ms::Params>(params)
            ? void(made = Ms(std::get<typename Ms::Params>(params)))
            : void()),
       ...);
      return made;
    }
  };
  using All = Alternatives<BlockJacobi<P, S>, Jacobi<P, S>, Identity<P, S>, Schwarz<P, S>>;

public:
  using Vectors = VectorField<typename P::real, S>;
  /// The Params of the one that is meant; of block Jacobi by default.
  using Params = typename All::Params;

  /// Default Params of the preconditioner of that name. Throws `Error` if there is none.
  static Params by_name(std::string_view name) { return All::by_name(name); }

  AnyPreconditioner() : AnyPreconditioner(Params()) {}
  explicit AnyPreconditioner(Params const& params) : chosen_(All::make(params)) {}

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
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    std::visit([&](auto& m) { m.update(e, x); }, chosen_);
  }
  void apply(Vectors const& g, Vectors const& z) const {
    std::visit([&](auto const& m) { m.apply(g, z); }, chosen_);
  }

private:
  typename All::Preconditioner chosen_;
};

}  // namespace taut
