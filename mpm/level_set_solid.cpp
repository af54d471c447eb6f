#include <taut/core/report/error.hpp>
#include <taut/mpm/solid.hpp>

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>

namespace taut {
namespace {

openvdb::FloatGrid::Ptr read_level_set(std::filesystem::path const& path) {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
  std::string seen;
  try {
    openvdb::io::File file(path.string());
    file.open();
    for (auto name = file.beginName(); name != file.endName(); ++name) {
      auto const base = file.readGrid(name.gridName());
      auto const grid = openvdb::gridPtrCast<openvdb::FloatGrid>(base);
      if (grid && grid->getGridClass() == openvdb::GRID_LEVEL_SET) return grid;
      seen += (seen.empty() ? "" : ", ") + name.gridName() + " (" + base->valueType() + ")";
    }
  } catch (openvdb::Exception const& e) {
    throw Error("{}: is no OpenVDB file that can be read ({})", path.string(), e.what());
  }
  throw Error("{}: no grid is a level set of floats; it holds {}", path.string(),
              seen.empty() ? "none" : seen);
}

}  // namespace

TriangleMesh surface_of_level_set(std::filesystem::path const& file) {
  if (!std::filesystem::exists(file)) throw Error("{}: there is no such file", file.string());
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*read_level_set(file), points, triangles, quads);
  TriangleMesh surface;
  for (openvdb::Vec3s const& p : points) surface.points.push_back({p[0], p[1], p[2]});
  // OpenVDB lists corners clockwise as seen from outside.
  auto const add = [&](auto const& cell, int a, int b, int c) {
    surface.triangles.push_back({static_cast<std::int32_t>(cell[a]),
                                 static_cast<std::int32_t>(cell[b]),
                                 static_cast<std::int32_t>(cell[c])});
  };
  for (openvdb::Vec3I const& t : triangles) add(t, 0, 2, 1);
  for (openvdb::Vec4I const& q : quads) {
    add(q, 0, 2, 1);
    add(q, 0, 3, 2);
  }
  if (surface.triangles.empty()) throw Error("{}: the level set has no surface", file.string());
  return surface;
}

Solid solid_in_level_set(std::filesystem::path const& file) {
  if (!std::filesystem::exists(file)) throw Error("{}: there is no such file", file.string());
  auto const grid = read_level_set(file);
  auto const active = grid->evalActiveVoxelBoundingBox();
  if (active.empty()) throw Error("{}: the level set is empty", file.string());
  Solid solid;
  double const inf = std::numeric_limits<double>::infinity();
  solid.lowest = {inf, inf, inf};
  solid.highest = {-inf, -inf, -inf};
  for (int corner = 0; corner < 8; ++corner) {
    openvdb::Vec3d at;
    for (int c = 0; c < 3; ++c) at[c] = corner >> c & 1 ? active.max()[c] : active.min()[c];
    at = grid->indexToWorld(at);
    for (int c = 0; c < 3; ++c) {
      solid.lowest[c] = std::min(solid.lowest[c], at[c]);
      solid.highest[c] = std::max(solid.highest[c], at[c]);
    }
  }
  // A voxel whose centre is d from the surface is in it by about 1/2 - d / size: in the sum over
  // all distances what is wrong with that cancels.
  auto const cell = grid->voxelSize();
  double const size = std::cbrt(cell[0] * cell[1] * cell[2]);
  double cells = 0;
  for (auto value = grid->tree().cbeginValueAll(); value; ++value) {
    double const share = std::clamp(0.5 - double(*value) / size, 0.0, 1.0);
    cells += share * double(value.getVoxelCount());
  }
  solid.volume = cells * cell[0] * cell[1] * cell[2];
  if (!(solid.volume > 0)) {
    throw Error("{}: the level set has no inside: no value is below 0", file.string());
  }
  solid.holds = [grid](Vec3<double> const& x) {
    auto const at = grid->worldToIndex(openvdb::Vec3d(x[0], x[1], x[2]));
    // Not through an accessor: those may not be shared by threads, nor are they needed here.
    return openvdb::tools::BoxSampler::sample(grid->tree(), at) <= 0;
  };
  return solid;
}

}  // namespace taut
