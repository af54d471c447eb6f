// Policies that are chosen at run time: a variant of them, made from a variant of their Params.
#pragma once

#include <utility>
#include <variant>

namespace taut {

/// The one of `Ts` whose Params are given.
template <class... Ts>
std::variant<Ts...> make_one_of(std::variant<typename Ts::Params...> const& params) {
  using Made = std::variant<Ts...>;
  using Given = std::variant<typename Ts::Params...>;
  constexpr Made (*make[])(Given const&) = {+[](Given const& given) {
    return Made(std::in_place_type<Ts>, std::get<typename Ts::Params>(given));
  }...};
  return make[params.index()](params);
}

}  // namespace taut
