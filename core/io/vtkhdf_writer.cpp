// Writes results so that a kill between any two writes leaves a valid file.
//
// HDF5 updates its metadata in place, in many writes; a run killed among them can lose the whole
// file. (HDF5's own answer, SWMR mode, marks the file as open for writing: after a kill no viewer
// opens it until h5clear was run.) Here nothing that describes a finished frame is ever rewritten.
//
// First, all space is reserved when the file is laid out, under a temporary name. Appending then
// changes neither addresses nor sizes, only the bytes of the new frame's own rows.
//
// Second, the step table exists twice, and /VTKHDF/Steps is a soft link to the valid one. A frame
// writes its rows, then the table not in use, then turns the link. The link lies in the header of
// /VTKHDF, which HDF5 writes whole, and which fits the first page of the file: one write within one
// page, which the operating system does entirely or not at all.
//
// This orders the writes against a kill of the process. Against a failing machine there is the
// checkpoint (checkpoint.hpp), which waits for the disk.
#include <algorithm>
#include <array>
#include <taut/core/io/file.hpp>
#include <taut/core/io/hdf5.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/io/xdmf.hpp>

namespace taut {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;
using hdf5::Shape;

constexpr std::array tables{"/taut/steps_a", "/taut/steps_b"};
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
/// points of step k begin at row k N, its cells are always the first.
void make_tables(hid_t file, ResultMesh const& mesh, std::int64_t capacity, bool velocities) {
  const std::size_t points = mesh.mesh.points.size();
  const auto n = static_cast<std::size_t>(capacity);
  const std::vector<std::int64_t> zeros(n, 0);
  std::vector<std::int64_t> rows(n);
  for (std::size_t k = 0; k < n; ++k) rows[k] = static_cast<std::int64_t>(k * points);

  const Handle first = hdf5::make_group(file, tables[0]);
  write_list<std::int64_t>(first, "NumberOfParts", std::vector<std::int64_t>(n, 1));
  write_list<std::int64_t>(first, "PartOffsets", zeros);
  write_list<std::int64_t>(first, "PointOffsets", rows);
  for (char const* const name : {"CellOffsets", "ConnectivityIdOffsets"}) {
    hdf5::write_dataset<std::int64_t>(first, name, zeros, {n, 1});
  }
  const Handle point_data = hdf5::make_group(first, "PointDataOffsets");
  if (velocities) write_list<std::int64_t>(point_data, "velocity", rows);
  for (std::string const& name : mesh.scalars) write_list<std::int64_t>(point_data, name, rows);
  const Handle cell_data = hdf5::make_group(first, "CellDataOffsets");
  write_list<std::int64_t>(cell_data, "object", zeros);

  const Handle second = hdf5::make_group(file, tables[1]);
  for (char const* const name : {"NumberOfParts", "PartOffsets", "PointOffsets", "CellOffsets",
                                 "ConnectivityIdOffsets", "PointDataOffsets", "CellDataOffsets"}) {
    hdf5::check(H5Lcreate_hard(first, name, second, name, H5P_DEFAULT, H5P_DEFAULT), name);
  }
  const std::int64_t no_steps = 0;
  for (hid_t const table : {hid_t(first), hid_t(second)}) {
    make_times(table, capacity);
    hdf5::write_attribute(table, "NSteps", H5T_NATIVE_INT64, {}, &no_steps);
  }
}

void write_cells(hid_t grid, ResultMesh const& mesh) {
  const std::size_t solids = mesh.particles + mesh.mesh.tets.size(),
                    cells = solids + mesh.triangles.size();
  std::vector<std::int64_t> ids, offsets{0};
  ids.reserve(mesh.particles + 4 * mesh.mesh.tets.size() + 3 * mesh.triangles.size());
  offsets.reserve(cells + 1);
  const auto add = [&](auto const& cell) {
    ids.insert(ids.end(), cell.begin(), cell.end());
    offsets.push_back(static_cast<std::int64_t>(ids.size()));
  };
  for (std::size_t p = 0; p < mesh.particles; ++p) {
    add(std::array{static_cast<std::int64_t>(p)});
  }
  for (Tet const& tet : mesh.mesh.tets) add(tet);
  for (Triangle const& triangle : mesh.triangles) add(triangle);
  write_count(grid, "NumberOfCells", cells);
  write_count(grid, "NumberOfConnectivityIds", ids.size());
  write_list<std::int64_t>(grid, "Connectivity", ids);
  write_list<std::int64_t>(grid, "Offsets", offsets);
  std::vector<std::uint8_t> types(mesh.particles, vtk_vertex);
  types.resize(solids, vtk_tetra);
  types.resize(cells, vtk_triangle);
  write_list<std::uint8_t>(grid, "Types", types);
}

/// One per object.
std::vector<ObjectKind> kinds_of(ResultMesh const& mesh) {
  std::vector<ObjectKind> kinds;
  for (std::size_t i = 0; i < mesh.object_names.size(); ++i) kinds.push_back(mesh.kind(i));
  return kinds;
}

/// Writes a result without frames; `path` is valid only once this has returned.
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
  write_count(grid, "NumberOfPoints", points);
  write_cells(grid, mesh);
  const Handle cell_data = hdf5::make_group(grid, "CellData");
  write_list<std::int32_t>(cell_data, "object", mesh.object);

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
  make_tables(file, mesh, capacity, velocities);
  hdf5::check(H5Lcreate_soft(tables[0], grid, "Steps", H5P_DEFAULT, H5P_DEFAULT), "Steps");

