#include <taut/apps/program/memory.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>

namespace taut {
namespace {

namespace fs = std::filesystem;

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// Twelve tets per cell of the lattice, and half a face's four for every face on the boundary.
MeshSize block(double x, double y, double z) {
  double const faces = 2 * (x * y + y * z + z * x);
  return {x * y * z + (x + 1) * (y + 1) * (z + 1) + faces, 12 * x * y * z + 2 * faces};
}

/// A block of size[] metres in cells of `cell` metres.
MeshSize block(Point const& size, double cell) {
  auto const cells = [&](double length) { return std::max(1.0, std::round(length / cell)); };
  return block(cells(size[0]), cells(size[1]), cells(size[2]));
}

struct SizeOfShape {
  int resolution;

  MeshSize operator()(BoxShape const& box) const {
    double const longest = *std::max_element(box.size.begin(), box.size.end());
    return block(box.size, longest / resolution);
  }
  MeshSize operator()(BoxUnionShape const& shape) const {
    double longest = 0;
    for (int a = 0; a < 3; ++a) {
      double low = unlimited, high = -unlimited;
      for (auto const& box : shape.boxes) {
        low = std::min(low, box[0][a]);
        high = std::max(high, box[1][a]);
      }
      longest = std::max(longest, high - low);
    }
    MeshSize sum;
    for (auto const& [low, high] : shape.boxes) {
      MeshSize const one =
          block({high[0] - low[0], high[1] - low[1], high[2] - low[2]}, longest / resolution);
      sum = {sum.vertices + one.vertices, sum.tets + one.tets};
    }
    return sum;
  }
  /// The spine and three arms, put in a row.
  MeshSize operator()(LetterEShape const& letter) const {
    double const unit = letter.height / 9;
    return block({2 * unit, 18 * unit, letter.depth}, letter.height / resolution);
  }
  MeshSize operator()(CylinderShape const& cylinder) const {
    double const across = 2 * cylinder.radius;
    return block({across, across, cylinder.length}, across / resolution);
  }
  MeshSize operator()(SphereShape const&) const {
    return block(resolution, resolution, resolution);
  }
  MeshSize operator()(TorusShape const& torus) const {
    double const across = 2 * torus.tube_radius;
    return block({across, across, 2 * std::numbers::pi * torus.radius}, across / resolution);
  }
  MeshSize operator()(BowlShape const& bowl) const {
    double const across = 2 * bowl.radius * std::acos(1 - bowl.height / bowl.radius);
    return block({across, bowl.thickness, across}, across / resolution);
  }
  MeshSize operator()(FunnelShape const& funnel) const {
    double const along = funnel.spout + std::hypot(funnel.radius - funnel.throat, funnel.height);
    double const around = std::numbers::pi * (funnel.radius + funnel.throat);
    return block({funnel.thickness, along, around}, along / resolution);
  }
  MeshSize operator()(TetsShape const& tets) const {
    double const n = resolution, given = static_cast<double>(tets.mesh.tets.size());
    // A vertex to six tets, and half a one more for each on the surface, where all given ones are.
    double const faces = 2 * static_cast<double>(tets.mesh.points.size()) - 4;
    return {given * n * n * n / 6 + faces * n * n / 4, given * n * n * n};
  }
};

/// The number that a file begins with, after comments; 0 if it begins with something else.
double first_number(fs::path const& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    double number = 0;
    std::istringstream(line) >> number;
    return number;
  }
  return 0;
}

MeshSize size_of_file(fs::path const& path) {
  if (path.extension() == ".node" || path.extension() == ".ele") {
    return {first_number(fs::path(path).replace_extension(".node")),
            first_number(fs::path(path).replace_extension(".ele"))};
  }
  // A tet of a gmsh file takes some 40 bytes, as text or not; there are five for every vertex.
  std::error_code none;
  double const bytes = static_cast<double>(fs::file_size(path, none));
  return none ? MeshSize{} : MeshSize{bytes / 200, bytes / 40};
}

/// A file that holds one number, or "max".
double number_in(fs::path const& path) {
  std::ifstream file(path);
  double number = unlimited;
  return file >> number ? number : unlimited;
}

/// The value in a file of lines "NAME VALUE"; 0 if there is none.
double value_in(fs::path const& path, std::string const& name) {
  std::ifstream file(path);
  std::string word;
  while (file >> word) {
    double value = 0;
    if (word == name && file >> value) return value;
  }
  return 0;
}

/// What one control group leaves; its file cache can be taken back.
double group_leaves(fs::path const& folder, char const* limit, char const* usage) {
  double const most = number_in(folder / limit), used = number_in(folder / usage);
  if (!(most < unlimited) || !(used < unlimited)) return unlimited;
  return std::max(0.0, most - used + value_in(folder / "memory.stat", "inactive_file"));
}

/// The least that the groups of this process, and those around them, leave.
double groups_leave(fs::path const& root) {
  double least = unlimited;
  std::ifstream file(root / "proc/self/cgroup");
  for (std::string line; std::getline(file, line);) {  // "0::/user/group" or "4:memory:/group"
    std::size_t const second = line.find(':', line.find(':') + 1);
    if (second == std::string::npos) continue;
    bool const unified = line.starts_with("0::");
    if (!unified && line.find(":memory:") == std::string::npos) continue;
    fs::path const mount = root / (unified ? "sys/fs/cgroup" : "sys/fs/cgroup/memory");
    // In a container the path can be that outside: then what is mounted is the group itself.
    for (fs::path group = line.substr(second + 1);; group = group.parent_path()) {
      fs::path const folder = mount / group.relative_path();
      least = std::min(
          least, unified ? group_leaves(folder, "memory.max", "memory.current")
                         : group_leaves(folder, "memory.limit_in_bytes", "memory.usage_in_bytes"));
      if (!group.has_relative_path()) break;
    }
  }
  return least;
}

}  // namespace

