// The keys of [solver] and [contact]: names, types, ranges and defaults in one table each, which
// the scene file, `--set` and the help of the program all go through.
#pragma once

#include <taut/apps/program/scene_value.hpp>

#include <map>

namespace taut {

using OptionValue = std::variant<bool, int, double, std::string>;

struct OptionKey {
  std::string_view name;
  OptionValue fallback;                   ///< also fixes the type
  Range range;                            ///< of numbers
  std::vector<std::string_view> choices;  ///< of text
  std::string_view help;
};

/// Every key that [solver] knows.
std::span<OptionKey const> solver_keys();
/// Every key that [contact] knows.
std::span<OptionKey const> contact_keys();

/// A value for every key of a table.
class Options {
public:
  explicit Options(std::span<OptionKey const> keys);  ///< the defaults
  Options(std::span<OptionKey const> keys, Section const& section);

  bool flag(std::string_view key) const { return get<bool>(key); }
  int integer(std::string_view key) const { return get<int>(key); }
  double number(std::string_view key) const { return get<double>(key); }
  std::string const& text(std::string_view key) const { return get<std::string>(key); }
  /// For a key of text that exists.
  void set(std::string_view key, std::string const& text) { values_.find(key)->second = text; }

private:
  template <class T>
  T const& get(std::string_view key) const {
    return std::get<T>(values_.find(key)->second);
  }

  std::map<std::string, OptionValue, std::less<>> values_;
};

struct SolverOptions : Options {
  SolverOptions() : Options(solver_keys()) {}
  explicit SolverOptions(Section const& section) : Options(solver_keys(), section) {}
};

struct ContactOptions : Options {
  ContactOptions() : Options(contact_keys()) {}
  /// Throws Error also for values that do not go together.
  explicit ContactOptions(Section const& section);
};

}  // namespace taut
