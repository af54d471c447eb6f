#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>
#include <taut/mpm/grid_output.hpp>

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

openvdb::FloatGrid::Ptr surface_of(GridOutput const& output) {
  double const voxel = 0.25 * output.dx;
  auto const grid = openvdb::createLevelSet<openvdb::FloatGrid>(voxel, 3.0);
  grid->setName("surface");
  // Neighbours in blue noise are about cbrt(volume) apart.
  double const radius = std::max(1.1 * std::cbrt(output.volume), 1.6 * voxel);
  double const reach = radius + 3 * voxel;
  auto cells = grid->getAccessor();
  for (Vec3<double> const& p : output.particle) {
    int low[3], high[3];
    for (int c = 0; c < 3; ++c) {
      low[c] = static_cast<int>(std::ceil((p[c] - reach) / voxel));
      high[c] = static_cast<int>(std::floor((p[c] + reach) / voxel));
    }
    openvdb::Coord at;
    for (at[0] = low[0]; at[0] <= high[0]; ++at[0])
      for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
        for (at[2] = low[2]; at[2] <= high[2]; ++at[2]) {
          Vec3<double> const x{voxel * at[0], voxel * at[1], voxel * at[2]};
          double const d = norm(x - p) - radius;
          if (d < 3 * voxel && d < double(cells.getValue(at))) {
            cells.setValue(at, static_cast<float>(d));
          }
        }
  }
  return grid;
}

}  // namespace

void write_grid(std::filesystem::path const& path, GridOutput const& output) {
  if (!(output.dx > 0) || output.mass.size() != output.node.size() ||
      output.velocity.size() != output.node.size()) {
    throw Error("{}: a grid of cells of {} m with {} nodes, {} masses and {} velocities",
                path.string(), output.dx, output.node.size(), output.mass.size(),
                output.velocity.size());
  }
  openvdb::initialize();
  auto const transform = openvdb::math::Transform::createLinearTransform(output.dx);
  auto const mass = openvdb::FloatGrid::create(0);
  auto const velocity = openvdb::Vec3SGrid::create();
  mass->setName("mass");
  velocity->setName("velocity");
  velocity->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  for (auto const& grid : {openvdb::GridBase::Ptr(mass), openvdb::GridBase::Ptr(velocity)}) {
    grid->setTransform(transform->copy());
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  }
  velocity->setGridClass(openvdb::GRID_UNKNOWN);
  for (std::size_t n = 0; n < output.node.size(); ++n) {
    openvdb::Coord const at(output.node[n][0], output.node[n][1], output.node[n][2]);
    Vec3<double> const& v = output.velocity[n];
    mass->tree().setValue(at, static_cast<float>(output.mass[n]));
    velocity->tree().setValue(at, openvdb::Vec3s(openvdb::Vec3d(v[0], v[1], v[2])));
  }
  make_parent_folder(path);
  std::filesystem::path const temporary = temporary_beside(path);
  try {
    openvdb::io::File file(temporary.string());
    file.write({mass, velocity, surface_of(output)});
    file.close();
  } catch (openvdb::Exception const& e) {
    throw Error("{}: the grid cannot be written ({}); free disk space or choose another folder",
                path.string(), e.what());
  }
  move_into_place(temporary, path);
}

}  // namespace taut
