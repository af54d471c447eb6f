// A result file without frames: its groups and datasets, with room for those that will come.
#include <algorithm>
#include <array>
#include <taut/core/io/hdf5.hpp>
#include <taut/core/io/vtkhdf_layout.hpp>

namespace taut::vtkhdf {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;
using hdf5::Shape;

constexpr std::uint8_t vtk_vertex = 1, vtk_triangle = 5, vtk_tetra = 10;

template <class T, class Container>
void write_list(hid_t parent, std::string const& name, Container const& values) {
  hdf5::write_dataset<T>(parent, name, values, {values.size()});
}

void write_count(hid_t parent, std::string const& name, std::size_t count) {
  write_list<std::int64_t>(parent, name, std::array{static_cast<std::int64_t>(count)});
}

/// Room for one vector, or one number, per point and frame; unwritten rows take no disk space.
void reserve_frames(hid_t parent, std::string const& name, std::size_t points,
                    std::int64_t capacity, bool vectors = true) {
  Shape shape{static_cast<hsize_t>(capacity) * points};
  if (vectors) shape.push_back(3);
  hdf5::make_dataset(parent, name, H5T_NATIVE_DOUBLE, shape, true);
}

/// The times of the steps: as long as there are steps, at least 1, in one chunk that never moves.
void make_times(hid_t table, std::int64_t capacity) {
  const Handle list = hdf5::creation_list(H5P_DATASET_CREATE);
  const auto most = static_cast<hsize_t>(capacity);
  const hsize_t least = 1;
  hdf5::check(H5Pset_chunk(list, 1, &most), "Values");
  hdf5::check(H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY), "Values");
  const Handle space(H5Screate_simple(1, &least, &most), H5Sclose, "Values");
  const Handle dataset(
      H5Dcreate2(table, "Values", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT),
      H5Dclose, "the dataset Values cannot be created");
}

/// The two step tables without steps. They share what depends on the step's number alone: the
/// points of step k begin at row k N; its cells are always the first, or begin at k times the most
/// of them if the result grows. (A list of n cells has n + 1 offsets: those of step k begin k
/// further on than its cells, which readers take from its part's number.)
void make_tables(hid_t file, ResultShape const& shape) {
  const auto n = static_cast<std::size_t>(shape.capacity);
  const auto multiples = [&](std::size_t of) {
    std::vector<std::int64_t> rows(n);
    for (std::size_t k = 0; k < n; ++k) rows[k] = static_cast<std::int64_t>(k * of);
    return rows;
  };
  const std::size_t once = shape.growing ? 1 : 0;
  const std::vector<std::int64_t> rows = multiples(shape.points),
                                  cells = multiples(once * shape.cells());

  const Handle first = hdf5::make_group(file, tables[0]);
  write_list<std::int64_t>(first, "NumberOfParts", std::vector<std::int64_t>(n, 1));
  write_list<std::int64_t>(first, "PartOffsets", multiples(once));
  write_list<std::int64_t>(first, "PointOffsets", rows);
  hdf5::write_dataset<std::int64_t>(first, "CellOffsets", cells, {n, 1});
  hdf5::write_dataset<std::int64_t>(first, "ConnectivityIdOffsets",
                                    multiples(once * shape.corners()), {n, 1});
  const Handle point_data = hdf5::make_group(first, "PointDataOffsets");
  if (shape.velocities) write_list<std::int64_t>(point_data, "velocity", rows);
  for (std::string const& name : shape.scalars) write_list<std::int64_t>(point_data, name, rows);
  const Handle cell_data = hdf5::make_group(first, "CellDataOffsets");
  write_list<std::int64_t>(cell_data, "object", cells);

  const Handle second = hdf5::make_group(file, tables[1]);
  for (char const* const name : {"NumberOfParts", "PartOffsets", "PointOffsets", "CellOffsets",
                                 "ConnectivityIdOffsets", "PointDataOffsets", "CellDataOffsets"}) {
    hdf5::check(H5Lcreate_hard(first, name, second, name, H5P_DEFAULT, H5P_DEFAULT), name);
  }
  const std::int64_t no_steps = 0;
  for (hid_t const table : {hid_t(first), hid_t(second)}) {
    make_times(table, shape.capacity);
    hdf5::write_attribute(table, "NSteps", H5T_NATIVE_INT64, {}, &no_steps);
  }
}

void write_cells(hid_t grid, ResultMesh const& mesh) {
  const Cells cells(mesh, mesh.particles);
  write_count(grid, "NumberOfPoints", mesh.mesh.points.size());
  write_count(grid, "NumberOfCells", cells.types.size());
  write_count(grid, "NumberOfConnectivityIds", cells.ids.size());
  write_list<std::int64_t>(grid, "Connectivity", cells.ids);
  write_list<std::int64_t>(grid, "Offsets", cells.offsets);
  write_list<std::uint8_t>(grid, "Types", cells.types);
  const Handle cell_data = hdf5::make_group(grid, "CellData");
  write_list<std::int32_t>(cell_data, "object", mesh.object);
}

