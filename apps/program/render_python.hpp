// Drawing is left to short Python scripts (apps/python), which run in a private virtual
// environment: TAUT_PYTHON_ENV, or taut/python in XDG_CACHE_HOME, or in ~/.cache. It is made, and
// filled with the packages that a script needs, when a command first asks for a drawing.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace taut {

/// A script of apps/python and what it imports.
struct DrawingScript {
  std::string name;                   ///< "draw_chart.py"
  std::vector<std::string> modules;   ///< as imported: "matplotlib"
  std::vector<std::string> packages;  ///< as installed: "matplotlib>=3.7"
};

/// Runs the script. `input` is what it draws, named in messages. Throws Error if the script, Python
/// or a package is missing and cannot be had, or if the script fails.
void run_drawing(DrawingScript const& script, std::vector<std::string> const& arguments,
                 std::filesystem::path const& input);

}  // namespace taut
