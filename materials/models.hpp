// All models, and a visit by name: the one place where a name in a scene file becomes a type.
#pragma once

#include <taut/materials/arap.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/materials/fixed_corotated.hpp>
#include <taut/materials/neo_hookean.hpp>
#include <taut/materials/stable_neo_hookean.hpp>

#include <stdexcept>
#include <string>
#include <string_view>

namespace taut {

template <class... Models>
struct ModelList {
  /// Calls `visit.template operator()<Model>()` for each.
  template <class Visit>
  static void for_each(Visit const& visit) {
    (visit.template operator()<Models>(), ...);
  }

  /// Calls the visitor for the model of this name and returns what it returns. Throws
  /// std::invalid_argument.
  template <class Visit>
  static auto with(std::string_view name, Visit const& visit) {
    using Result = std::common_type_t<decltype(visit.template operator()<Models>())...>;
    Result result{};
    bool const found =
        ((Models::name == name ? (result = visit.template operator()<Models>(), true) : false) ||
         ...);
    if (!found) {
      std::string names;
      ((names += (names.empty() ? "" : ", ") + std::string(Models::name)), ...);
      throw std::invalid_argument("material model \"" + std::string(name) +
                                  "\" is unknown: use one of " + names);
    }
    return result;
  }
};

using ElasticModels =
    ModelList<Arap, FixedCorotated, NeoHookean, StableNeoHookean, StableNeoHookean2018>;

}  // namespace taut
