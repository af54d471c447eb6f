// The grid of a step and the surface of its particles as an OpenVDB file (.vdb), for renderers.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <array>
#include <filesystem>
#include <vector>

namespace taut {

/// What a file holds of a moment.
struct GridOutput {
  double dx = 0;                         ///< spacing of the nodes, m
  std::vector<std::array<int, 3>> node;  ///< places, in units of dx
  std::vector<double> mass;              ///< kg, per node
  std::vector<Vec3<double>> velocity;    ///< m/s, per node
  std::vector<Vec3<double>> particle;    ///< m
  double volume = 0;                     ///< of a particle at rest, m^3: a mean will do
};

/// Writes grids of floats "mass" and "velocity", and the level set "surface" in cells of a quarter
/// of dx: the union of balls around the particles that leave no holes between neighbours. The file
/// is replaced in one step. Throws Error if it cannot be written.
void write_grid(std::filesystem::path const& path, GridOutput const& output);

}  // namespace taut
