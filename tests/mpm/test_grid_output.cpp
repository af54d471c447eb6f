// Grids as OpenVDB files: written and read back, and files that hold no body.
#include <taut/core/report/error.hpp>
#include <taut/mpm/grid_output.hpp>
#include <taut/mpm/solid.hpp>

#include <unistd.h>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <numbers>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
namespace fs = std::filesystem;

struct Folder {
  fs::path path;
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "taut_vdb_XXXXXX").string();
    REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    path = pattern;
  }
  Folder(Folder const&) = delete;
  Folder& operator=(Folder const&) = delete;
  ~Folder() { fs::remove_all(path); }
};

/// A ball of points on a lattice, 8 in a cell.
GridOutput ball(double radius, double dx) {
  GridOutput output;
  output.dx = dx;
  double const h = 0.5 * dx;
  output.volume = h * h * h;
  int const n = static_cast<int>(radius / h) + 1;
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) {
        Vec3<double> const x = h * Vec3<double>{i + 0.5, j + 0.5, k + 0.5};
        if (norm(x) <= radius) output.particle.push_back(x);
      }
  for (int i = -3; i < 4; ++i) {
    output.node.push_back({i, 2 * i, -i});
    output.mass.push_back(0.25 * (i + 4));
    output.velocity.push_back({0.5 * i, 1, -2});
  }
  return output;
}

}  // namespace

TEST_CASE("the grid and the surface are read back", "[mpm][output]") {
  Folder const folder;
  fs::path const path = folder.path / "new" / "frame.vdb";
  GridOutput const output = ball(0.5, 0.1);
  write_grid(path, output);
  write_grid(path, output);  // replaces it
  openvdb::io::File file(path.string());
  file.open();
  auto const mass = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("mass"));
  auto const velocity = openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("velocity"));
  REQUIRE(mass);
  REQUIRE(velocity);
  CHECK(mass->activeVoxelCount() == output.node.size());
  for (std::size_t n = 0; n < output.node.size(); ++n) {
    openvdb::Coord const at(output.node[n][0], output.node[n][1], output.node[n][2]);
    CHECK(mass->tree().getValue(at) == float(output.mass[n]));
    for (int c = 0; c < 3; ++c) {
      CHECK(velocity->tree().getValue(at)[c] == float(output.velocity[n][c]));
      CHECK(std::abs(mass->indexToWorld(at)[c] - 0.1 * at[c]) < 1e-12);
    }
  }
  // The surface is a solid, somewhat larger than what the particles fill, and without holes.
  Solid const solid = solid_in_level_set(path);
  CHECK_THAT(solid.volume, WithinRel(4.0 / 3 * std::numbers::pi * std::pow(0.535, 3), 0.1));
  for (Vec3<double> const& x : output.particle) {
    CHECK(solid.holds(x));
    CHECK(solid.holds(0.5 * (x + output.particle.front())));
  }
  CHECK_FALSE(solid.holds({0.6, 0, 0}));
  // Its triangles lead outward.
  TriangleMesh const surface = surface_of_level_set(path);
  CHECK_THAT(solid_in_surface(surface, "surface").volume, WithinRel(solid.volume, 0.03));
}

TEST_CASE("files that hold no body are refused in one sentence", "[mpm][output]") {
  Folder const folder;
  auto const write = [&](openvdb::GridBase::Ptr const& grid) {
    openvdb::initialize();
    openvdb::io::File file((folder.path / "it.vdb").string());
    file.write({grid});
    file.close();
    return folder.path / "it.vdb";
  };
  auto const fog = openvdb::FloatGrid::create(1);
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  CHECK_THROWS_WITH(
      solid_in_level_set(write(fog)),
      ContainsSubstring("no grid is a level set of floats; it holds density (float)"));
  CHECK_THROWS_WITH(solid_in_level_set(write(openvdb::Vec3SGrid::create())),
                    ContainsSubstring("(vec3s)"));
  auto const outside = openvdb::createLevelSet<openvdb::FloatGrid>(0.1, 3.0);
  CHECK_THROWS_WITH(solid_in_level_set(write(outside)), ContainsSubstring("is empty"));
  outside->tree().setValue(openvdb::Coord(1, 2, 3), 0.2f);
  CHECK_THROWS_WITH(solid_in_level_set(write(outside)), ContainsSubstring("has no inside"));
  CHECK_THROWS_WITH(surface_of_level_set(write(outside)), ContainsSubstring("has no surface"));
  CHECK_THROWS_WITH(surface_of_level_set(folder.path / "no.vdb"),
                    ContainsSubstring("there is no such file"));
  GridOutput wrong = ball(0.2, 0.1);
  wrong.mass.pop_back();
  CHECK_THROWS_WITH(write_grid(folder.path / "a.vdb", wrong), ContainsSubstring("masses"));
}

}  // namespace taut
