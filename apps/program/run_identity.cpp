#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/scene_document.hpp>
#include <taut/core/io/hash.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <span>

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
    for (SceneValue const& entry : list) {
      std::visit(*this, entry.value);
      text += ", ";
    }
    text += ']';
  }
  /// By name: the order of keys means nothing.
  void operator()(SceneValue::Table const& table) const {
    std::vector<std::pair<std::string, SceneValue const*>> members;
    for (auto const& [key, member] : table) members.emplace_back(key, &member);
    std::sort(members.begin(), members.end());
    text += '{';
    for (auto const& [key, member] : members) {
      text += key + " = ";
      std::visit(*this, member->value);
      text += ", ";
    }
    text += '}';
  }
};

void erase(SceneValue& table, std::string_view key) {
  if (auto* members = std::get_if<SceneValue::Table>(&table.value))
    std::erase_if(*members, [&](auto const& member) { return member.first == key; });
}

template <class T>
void add(Hash& hash, std::vector<T> const& values) {
  hash.add(std::span<T const>(values));
}

}  // namespace

namespace {

/// The keys that a result depends on.
std::string text_of(SceneChanges const& changes, Scene const& scene) {
  SceneValue document = read_document(scene.file);
  if (changes.small) apply_small(document);
  for (std::string const& assignment : changes.overrides) apply_override(document, assignment);
  for (char const* key : {"description", "small", "sweep", "output"}) erase(document, key);
  if (SceneValue* time = document.find("time")) erase(*time, "frames");
  std::string text;
  std::visit(Write{text}, document.value);
  return text;
}

}  // namespace

std::string run_identity(SceneChanges const& changes, Scene const& scene,
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
  return text_of(changes, scene) +
         fmt::format("\nevery = {}\nmeshes {:016x}\n", scene.output.every, hash.value());
}

std::string run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneParticles const& particles) {
  std::vector<double> numbers;
  // What comes out of sources follows from the text, and from how long the run is.
  for (Particle const& p : std::span(particles.list).first(particles.initial())) {
    for (int c = 0; c < 3; ++c) numbers.push_back(p.x[c]);
    numbers.push_back(p.mass);
  }
  Hash hash;
  add(hash, numbers);
  return text_of(changes, scene) +
         fmt::format("\nevery = {}\nparticles {:016x}\n", scene.output.every, hash.value());
}

}  // namespace taut
