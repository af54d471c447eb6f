#include <taut/apps/program/scene_document.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <stdexcept>

// toml++ 3.3 breaks assertions of its own on some malformed input ("[[=", "x = ]"), which in a
// release build is undefined behaviour (github.com/marzer/tomlplusplus, pull request 301). Its
// assertions are therefore kept in every build and throw; so no other source may include it.
namespace taut {
constexpr void require_of_toml(bool holds, char const* condition) {
  if (!holds) throw std::logic_error(condition);
}
}  // namespace taut
#undef NDEBUG
#define TOML_ASSERT(condition) taut::require_of_toml(static_cast<bool>(condition), #condition)
#include <toml++/toml.h>

namespace taut {
namespace {

/// Where a node stands: `source` alone for an override, "file:line" for a file.
std::string place_of(toml::node const& node, std::string const& source, bool lines) {
  return lines ? fmt::format("{}:{}", source, node.source().begin.line) : source;
}

SceneValue convert(toml::node const& node, std::string const& source, bool lines) {
  SceneValue result;
  result.place = place_of(node, source, lines);
  if (auto const* flag = node.as_boolean()) {
    result.value = flag->get();
  } else if (auto const* whole = node.as_integer()) {
    result.value = whole->get();
  } else if (auto const* number = node.as_floating_point()) {
    result.value = number->get();
  } else if (auto const* text = node.as_string()) {
    result.value = text->get();
  } else if (auto const* array = node.as_array()) {
    SceneValue::List list;
    for (toml::node const& item : *array) list.push_back(convert(item, source, lines));
    result.value = std::move(list);
  } else if (auto const* table = node.as_table()) {
    SceneValue::Table members;
    for (auto const& [key, member] : *table)
      members.emplace_back(key.str(), convert(member, source, lines));
    result.value = std::move(members);
    result.is_inline = table->is_inline();
  } else {
    throw Error("{}: a scene has no dates or times of day: write times as numbers of seconds",
                result.place);
  }
  return result;
}

toml::table parse(std::string const& text, std::string const& source) try {
  return toml::parse(text);
} catch (toml::parse_error const& error) {
  throw Error("{}:{}: this is not TOML: {}", source, error.source().begin.line,
              error.description());
} catch (std::logic_error const& broken_assertion) {
  throw Error("{}: this is not TOML: the parser stopped at {}", source, broken_assertion.what());
}

void merge(SceneValue& target, SceneValue const& change);

/// Changes the entry called `key` of an array of tables, or else the key `key` of all its entries.
void merge_entry(SceneValue::List& entries, std::string const& key, SceneValue const& change) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    SceneValue const* name = entries[i].find("name");
    bool const named = name && std::holds_alternative<std::string>(name->value) &&
                       std::get<std::string>(name->value) == key;
    if (named || key == std::to_string(i)) return merge(entries[i], change);
  }
  SceneValue const all{change.place, SceneValue::Table{{key, change}}};
  for (SceneValue& entry : entries) merge(entry, all);
}

void merge(SceneValue& target, SceneValue const& change) {
  auto const* members = change.is_inline ? nullptr : std::get_if<SceneValue::Table>(&change.value);
  auto* table = std::get_if<SceneValue::Table>(&target.value);
  auto* list = std::get_if<SceneValue::List>(&target.value);
  if (members && table) {
    for (auto const& [key, member] : *members) {
      if (SceneValue* old = target.find(key))
        merge(*old, member);
      else
        table->emplace_back(key, member);
    }
  } else if (members && list && !list->empty() &&
             std::holds_alternative<SceneValue::Table>(list->front().value)) {
    for (auto const& [key, member] : *members) merge_entry(*list, key, member);
  } else {
    target = change;
  }
}

SceneValue read_document(std::filesystem::path const& file, int depth) {
  if (depth > 8)
    throw Error("{}: its `base` files form a circle or a chain of more than 8: break it",
                file.string());
  SceneValue document = convert(parse(read_file(file), file.string()), file.string(), true);
  document.place = file.string();
  SceneValue const* base = document.find("base");
  if (base == nullptr) return document;
  SceneValue result = read_document(file.parent_path() / read_text(*base, "base"), depth + 1);
  result.place = file.string();
  merge(result, document);
  auto& members = std::get<SceneValue::Table>(result.value);
  std::erase_if(members, [](auto const& member) { return member.first == "base"; });
  return result;
}

}  // namespace

SceneValue read_document(std::filesystem::path const& file) { return read_document(file, 0); }

void apply_small(SceneValue& document) {
  SceneValue const* small = document.find("small");
  if (small == nullptr) return;
  Section const section(*small, "small");
  SceneValue const change = *small;
  auto& members = std::get<SceneValue::Table>(document.value);
  std::erase_if(members, [](auto const& member) { return member.first == "small"; });
  merge(document, change);
}

void apply_override(SceneValue& document, std::string const& assignment) {
  std::string const place = "--set " + assignment;
  std::size_t const equals = assignment.find('=');
  if (equals == std::string::npos) throw Error("{}: there is no '=': write key.path=value", place);
  std::string const text = assignment.substr(equals + 1);

  SceneValue change{place, text};
  try {
    toml::table const parsed = parse("value = " + text, place);
    if (parsed.size() == 1) change = convert(*parsed.get("value"), place, false);
  } catch (Error const&) {
    // A bare word: it stays the text that it is, and the check of its key judges it.
  }

  std::string path = assignment.substr(0, equals);
  path.erase(path.find_last_not_of(' ') + 1);
  for (bool last = false; !last;) {
    std::size_t const dot = path.rfind('.');
    last = dot == std::string::npos;
    std::string const key = last ? path : path.substr(dot + 1);
    if (key.empty()) throw Error("{}: a part of the key is empty: write key.path=value", place);
    change = SceneValue{place, SceneValue::Table{{key, std::move(change)}}};
    path.resize(last ? 0 : dot);
  }
  merge(document, change);
}

}  // namespace taut
