// The keys of [solver]: names, types, ranges and defaults in one table, which the scene file,
// `--set` and the help of the program all go through.
#pragma once

#include <taut/apps/program/scene_value.hpp>

#include <map>

namespace taut {

using OptionValue = std::variant<bool, int, double, std::string>;

struct SolverKey {
  std::string_view name;
  OptionValue fallback;                   ///< also fixes the type
  Range range;                            ///< of numbers
  std::vector<std::string_view> choices;  ///< of text
  std::string_view help;
};

/// Every key that [solver] knows.
std::span<SolverKey const> solver_keys();

/// A value for every key of [solver].
class SolverOptions {
public:
  SolverOptions();  ///< the defaults
  explicit SolverOptions(Section const& solver);

  bool flag(std::string_view key) const { return get<bool>(key); }
  int integer(std::string_view key) const { return get<int>(key); }
  double number(std::string_view key) const { return get<double>(key); }
  std::string const& text(std::string_view key) const { return get<std::string>(key); }

private:
  template <class T>
  T const& get(std::string_view key) const {
    return std::get<T>(values_.find(key)->second);
  }

  std::map<std::string, OptionValue, std::less<>> values_;
};

}  // namespace taut
