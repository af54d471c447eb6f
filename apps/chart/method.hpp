// A method as the user of a chart names it: one of solver.method with other keys of [solver].
#pragma once

#include <taut/apps/program/scene.hpp>

#include <span>
#include <string>
#include <vector>

namespace taut {

struct ChartMethod {
  std::string label;                   ///< "DK jacobi"
  std::vector<std::string> overrides;  ///< of the scene: "solver.method=dk", ...
};

/// Reads "dk:preconditioner=jacobi:precision=mixed". Throws Error for a method that does not exist
/// for meshes or, where the scene is of those, for material points; keys and values are checked
/// where the scene is loaded.
ChartMethod parse_method(std::string const& text, bool particles = false);

/// All of them; empty or "all" stands for every method of the program, of material points for those
/// that only these have. Throws Error for one that is named twice.
std::vector<ChartMethod> parse_methods(std::vector<std::string> const& texts,
                                       bool particles = false);

/// `changes` followed by `more` overrides, the later ones winning.
SceneChanges with(SceneChanges changes, std::span<std::string const> more);

}  // namespace taut
