// Selections: which vertices (or which tets, by their centroids) a pin, a force or a region means.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace taut {

struct SelectAll {};
struct SelectBox {
  Point low{}, high{};  ///< m
};
/// Points within a distance of a plane.
struct SelectPlane {
  Point point{};                 ///< m
  Point normal{};                ///< unit vector
  std::optional<double> within;  ///< m
};
struct SelectSphere {
  Point centre{};  ///< m
  double radius;   ///< m
};
/// Points within a distance of the lowest or highest coordinate that the object reaches on an axis.
struct SelectSide {
  std::size_t axis;              ///< 0, 1, 2
  bool high;                     ///< the side of the highest coordinate
  std::optional<double> within;  ///< m
};
/// Points whose entry in a .npy file of int32 or bool is not zero.
struct SelectMask {
  std::filesystem::path file;
};

using Selector =
    std::variant<SelectAll, SelectBox, SelectPlane, SelectSphere, SelectSide, SelectMask>;
using Selection = std::vector<Selector>;  ///< the union

/// Ascending indices of the selected points. Every bound includes round-off: 1e-9 of the diagonal
/// of the points' bounding box; a `within` that is not given is 1e-6 of it. Throws Error for a mask
/// file that cannot be read or has another number of entries than points.
std::vector<std::int32_t> selected(Selection const& selection, std::span<Point const> points);

/// Entries of a one-dimensional .npy array of int32 or bool, whether they are not zero. Throws
/// Error.
std::vector<bool> read_mask(std::filesystem::path const& file);

}  // namespace taut