/// Room for the cells of each frame.
void reserve_cells(hid_t grid, ResultShape const& shape) {
  const auto n = static_cast<hsize_t>(shape.capacity);
  const auto reserve = [n](hid_t parent, char const* name, hid_t type, std::size_t each) {
    hdf5::make_dataset(parent, name, type, {n * each}, true);
  };
  for (char const* const name : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"}) {
    reserve(grid, name, H5T_NATIVE_INT64, 1);
  }
  reserve(grid, "Connectivity", H5T_NATIVE_INT64, shape.corners());
  reserve(grid, "Offsets", H5T_NATIVE_INT64, shape.cells() + 1);
  reserve(grid, "Types", H5T_NATIVE_UINT8, shape.cells());
  const Handle cell_data = hdf5::make_group(grid, "CellData");
  reserve(cell_data, "object", H5T_NATIVE_INT32, shape.cells());
}

/// What a growing result has of its mesh: no frame need have all of it.
void write_mesh(hid_t ours, ResultMesh const& mesh) {
  write_count(ours, "growing", mesh.particles);
  write_list<std::int32_t>(ours, "object", mesh.object);
  std::vector<std::int32_t> corners;
  for (Triangle const& triangle : mesh.triangles) {
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  }
  write_list<std::int32_t>(ours, "triangles", corners);
}

}  // namespace

ResultShape shape_of(ResultMesh const& mesh, std::int64_t capacity, bool velocities) {
  return {mesh.mesh.points.size(),
          mesh.particles,
          mesh.mesh.tets.size(),
          mesh.triangles.size(),
          capacity,
          velocities,
          mesh.scalars,
          mesh.growing};
}

Cells::Cells(ResultMesh const& mesh, std::size_t particles) {
  const std::size_t solids = particles + mesh.mesh.tets.size(),
                    cells = solids + mesh.triangles.size();
  const auto gone = static_cast<std::int64_t>(mesh.particles - particles);
  ids.reserve(particles + 4 * mesh.mesh.tets.size() + 3 * mesh.triangles.size());
  offsets.reserve(cells + 1);
  const auto add = [&](auto const& cell, std::int64_t shift) {
    for (auto const vertex : cell) ids.push_back(vertex - shift);
    offsets.push_back(static_cast<std::int64_t>(ids.size()));
  };
  for (std::size_t p = 0; p < particles; ++p) add(std::array{static_cast<std::int64_t>(p)}, 0);
  for (Tet const& tet : mesh.mesh.tets) add(tet, gone);
  for (Triangle const& triangle : mesh.triangles) add(triangle, gone);
  types.assign(particles, vtk_vertex);
  types.resize(solids, vtk_tetra);
  types.resize(cells, vtk_triangle);
}

std::vector<ObjectKind> kinds_of(ResultMesh const& mesh) {
  std::vector<ObjectKind> kinds;
  for (std::size_t i = 0; i < mesh.object_names.size(); ++i) kinds.push_back(mesh.kind(i));
  return kinds;
}

void lay_out(fs::path const& path, ResultMesh const& mesh, std::int64_t capacity, bool velocities) {
  const std::size_t points = mesh.mesh.points.size();
  Handle file = hdf5::create_file(path);
  // First of all, so that its header lies in the file's first page.
  Handle grid = hdf5::make_group(file, "VTKHDF");
  constexpr std::array<std::int64_t, 2> version{2, 0};
  constexpr std::string_view type = "UnstructuredGrid";
  hdf5::write_attribute(grid, "Version", H5T_NATIVE_INT64, {version.size()}, version.data());
  {
    const Handle text(H5Tcopy(H5T_C_S1), H5Tclose, "Type");
    hdf5::check(H5Tset_size(text, type.size()), "Type");
    hdf5::check(H5Tset_strpad(text, H5T_STR_NULLPAD), "Type");
    hdf5::write_attribute(grid, "Type", text, {}, type.data());
  }
  const ResultShape shape = shape_of(mesh, capacity, velocities);
  if (mesh.growing) {
    reserve_cells(grid, shape);
  } else {
    write_cells(grid, mesh);
  }

  const Handle ours = hdf5::make_group(file, "taut");
  hdf5::write_strings(ours, "object_names", mesh.object_names);
  std::vector<std::uint8_t> kinds;
  for (ObjectKind const kind : kinds_of(mesh)) kinds.push_back(static_cast<std::uint8_t>(kind));
  write_list<std::uint8_t>(ours, "object_kind", kinds);
  {
    const Handle start = hdf5::make_dataset(ours, "points", H5T_NATIVE_DOUBLE, {points, 3});
    hdf5::write_rows(start, H5T_NATIVE_DOUBLE, 0, points, mesh.mesh.points.data(), "points");
  }
  if (!mesh.scalars.empty()) hdf5::write_strings(ours, "scalars", mesh.scalars);
  if (mesh.growing) write_mesh(ours, mesh);
  make_tables(file, shape);
  hdf5::check(H5Lcreate_soft(tables[0], grid, "Steps", H5P_DEFAULT, H5P_DEFAULT), "Steps");

  reserve_frames(grid, "Points", points, capacity);
  const Handle point_data = hdf5::make_group(grid, "PointData");
  if (velocities) reserve_frames(point_data, "velocity", points, capacity);
  for (std::string const& name : mesh.scalars) {
    reserve_frames(point_data, name, points, capacity, false);
  }
  hdf5::check(H5Fflush(file, H5F_SCOPE_LOCAL), "the layout cannot be written");
}

}  // namespace taut::vtkhdf