  reserve_frames(grid, "Points", points, capacity);
  const Handle point_data = hdf5::make_group(grid, "PointData");
  if (velocities) reserve_frames(point_data, "velocity", points, capacity);
  for (std::string const& name : mesh.scalars) {
    reserve_frames(point_data, name, points, capacity, false);
  }
  hdf5::check(H5Fflush(file, H5F_SCOPE_LOCAL), "the layout cannot be written");
}

/// Throws Error when the disk cannot hold what lay_out() writes at once. HDF5 cannot close a file
/// after its disk ran full, so this is found out before.
void check_free_space(fs::path const& path, ResultMesh const& mesh, std::int64_t capacity) {
  const std::uintmax_t bytes =
      (1 << 16) + sizeof(Point) * mesh.mesh.points.size() +
      64 * (mesh.particles + mesh.mesh.tets.size() + mesh.triangles.size()) +
      64 * static_cast<std::uintmax_t>(capacity);
  std::error_code unknown;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const fs::space_info space = fs::space(folder, unknown);
  if (!unknown && space.available < bytes) {
    throw Error("it begins with {} bytes and the disk has room for {}", bytes, space.available);
  }
}

/// Puts a new file in place of `path`: `prepare` writes it under another name first.
template <class Prepare>
void replace_file(fs::path const& path, Prepare&& prepare) {
  const fs::path temporary = temporary_beside(path);
  try {
    prepare(temporary);
  } catch (Error const&) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
  move_into_place(temporary, path);
}

/// Runs `action`; its errors become those of `path`, with the mend.
template <class Action>
void name_errors(fs::path const& path, std::string const& what, Action&& action) {
  const hdf5::Quiet quiet;
  try {
    action();
  } catch (Error const& error) {
    throw Error("{}: {}, because {}; free disk space or choose another folder.", path.string(),
                what, error.what());
  }
}

}  // namespace

struct ResultWriter::File {
  explicit File(fs::path const& path) : path_(path), sidecar_(path, {}) { open(); }

  void open() {
    {
      // Closed before the file is opened for writing: HDF5 refuses both in one process.
      ResultReader const reader(path_);
      ResultMesh const& all = reader.mesh();
      shape_ = {all.mesh.points.size(),
                all.particles,
                all.mesh.tets.size(),
                all.triangles.size(),
                reader.capacity(),
                reader.has_velocities(),
                all.scalars};
      times_ = reader.times();
    }
    const hdf5::Quiet quiet;
    file_ = hdf5::open_file(path_, H5F_ACC_RDWR);
    grid_ = hdf5::open_group(file_, "VTKHDF");
    points_ = hdf5::open_dataset(grid_, "Points");
    if (shape_.velocities) velocity_ = hdf5::open_dataset(grid_, "PointData/velocity");
    scalars_.clear();
    for (std::string const& name : shape_.scalars) {
      scalars_.push_back(hdf5::open_dataset(grid_, "PointData/" + name));
    }
    std::array<char, 16> target{};
    hdf5::check(H5Lget_val(grid_, "Steps", target.data(), target.size(), H5P_DEFAULT), "Steps");
    in_use_ = std::string_view(target.data()) == tables[1] ? 1 : 0;
    sidecar_ = XdmfSidecar(path_, shape_);
  }

