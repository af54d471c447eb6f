// An ordered list of named values, the content of one JSON object, without a JSON library in
// headers.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace taut {

struct Value;
struct Entry;

struct Record {
  /// Appends `name: value`; returns itself so that calls chain.
  Record& set(std::string name, Value value);

  std::vector<Entry> entries;
};

using ValueBase =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>,
                 std::vector<std::int64_t>, std::vector<std::string>, Record, std::vector<Record>>;

/// A number, truth value, text, list of those, or nested records. JSON knows no NaN or infinity:
/// such a number is written as null.
struct Value : ValueBase {
  template <class T>
  Value(T value) : ValueBase(std::move(value)) {}
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) Value(Integer number)
      : ValueBase(static_cast<std::int64_t>(number)) {}
};

struct Entry {
  std::string name;
  Value value;
};

inline Record& Record::set(std::string name, Value value) {
  entries.push_back({std::move(name), std::move(value)});
  return *this;
}

}  // namespace taut
