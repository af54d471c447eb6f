#include <taut/apps/program/scene_value.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace taut {
namespace {

// Far beyond any scene, and small enough that sums and squares of coordinates stay finite.
constexpr double largest_coordinate = 1e12;

std::string_view type_name(SceneValue const& value) {
  constexpr std::array<std::string_view, 6> names{"true or false", "a whole number", "a number",
                                                  "text",          "a list",         "a table"};
  return names[value.value.index()];
}

[[noreturn]] void wrong_type(SceneValue const& value, std::string_view path,
                             std::string_view must) {
  throw Error("{}: {} is {}: it must be {}", value.place, path, type_name(value), must);
}

template <class T>
T const& get(SceneValue const& value, std::string_view path, std::string_view must) {
  T const* held = std::get_if<T>(&value.value);
  if (held == nullptr) wrong_type(value, path, must);
  return *held;
}

void require_in_range(SceneValue const& value, std::string_view path, double number,
                      Range const& range) {
  if (range.contains(number)) return;
  throw Error("{}: {} is {}: it must be {}", value.place, path, number, range.describe());
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      std::size_t const substitute = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substitute, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

SceneValue const* SceneValue::find(std::string_view key) const {
  if (Table const* table = std::get_if<Table>(&value))
    for (auto const& [name, member] : *table)
      if (name == key) return &member;
  return nullptr;
}

SceneValue* SceneValue::find(std::string_view key) {
  return const_cast<SceneValue*>(std::as_const(*this).find(key));
}

bool Range::contains(double value) const {
  return std::isfinite(value) && (open_min ? value > min : value >= min) &&
         (open_max ? value < max : value <= max);
}

std::string Range::describe() const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::string text;
  if (min > -infinity) text = fmt::format("{} {}", open_min ? "above" : "at least", min);
  if (max < infinity)
    text +=
        fmt::format("{}{} {}", text.empty() ? "" : " and ", open_max ? "below" : "at most", max);
  if (text.empty()) text = "finite";
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

std::string_view nearest(std::string_view word, std::span<std::string_view const> candidates) {
  return *std::min_element(candidates.begin(), candidates.end(), [&](auto const& a, auto const& b) {
    return edit_distance(word, a) < edit_distance(word, b);
  });
}

std::string suggestion(std::string_view before, std::string_view word,
                       std::span<std::string_view const> candidates, std::string_view after) {
  if (candidates.empty()) return {};
  std::string_view const near = nearest(word, candidates);
  std::size_t const most = std::max<std::size_t>(2, std::min(word.size(), near.size()) / 3);
  // Two edits turn any short word into any other.
  if (edit_distance(word, near) > std::min(most, std::max(word.size(), near.size()) - 1)) return {};
  return fmt::format("{}{}{}", before, near, after);
}

bool read_flag(SceneValue const& value, std::string_view path) {
  return get<bool>(value, path, "true or false");
}

std::int64_t read_integer(SceneValue const& value, std::string_view path, Range const& range) {
  std::int64_t const number = get<std::int64_t>(value, path, "a whole number");
  require_in_range(value, path, static_cast<double>(number), range);
  return number;
}

double read_number(SceneValue const& value, std::string_view path, Range const& range) {
  std::int64_t const* whole = std::get_if<std::int64_t>(&value.value);
  double const number = whole ? static_cast<double>(*whole) : get<double>(value, path, "a number");
  require_in_range(value, path, number, range);
  return number;
}

std::string const& read_text(SceneValue const& value, std::string_view path) {
  return get<std::string>(value, path, "text");
}

std::string read_choice(SceneValue const& value, std::string_view path,
                        std::span<std::string_view const> choices) {
  std::string const& text = read_text(value, path);
  if (std::find(choices.begin(), choices.end(), text) == choices.end())
    throw Error("{}: {} is '{}'{}: choose one of {}", value.place, path, text,
                suggestion(", nearest is '", text, choices, "'"), fmt::join(choices, ", "));
  return text;
}

SceneValue::List const& read_list(SceneValue const& value, std::string_view path) {
  return get<SceneValue::List>(value, path, "a list");
}

Point read_point(SceneValue const& value, std::string_view path, std::string_view unit) {
  auto const& list = get<SceneValue::List>(value, path, "a list of three numbers");
  if (list.size() != 3)
    throw Error("{}: {} is a list of {}: it must be a list of three numbers", value.place, path,
                list.size());
  Point point{};
  for (std::size_t a = 0; a < 3; ++a)
    point[a] = read_number(list[a], fmt::format("{}[{}]", path, a),
                           {.min = -largest_coordinate, .max = largest_coordinate, .unit = unit});
  return point;
}

std::array<Point, 2> read_box(SceneValue const& value, std::string_view path) {
  auto const& list = get<SceneValue::List>(value, path, "a list of two corners");
  if (list.size() != 2)
    throw Error("{}: {} is a list of {}: it must be [lowest corner, highest corner]", value.place,
                path, list.size());
  std::array<Point, 2> const box{read_point(list[0], path, "m"), read_point(list[1], path, "m")};
  for (std::size_t a = 0; a < 3; ++a)
    if (box[0][a] > box[1][a])
      throw Error("{}: {} goes from {} to {} m along {}: give the lowest corner first", value.place,
                  path, box[0][a], box[1][a], "xyz"[a]);
  return box;
}

Section::Section(SceneValue const& table, std::string path)
    : table_(&table), path_(std::move(path)) {
  get<SceneValue::Table>(table, path_, "a table");
}

void Section::allow(std::span<std::string_view const> keys) const {
  for (auto const& [key, member] : std::get<SceneValue::Table>(table_->value)) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    std::string const near = suggestion(", the nearest is '", key, keys, "'");
    // A change of an entry that is not there has been taken for one of a table in each entry.
    bool const may_be_name = !names_.empty() && near.empty() && !member.is_inline &&
                             std::holds_alternative<SceneValue::Table>(member.value);
    if (may_be_name)
      throw Error("{}: no {} is called '{}', and none has a table of that name: there {} {}",
                  member.place, path_.substr(0, path_.find('.')), key,
                  names_.size() == 1 ? "is" : "are", fmt::join(names_, ", "));
    throw Error("{}: unknown key '{}'{}: {} knows {}", member.place, path(key), near,
                path_.empty() ? "a scene" : path_, fmt::join(keys, ", "));
  }
}

std::string Section::path(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

SceneValue const& Section::at(std::string_view key) const {
  if (SceneValue const* value = find(key)) return *value;
  throw Error("{}: {} lacks the key '{}': add it", place(), path_.empty() ? "the scene" : path_,
              key);
}

bool Section::flag(std::string_view key, bool fallback) const {
  SceneValue const* value = find(key);
  return value ? read_flag(*value, path(key)) : fallback;
}

int Section::integer(std::string_view key, Range const& range, std::optional<int> fallback) const {
  if (fallback && !find(key)) return *fallback;
  Range narrow = range;
  narrow.max = std::min(range.max, double{std::numeric_limits<int>::max()});
  return static_cast<int>(read_integer(at(key), path(key), narrow));
}

double Section::number(std::string_view key, Range const& range,
                       std::optional<double> fallback) const {
  if (fallback && !find(key)) return *fallback;
  return read_number(at(key), path(key), range);
}

std::string Section::text(std::string_view key, std::optional<std::string> fallback) const {
  if (fallback && !find(key)) return *fallback;
  return read_text(at(key), path(key));
}

std::string Section::choice(std::string_view key, std::span<std::string_view const> choices,
                            std::optional<std::string> fallback) const {
  if (fallback && !find(key)) return *fallback;
  return read_choice(at(key), path(key), choices);
}

Point Section::point(std::string_view key, std::string_view unit,
                     std::optional<Point> fallback) const {
  if (fallback && !find(key)) return *fallback;
  return read_point(at(key), path(key), unit);
}

Point Section::direction(std::string_view key, std::optional<Point> fallback) const {
  Point vector = point(key, "", fallback);
  double const length = std::hypot(vector[0], vector[1], vector[2]);
  if (!(length > 1e-12))
    throw Error("{}: {} has length {}: give a direction", at(key).place, path(key), length);
  for (double& c : vector) c /= length;
  return vector;
}

std::optional<Section> Section::section(std::string_view key) const {
  SceneValue const* value = find(key);
  if (value == nullptr) return {};
  return Section(*value, path(key));
}

std::vector<Section> Section::list(std::string_view key) const {
  std::vector<Section> sections;
  std::vector<std::string> names;
  SceneValue const* value = find(key);
  if (value == nullptr) return sections;
  // A file would have a list here, which the change would have been merged into.
  if (value->place.starts_with("--set ") && std::holds_alternative<SceneValue::Table>(value->value))
    throw Error("{}: the scene has no {} to change: add a [[{}]] to its file", value->place,
                path(key), path(key));
  for (SceneValue const& entry : read_list(*value, path(key))) {
    SceneValue const* name = entry.find("name");
    std::string const label =
        name ? read_text(*name, path(key) + ".name") : std::to_string(sections.size());
    for (Section const& other : sections)
      if (other.path() == path(key) + "." + label)
        throw Error("{}: the name '{}' is taken by {}: give every {} a name of its own",
                    entry.place, label, other.where(), key);
    sections.emplace_back(entry, path(key) + "." + label);
    names.push_back(label);
  }
  for (Section& section : sections) section.names_ = names;
  return sections;
}

}  // namespace taut