  /// Makes the first times_.size() frames the result.
  void commit() {
    const std::size_t next = 1 - in_use_;
    {
      const Handle table = hdf5::open_group(file_, tables[next]);
      const Handle values = hdf5::open_dataset(table, "Values");
      const hsize_t length = std::max<hsize_t>(1, times_.size());
      hdf5::check(H5Dset_extent(values, &length), "Values cannot be resized");
      hdf5::write_rows(values, H5T_NATIVE_DOUBLE, 0, times_.size(), times_.data(),
                       "the times cannot be written");
      hdf5::change_attribute(table, "NSteps", std::ssize(times_));
    }
    // Everything the link will lead to must be in the file before it does.
    hdf5::check(H5Fflush(file_, H5F_SCOPE_LOCAL), "the step table cannot be written");
    hdf5::check(H5Ldelete(grid_, "Steps", H5P_DEFAULT), "Steps");
    hdf5::check(H5Lcreate_soft(tables[next], grid_, "Steps", H5P_DEFAULT, H5P_DEFAULT), "Steps");
    hdf5::check(H5Fflush(file_, H5F_SCOPE_LOCAL), "the step cannot be made part of the result");
    in_use_ = next;
  }

  void write_frame(double time, std::span<Point const> positions, std::span<Point const> velocities,
                   std::span<std::vector<double> const> scalars) {
    const hsize_t row = times_.size() * shape_.points;
    hdf5::write_rows(points_, H5T_NATIVE_DOUBLE, row, shape_.points, positions.data(),
                     "the positions cannot be written");
    if (shape_.velocities) {
      hdf5::write_rows(velocity_, H5T_NATIVE_DOUBLE, row, shape_.points, velocities.data(),
                       "the velocities cannot be written");
    }
    for (std::size_t k = 0; k < scalars_.size(); ++k) {
      hdf5::write_rows(scalars_[k], H5T_NATIVE_DOUBLE, row, shape_.points, scalars[k].data(),
                       "the numbers of a frame cannot be written");
    }
    times_.push_back(time);
    commit();
  }

  /// Moves the result into a file laid out for more frames.
  void grow(std::int64_t capacity) {
    replace_file(path_, [&](fs::path const& larger) {
      ResultReader const reader(path_);
      lay_out(larger, reader.mesh(), capacity, shape_.velocities);
      File copy(larger);
      for (std::int64_t k = 0; k < std::ssize(times_); ++k) {
        const std::vector<Point> velocities =
            shape_.velocities ? reader.velocities(k) : std::vector<Point>{};
        std::vector<std::vector<double>> scalars;
        for (std::string const& name : shape_.scalars) scalars.push_back(reader.scalar(name, k));
        copy.write_frame(reader.times()[static_cast<std::size_t>(k)], reader.positions(k),
                         velocities, scalars);
      }
    });
    scalars_.clear();
    for (Handle* const handle : {&velocity_, &points_, &grid_, &file_}) handle->reset();
    open();
  }

  fs::path path_;
  ResultShape shape_;
  std::vector<double> times_;
  Handle file_;
  Handle grid_;
  Handle points_;
  Handle velocity_;
  std::vector<Handle> scalars_;
  std::size_t in_use_ = 0;  // which of `tables` /VTKHDF/Steps leads to
  XdmfSidecar sidecar_;
};

ResultWriter::ResultWriter(std::unique_ptr<File> file) : file_(std::move(file)) {}
ResultWriter::ResultWriter(ResultWriter&&) noexcept = default;
ResultWriter& ResultWriter::operator=(ResultWriter&&) noexcept = default;
ResultWriter::~ResultWriter() = default;

std::int64_t ResultWriter::frames() const { return std::ssize(file_->times_); }