MeshSize estimate_size(Scene const& scene) {
  MeshSize sum;
  auto const add = [&](MeshSize const& one) {
    sum = {sum.vertices + one.vertices, sum.tets + one.tets};
  };
  auto const size_of_shape = [](ProceduralShape const& geometry) {
    return std::visit(SizeOfShape{geometry.resolution}, geometry.shape);
  };
  for (SceneObject const& object : scene.objects) {
    auto const* file = std::get_if<fs::path>(&object.geometry);
    add(file ? size_of_file(*file) : size_of_shape(std::get<ProceduralShape>(object.geometry)));
  }
  // The surface of an obstacle is cut from a mesh of all of it.
  for (SceneObstacle const& obstacle : scene.obstacles)
    if (auto const* shape = std::get_if<ProceduralShape>(&obstacle.geometry))
      add(size_of_shape(*shape));
  return sum;
}

MeshSize size_of(SceneGeometry const& geometry) {
  return {double(geometry.mesh.points.size()), double(geometry.mesh.tets.size())};
}

double memory_needed(MeshSize const& size, SolverOptions const& solver) {
  auto const [vertices, tets] = size;
  double const real = solver.text("precision") == "fp64" ? 8 : 4;
  // The program itself; element data and slots, the fields of state and minimiser; the mesh in the
  // scene's and the solver's order, with what sorting and checking it takes (measured: 1e5 to 4e5
  // tets).
  double bytes = 2.5e7 + tets * (14 * real + 60 + 130) + vertices * (30 * real + 400);
  bool const assembles =
      solver.text("method") == "newton" && solver.text("hessian") != "matrix_free";
  // Where it is still to be chosen, the larger one.
  std::string const& preconditioner = solver.text("preconditioner");
  bool const schwarz = preconditioner.starts_with("schwarz") || preconditioner == "auto";
  if (assembles || schwarz) bytes += vertices * 15 * (72 + 4);  // ~15 blocks per row
  // The inverses of its aggregates, its levels, and what these are made of (measured: 40,000 to
  // 50,000 vertices).
  if (schwarz) bytes += vertices * ((preconditioner == "schwarz_16" ? 16 : 32) * 18 + 9000);
  if (assembles && solver.text("hessian") == "direct") bytes += vertices * 15 * 72 * 20;  // fill-in
  return bytes;
}

double memory_available(fs::path const& root) {
  double const kilobytes = value_in(root / "proc/meminfo", "MemAvailable:");
  return std::min(kilobytes > 0 ? 1024 * kilobytes : unlimited, groups_leave(root));
}

void require_memory(MeshSize const& size, SolverOptions const& solver) {
  double const needed = memory_needed(size, solver), available = memory_available();
  if (needed > available) {
    throw Error(
        "the scene has about {:.3g} tets and needs about {:.3g} GB of memory, of which {:.3g} GB "
        "are free: lower its resolution, or use solver.precision = \"mixed\"",
        size.tets, 1e-9 * needed, 1e-9 * available);
  }
}

double particle_memory_needed(double particles, double per_cell, SolverOptions const& solver) {
  std::string const& method = solver.text("method");
  bool const assembles = method.starts_with("hot") || method == "lbfgs_h" ||
                         method == "lbfgs_gmg" ||
                         (method.starts_with("pn_") && method != "pn_pcg_mf") ||
                         (method == "newton" && solver.text("hessian") != "matrix_free");
  // Particles on the host for reading and writing and on the device, with what the operator keeps
  // of each (45 numbers); nodes with their fields and history and coarser levels (125 blocks in a
  // row of an eighth of them); a matrix of their own where there is one. There are about twice as
  // many nodes as cells in thick bodies, more in thin ones.
  double const nodes = 3 * particles / per_cell;
  return 4e7 + particles * 1900 + nodes * (assembles ? 16000 : 5000);
}

void require_particle_memory(double particles, double per_cell, SolverOptions const& solver) {
  double const needed = particle_memory_needed(particles, per_cell, solver),
               available = memory_available();
  if (needed > available) {
    throw Error(
        "the scene has about {:.3g} particles and needs about {:.3g} GB of memory, of which {:.3g} "
        "GB are free: raise grid.spacing, or lower its per_cell",
        particles, 1e-9 * needed, 1e-9 * available);
  }
}

SceneGeometry build_within_memory(Scene const& scene) {
  if (scene.particles) return build_geometry(scene);  // says that there are no meshes
  MeshSize const expected = estimate_size(scene);
  require_memory(expected, scene.solver);
  if (expected.tets > 2e6) {
    fmt::print(stderr, "taut: building a mesh of about {:.1f} million tets\n",
               1e-6 * expected.tets);
  }
  SceneGeometry geometry = build_geometry(scene);
  require_memory(size_of(geometry), scene.solver);
  return geometry;
}

}  // namespace taut
