// The XDMF sidecar of a result: XML that names, per time step, the parts of the VTKHDF file's
// datasets (https://www.xdmf.org/index.php/XDMF_Model_and_Format), for viewers that cannot read
// VTKHDF steps.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace taut {

/// The sizes of the datasets that an XdmfSidecar points into.
struct ResultShape {
  std::size_t points = 0;
  std::size_t particles = 0;  ///< in front of the tets
  std::size_t tets = 0;
  std::size_t triangles = 0;  ///< behind the tets; not shown
  std::int64_t capacity = 0;  ///< frames the datasets have room for
  bool velocities = true;
  std::vector<std::string> scalars = {};  ///< names of the numbers that points have
  bool growing = false;                   ///< each frame has the first of the particles alone

  std::size_t cells() const { return particles + tets + triangles; }
  /// Numbers of points that cells name.
  std::size_t corners() const { return particles + 4 * tets + 3 * triangles; }
};

class XdmfSidecar {
public:
  /// For the result at `path`; the sidecar lies beside it as <stem>.xdmf. Nothing is written yet.
  XdmfSidecar(std::filesystem::path const& path, ResultShape const& shape);

  /// Starts over with these frames, and writes the sidecar. `particles`: in each of them; all if
  /// there is no list.
  void restart(std::span<double const> times, std::span<std::size_t const> particles = {});
  /// Adds the next frame, over the closing tags. Throws Error if it cannot be written.
  void append(double time, std::size_t particles);

private:
  /// The XML of frame number `frame`.
  std::string grid(std::int64_t frame, double time, std::size_t particles) const;

  std::filesystem::path path_;
  std::string result_;  // file name of the result, seen from the sidecar
  ResultShape shape_;
  std::int64_t frames_ = 0;
  std::size_t end_ = 0;  // bytes before the closing tags
};

}  // namespace taut
