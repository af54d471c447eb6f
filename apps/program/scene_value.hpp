// The values of a scene file on their way from TOML to the typed Scene: every value knows its
// place, and every access checks type and range, so that a mistake is answered with one sentence
// that says where it stands and how to mend it.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace taut {

/// One value of a scene file.
struct SceneValue {
  using List = std::vector<SceneValue>;
  using Table = std::vector<std::pair<std::string, SceneValue>>;

  std::string place;  ///< "drag.toml:12" or "--set time.step=0.01"
  std::variant<bool, std::int64_t, double, std::string, List, Table> value;
  bool is_inline = false;  ///< a table written { ... }: one value, never merged into another

  /// The member of a table; null where it has none or this is no table.
  SceneValue* find(std::string_view key);
  SceneValue const* find(std::string_view key) const;
};

/// The numbers a key accepts; finite in any case.
struct Range {
  double min;
  double max;
  bool open_min = false;  ///< min itself is not accepted
  bool open_max = false;
  std::string_view unit = "";  ///< "" for a pure number

  bool contains(double value) const;
  std::string describe() const;  ///< "above 0 and at most 1 m"
};

/// The candidate with the smallest edit distance to `word`. Requires at least one candidate.
std::string_view nearest(std::string_view word, std::span<std::string_view const> candidates);
/// `before` the candidate nearest to `word`, `after`; nothing where none is near enough for a slip
/// of the hand.
std::string suggestion(std::string_view before, std::string_view word,
                       std::span<std::string_view const> candidates, std::string_view after);

/// Checked value reading; `path` is the key as `--set` would name it. All throw Error.
bool read_flag(SceneValue const& value, std::string_view path);
std::int64_t read_integer(SceneValue const& value, std::string_view path, Range const& range);
double read_number(SceneValue const& value, std::string_view path, Range const& range);
std::string read_choice(SceneValue const& value, std::string_view path,
                        std::span<std::string_view const> choices);
std::string const& read_text(SceneValue const& value, std::string_view path);
SceneValue::List const& read_list(SceneValue const& value, std::string_view path);
Point read_point(SceneValue const& value, std::string_view path, std::string_view unit);
/// [[lowest corner], [highest corner]] in m.
std::array<Point, 2> read_box(SceneValue const& value, std::string_view path);

/// One table of the scene. A getter without fallback requires the key.
class Section {
public:
  /// Keeps a pointer to `table`. Throws Error if it is no table.
  Section(SceneValue const& table, std::string path);

  /// Refuses every key that is not among `keys`, naming the nearest.
  void allow(std::span<std::string_view const> keys) const;
  void allow(std::initializer_list<std::string_view> keys) const {
    allow(std::span(keys.begin(), keys.size()));
  }

  SceneValue const* find(std::string_view key) const { return table_->find(key); }
  SceneValue const& at(std::string_view key) const;
  std::string const& path() const { return path_; }
  std::string path(std::string_view key) const;
  std::string const& place() const { return table_->place; }
  /// "drag.toml:12: pin.top", the beginning of a sentence about this table.
  std::string where() const { return place() + ": " + path_; }

  bool flag(std::string_view key, bool fallback) const;
  int integer(std::string_view key, Range const& range, std::optional<int> fallback = {}) const;
  double number(std::string_view key, Range const& range,
                std::optional<double> fallback = {}) const;
  std::string text(std::string_view key, std::optional<std::string> fallback = {}) const;
  std::string choice(std::string_view key, std::span<std::string_view const> choices,
                     std::optional<std::string> fallback = {}) const;
  Point point(std::string_view key, std::string_view unit,
              std::optional<Point> fallback = {}) const;
  /// A direction of any length but zero, returned as a unit vector.
  Point direction(std::string_view key, std::optional<Point> fallback = {}) const;

  std::optional<Section> section(std::string_view key) const;
  /// The entries of an array of tables, their path the entry's `name` or its index; names are
  /// unique.
  std::vector<Section> list(std::string_view key) const;

private:
  SceneValue const* table_;
  std::string path_;
  std::vector<std::string> names_;  ///< of an entry of an array: those of all entries
};

}  // namespace taut
