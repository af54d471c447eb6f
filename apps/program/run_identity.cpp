#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/scene_document.hpp>
#include <taut/core/io/hash.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

namespace taut {
namespace {

struct Write {
  std::string& text;

  void operator()(bool flag) const { text += flag ? "true" : "false"; }
  void operator()(std::int64_t number) const { text += fmt::format("{}", number); }
  void operator()(double number) const { text += fmt::format("{}", number); }
  void operator()(std::string const& word) const { text += fmt::format("\"{}\"", word); }
  void operator()(SceneValue::List const& list) const {
    text += '[';
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (k > 0) text += ", ";
      std::visit(*this, list[k].value);
    }
    text += ']';
  }
  /// Without members: all others are taken apart.
  void operator()(SceneValue::Table const&) const { text += "{ }"; }
};

std::string text_of(SceneValue const& value) {
  std::string text;
  std::visit(Write{text}, value.value);
  return text;
}

/// Takes tables apart, and lists of them, by their names or places.
void add_entries(SceneValue const& value, std::string const& path, RunIdentity& to) {
  auto const* table = std::get_if<SceneValue::Table>(&value.value);
  auto const* list = std::get_if<SceneValue::List>(&value.value);
  bool const tables =
      list && !list->empty() && std::holds_alternative<SceneValue::Table>(list->front().value);
  if (table && !table->empty()) {
    for (auto const& [key, member] : *table) {
      add_entries(member, path.empty() ? key : path + '.' + key, to);
    }
  } else if (tables) {
    std::string& order = to[path];
    for (std::size_t k = 0; k < list->size(); ++k) {
      SceneValue const* const name = (*list)[k].find("name");
      auto const* const word = name ? std::get_if<std::string>(&name->value) : nullptr;
      std::string const own = word ? *word : fmt::format("{}", k);
      order += (k > 0 ? ", " : "") + own;
      add_entries((*list)[k], path + '.' + own, to);
    }
  } else {
    to[path] = text_of(value);
  }
}

void erase(SceneValue& table, std::string_view key) {
  if (auto* members = std::get_if<SceneValue::Table>(&table.value))
    std::erase_if(*members, [&](auto const& member) { return member.first == key; });
}

template <class T>
void add(Hash& hash, std::vector<T> const& values) {
  hash.add(std::span<T const>(values));
}

/// Of a checkpoint's numbers some depend on these.
constexpr std::string_view fixed_of_solver[] = {"precision", "sleep_speed", "sleep_steps"};

/// The keys that a result depends on.
RunIdentity identity_of(SceneChanges const& changes, Scene const& scene) {
  SceneValue document = read_document(scene.file);
  if (changes.small) apply_small(document);
  for (std::string const& assignment : changes.overrides) apply_override(document, assignment);
  for (char const* key : {"description", "small", "sweep", "output"}) erase(document, key);
  if (SceneValue* time = document.find("time")) erase(*time, "frames");
  // What of the solver must stay is said in full below, so that a default may be written out.
  if (SceneValue* solver = document.find("solver")) {
    for (std::string_view key : fixed_of_solver) erase(*solver, key);
    auto const* left = std::get_if<SceneValue::Table>(&solver->value);
    if (left && left->empty()) erase(document, "solver");
  }
  RunIdentity identity;
  add_entries(document, "", identity);
  identity["output.every"] = fmt::format("{}", scene.output.every);
  identity["solver.precision"] = scene.solver.text("precision");
  if (double const speed = scene.solver.number("sleep_speed"); speed > 0) {
    identity["solver.sleep_speed"] = fmt::format("{}", speed);
    identity["solver.sleep_steps"] = fmt::format("{}", scene.solver.integer("sleep_steps"));
  }
  return identity;
}

/// Whether a run may go on with another value.
bool is_of_solver(std::string_view key) {
  constexpr std::string_view table = "solver.";
  if (!key.starts_with(table)) return false;
  auto const end = std::end(fixed_of_solver);
  return std::find(std::begin(fixed_of_solver), end, key.substr(table.size())) == end;
}

constexpr std::string_view of_meshes = "meshes and masks", of_particles = "particles and walls";
constexpr std::string_view prefix = "identity ";

}  // namespace