ResultWriter ResultWriter::create(fs::path const& path, ResultMesh const& mesh,
                                  std::int64_t capacity, IfExists if_exists, bool velocities) {
  if (if_exists == IfExists::refuse && fs::exists(path)) {
    throw Error(
        "{}: a result exists here and is not overwritten; choose another folder, or give "
        "--force to replace it.",
        path.string());
  }
  if (mesh.object.size() != mesh.particles + mesh.mesh.tets.size() + mesh.triangles.size()) {
    throw Error(
        "{}: {} particles, {} tets and {} triangles have {} object numbers; give one for each.",
        path.string(), mesh.particles, mesh.mesh.tets.size(), mesh.triangles.size(),
        mesh.object.size());
  }
  if (mesh.particles > mesh.mesh.points.size()) {
    throw Error("{}: {} particles are more than the {} points.", path.string(), mesh.particles,
                mesh.mesh.points.size());
  }
  if (!mesh.object_kind.empty() && mesh.object_kind.size() != mesh.object_names.size()) {
    throw Error("{}: {} objects have {} kinds; give one for each, or none.", path.string(),
                mesh.object_names.size(), mesh.object_kind.size());
  }
  make_parent_folder(path);
  name_errors(path, "the result cannot be begun", [&] {
    const std::int64_t frames = std::max<std::int64_t>(1, capacity);
    check_free_space(path, mesh, frames);
    replace_file(path, [&](fs::path const& file) { lay_out(file, mesh, frames, velocities); });
  });
  ResultWriter writer(std::make_unique<File>(path));
  writer.file_->sidecar_.restart({});
  return writer;
}

ResultWriter ResultWriter::resume(fs::path const& path, ResultMesh const& mesh, std::int64_t frames,
                                  std::int64_t capacity) {
  auto file = std::make_unique<File>(path);
  {
    ResultReader const reader(path);
    ResultMesh const& old = reader.mesh();
    if (old.mesh.points.size() != mesh.mesh.points.size() || old.mesh.tets != mesh.mesh.tets ||
        old.triangles != mesh.triangles || old.object != mesh.object ||
        old.particles != mesh.particles || old.scalars != mesh.scalars ||
        old.object_names != mesh.object_names || old.object_kind != kinds_of(mesh)) {
      throw Error(
          "{}: this result is of another mesh or other objects; restart with the scene it "
          "was made from.",
          path.string());
    }
  }
  if (frames < 0 || frames > std::ssize(file->times_)) {
    throw Error(
        "{}: this result has {} frames, {} are needed to go on; restart from an earlier "
        "checkpoint.",
        path.string(), file->times_.size(), frames);
  }
  name_errors(path, "the result cannot be continued", [&] {
    file->times_.resize(static_cast<std::size_t>(frames));
    const std::int64_t room = std::max(capacity, file->shape_.capacity);
    bool whole = true;
    try {
      file->commit();
    } catch (Error const&) {
      // A kill can have torn the table that was not in use, if its header lies across two pages:
      // the frames are moved into a new file.
      whole = false;
    }
    if (!whole || room > file->shape_.capacity) file->grow(room);
  });
  file->sidecar_.restart(file->times_);
  return ResultWriter(std::move(file));
}

void ResultWriter::append(double time, std::span<Point const> positions,
                          std::span<Point const> velocities,
                          std::span<std::vector<double> const> scalars) {
  ResultShape const& shape = file_->shape_;
  const std::size_t expected = shape.velocities ? shape.points : 0;
  if (positions.size() != shape.points || velocities.size() != expected) {
    throw Error(
        "{}: a frame of {} positions and {} velocities does not fit this result of {} and "
        "{}.",
        file_->path_.string(), positions.size(), velocities.size(), shape.points, expected);
  }
  bool fits = scalars.size() == shape.scalars.size();
  for (std::vector<double> const& list : scalars) fits = fits && list.size() == shape.points;
  if (!fits) {
    throw Error("{}: a frame with {} lists of numbers does not fit this result of {}, of {} each.",
                file_->path_.string(), scalars.size(), shape.scalars.size(), shape.points);
  }
  const bool grows = frames() == shape.capacity;
  name_errors(file_->path_, fmt::format("frame {} cannot be written", frames()), [&] {
    if (grows) file_->grow(2 * shape.capacity);
    const std::size_t before = file_->times_.size();
    try {
      file_->write_frame(time, positions, velocities, scalars);
    } catch (Error const&) {
      file_->times_.resize(before);
      throw;
    }
  });
  if (grows) {
    file_->sidecar_.restart(file_->times_);
  } else {
    file_->sidecar_.append(time);
  }
}

}  // namespace taut
