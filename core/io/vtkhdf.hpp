// The result of a run: one VTKHDF file of an unstructured grid with fixed topology and time steps
// (https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html), which VTK 9.3
// and ParaView 5.12 open, and an XDMF sidecar that points into it for older ParaViews.
//
//   Points (moving, m), PointData/velocity (m/s), CellData/object (number of the object a cell is
//   of); /taut/object_names: the objects' names in that numbering; /taut/object_kind: 0 for bodies,
//   1 for obstacles, 2 for what is only drawn (results without it have bodies alone). Where points
//   carry more than that, PointData/NAME and the names in /taut/scalars.
//
// Cells are the particles (vertices, of the first points), then the tets, then the triangles of
// obstacles: one type of grid for meshes and material points, so that walls are in the same file.
// XDMF's form of mixed cells would need a second copy of them: the sidecar shows the particles
// alone if there are any, else the tets.
//
// Where particles come out of sources, each frame has points and cells of its own: the first of the
// particles, as many as there are by then, and the triangles.
//
// A run may be killed at any moment, or its disk may fill: every finished frame stays readable. The
// file has its final layout from the start, laid out for `capacity` frames (unwritten ones are
// holes that take no disk space). A frame is first written to its own place; one write of one file
// page then makes it part of the result (vtkhdf_writer.cpp). A viewer may have the file open
// meanwhile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <taut/core/fem/tet_mesh.hpp>
#include <vector>

namespace taut {

enum class ObjectKind : std::uint8_t {
  body = 0,
  obstacle = 1,   ///< its triangles are what bodies touch
  drawn_only = 2  ///< its triangles are a picture of what bodies touch
};

/// What does not change between frames.
struct ResultMesh {
  TetMesh mesh;  ///< points: at t = 0, those of the triangles included
  /// Per particle, then per tet, then per triangle: into object_names.
  std::vector<std::int32_t> object;
  std::vector<std::string> object_names;     ///< UTF-8
  std::vector<Triangle> triangles = {};      ///< of obstacles; their vertices are mesh.points
  std::vector<ObjectKind> object_kind = {};  ///< per object; empty: all are bodies
  std::size_t particles = 0;                 ///< the first of mesh.points, each a cell
  std::vector<std::string> scalars = {};     ///< names of what else each point has in each frame
  /// Frames have the first of the particles alone, those that are there by then. No tets then.
  bool growing = false;

  ObjectKind kind(std::size_t object_number) const {
    return object_kind.empty() ? ObjectKind::body : object_kind.at(object_number);
  }
};

class ResultWriter {
public:
  enum class IfExists { refuse, replace };

  /// What a result is laid out for at most before it has more frames: each takes some memory and
  /// disk space at once.
  static constexpr std::int64_t most_capacity = 1 << 17;

  /// Begins a result at `path` (name it .vtkhdf) laid out for `capacity` frames; missing folders
  /// are made, the layout grows if more are appended. `velocities`: whether frames carry them.
  /// Throws Error if the file exists and is not to be replaced, if it cannot be written, or if
  /// objects and kinds are not as many as ResultMesh says.
  static ResultWriter create(std::filesystem::path const& path, ResultMesh const& mesh,
                             std::int64_t capacity, IfExists if_exists, bool velocities = true);

  /// Goes on with an existing result after its first `frames` frames; later ones are dropped.
  /// Throws Error if the file is not a result of the same mesh or has fewer frames. A growing mesh
  /// may have more particles than before, or fewer, behind those that both have.
  static ResultWriter resume(std::filesystem::path const& path, ResultMesh const& mesh,
                             std::int64_t frames, std::int64_t capacity);

  ResultWriter(ResultWriter&&) noexcept;
  ResultWriter& operator=(ResultWriter&&) noexcept;
  ~ResultWriter();

  /// Appends the frame at `time` (s): positions (m), velocities (m/s; empty if the result has none)
  /// and a list of numbers for each of its scalars, one per point; in a growing result, for as many
  /// particles as there are by now and the points behind them. Throws Error if it cannot be
  /// written; the earlier frames are then intact.
  void append(double time, std::span<Point const> positions, std::span<Point const> velocities,
              std::span<std::vector<double> const> scalars = {});

  /// Waits until the frames are on the disk, where they survive a failing machine.
  void sync() const;

  std::int64_t frames() const;

private:
  struct File;
  explicit ResultWriter(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

class ResultReader {
public:
  /// Throws Error if `path` is no result of this library.
  explicit ResultReader(std::filesystem::path const& path);
  ResultReader(ResultReader&&) noexcept;
  ResultReader& operator=(ResultReader&&) noexcept;
  ~ResultReader();

  std::int64_t frames() const;
  std::int64_t capacity() const;             ///< frames the file is laid out for
  std::vector<double> const& times() const;  ///< s, one per frame
  ResultMesh const& mesh() const;            ///< points: at t = 0; a kind for every object
  bool has_velocities() const;
  /// Of mesh().particles, how many are there in this frame; they are the first of its points.
  std::size_t particles(std::int64_t frame) const;

  /// One per point of the frame; 0 <= frame < frames(). Throws Error otherwise, or if the file
  /// cannot be read.
  std::vector<Point> positions(std::int64_t frame) const;   ///< m
  std::vector<Point> velocities(std::int64_t frame) const;  ///< m/s
  /// Of mesh().scalars. Throws Error for another name, too.
  std::vector<double> scalar(std::string const& name, std::int64_t frame) const;

private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace taut