RunIdentity run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneGeometry const& geometry) {
  Hash hash;
  add(hash, geometry.mesh.points);
  add(hash, geometry.mesh.tets);
  add(hash, geometry.start);
  add(hash, geometry.velocity);
  add(hash, geometry.material_of_tet);
  for (Pin const& pin : geometry.pins) add(hash, pin.vertices);
  for (Force const& force : geometry.forces) {
    add(hash, force.vertices);
    add(hash, force.force);
  }
  for (ObstacleSurface const& surface : geometry.obstacle_meshes) {
    if (surface.drawn_only) continue;
    add(hash, surface.mesh.points);
    add(hash, surface.mesh.triangles);
  }
  RunIdentity identity = identity_of(changes, scene);
  identity[std::string(of_meshes)] = fmt::format("{:016x}", hash.value());
  return identity;
}

RunIdentity run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneParticles const& particles) {
  std::vector<double> numbers;
  // What comes out of sources follows from the text, and from how long the run is.
  for (Particle const& p : std::span(particles.list).first(particles.initial())) {
    for (int c = 0; c < 3; ++c) numbers.push_back(p.x[c]);
    numbers.push_back(p.mass);
  }
  Hash hash;
  add(hash, numbers);
  for (std::size_t k = 0; k < scene.particles->boundaries.size(); ++k) {
    // Other shapes are in the keys, and half spaces are drawn as large as the scene.
    if (!std::holds_alternative<std::filesystem::path>(scene.particles->boundaries[k].shape)) {
      continue;
    }
    add(hash, particles.drawings[k].points);
    add(hash, particles.drawings[k].triangles);
  }
  RunIdentity identity = identity_of(changes, scene);
  identity[std::string(of_particles)] = fmt::format("{:016x}", hash.value());
  return identity;
}

void save(RunIdentity const& identity, Checkpoint& checkpoint) {
  for (auto const& [key, value] : identity) checkpoint.texts[std::string(prefix) + key] = value;
}

std::vector<std::string> solver_changes(RunIdentity const& now, Checkpoint const& checkpoint,
                                        std::filesystem::path const& path) {
  RunIdentity then;
  for (auto const& [name, value] : checkpoint.texts) {
    if (name.starts_with(prefix)) then[name.substr(prefix.size())] = value;
  }
  std::map<std::string, std::pair<std::string, std::string>> both;
  for (auto const& [key, value] : now) both[key].first = value;
  for (auto const& [key, value] : then) both[key].second = value;
  std::vector<std::string> of_solver, others;
  std::string files;
  for (auto const& [key, values] : both) {
    auto const& [value, before] = values;
    if (value == before) continue;
    if (key == of_meshes || key == of_particles) {
      files = key;  // of itself, or because of the others
      continue;
    }
    (is_of_solver(key) ? of_solver : others)
        .push_back(fmt::format("{}{}, it was {}", key,
                               value.empty() ? " is not set" : " = " + value,
                               before.empty() ? "not set" : before));
  }
  if (others.empty() && files.empty()) return of_solver;
  if (others.empty()) {
    others.push_back(fmt::format("what the {} of the scene hold has changed", files));
  }
  constexpr std::size_t shown = 3;
  std::string const rest =
      others.size() > shown ? fmt::format(", and {} more", others.size() - shown) : std::string();
  others.resize(std::min(others.size(), shown));
  throw Error(
      "{}: this is not the run that was interrupted: {}{}; undo that, or start the run again. Of "
      "solver all may change but precision and sleep_*",
      path.string(), fmt::join(others, "; "), rest);
}

}  // namespace taut
