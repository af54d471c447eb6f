// How results lie in their files (vtkhdf.hpp): what writing one begins with. Internal to core/io.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/io/xdmf.hpp>
#include <vector>

namespace taut::vtkhdf {

/// The two step tables: /VTKHDF/Steps leads to one of them.
inline constexpr std::array tables{"/taut/steps_a", "/taut/steps_b"};

ResultShape shape_of(ResultMesh const& mesh, std::int64_t capacity, bool velocities);

/// The cells of a frame, or of all.
struct Cells {
  std::vector<std::int64_t> ids, offsets{0};
  std::vector<std::uint8_t> types;

  /// With the first `particles` of the particles; the points behind these follow them.
  Cells(ResultMesh const& mesh, std::size_t particles);
};

/// One per object.
std::vector<ObjectKind> kinds_of(ResultMesh const& mesh);

/// Writes a result without frames; `path` is valid only once this has returned.
void lay_out(std::filesystem::path const& path, ResultMesh const& mesh, std::int64_t capacity,
             bool velocities);

}  // namespace taut::vtkhdf
