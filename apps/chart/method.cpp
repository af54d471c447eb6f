#include <taut/apps/chart/method.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/particle_methods.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cctype>

namespace taut {

namespace {

/// Those of a kind of scenes; the first of a name counts.
std::vector<MethodTitle> titles_of(bool particles) {
  auto const of_meshes = method_titles();
  if (!particles) return {of_meshes.begin(), of_meshes.end()};
  auto const own = particle_method_titles();
  std::vector<MethodTitle> all(own.begin(), own.end());
  for (MethodTitle const& title : of_meshes) {
    bool const known = std::any_of(own.begin(), own.end(),
                                   [&](MethodTitle const& t) { return t.name == title.name; });
    if (!known) all.push_back(title);
  }
  return all;
}

}  // namespace

ChartMethod parse_method(std::string const& text, bool particles) {
  std::size_t end = std::min(text.find(':'), text.size());
  std::string const name = text.substr(0, end);
  auto const titles = titles_of(particles);
  auto const title = std::find_if(titles.begin(), titles.end(),
                                  [&](MethodTitle const& t) { return t.name == name; });
  if (title == titles.end()) {
    std::vector<std::string_view> names;
    for (MethodTitle const& t : titles) names.push_back(t.name);
    throw Error("--methods {}: there is no method \"{}\"{}; `taut methods` lists them", text, name,
                suggestion(": did you mean \"", name, names, "\"?"));
  }
  ChartMethod method{std::string(title->title), {"solver.method=" + name}};
  while (end < text.size()) {
    std::size_t const begin = end + 1;
    end = std::min(text.find(':', begin), text.size());
    std::string const assignment = text.substr(begin, end - begin);
    std::size_t const equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size()) {
      throw Error("--methods {}: \"{}\" is not KEY=VALUE: write it like preconditioner=jacobi",
                  text, assignment);
    }
    // Words speak for themselves, numbers and flags do not.
    bool const word = std::isalpha(static_cast<unsigned char>(assignment[equals + 1])) &&
                      !assignment.ends_with("=true") && !assignment.ends_with("=false");
    method.label += " " + (word ? assignment.substr(equals + 1) : assignment);
    method.overrides.push_back("solver." + assignment);
  }
  return method;
}

std::vector<ChartMethod> parse_methods(std::vector<std::string> const& texts, bool particles) {
  std::vector<ChartMethod> methods;
  auto const add = [&](std::string const& text) {
    methods.push_back(parse_method(text, particles));
    for (std::size_t i = 0; i + 1 < methods.size(); ++i)
      if (methods[i].label == methods.back().label)
        throw Error("--methods: {} is named twice: drop one", text);
  };
  if (texts.empty() || (texts.size() == 1 && texts[0] == "all")) {
    for (MethodTitle const& title : particles ? particle_method_titles() : method_titles())
      add(std::string(title.name));
  } else {
    for (std::string const& text : texts) add(text);
  }
  return methods;
}

SceneChanges with(SceneChanges changes, std::span<std::string const> more) {
  changes.overrides.insert(changes.overrides.end(), more.begin(), more.end());
  return changes;
}

}  // namespace taut
