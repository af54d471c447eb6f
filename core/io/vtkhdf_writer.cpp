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
// This orders the writes against a kill of the process. Against a failing machine there are the
// checkpoint (checkpoint.hpp) and, before it, sync(), which wait for the disk.
#include <algorithm>
#include <array>
#include <taut/core/io/file.hpp>
#include <taut/core/io/hdf5.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/io/vtkhdf_layout.hpp>
#include <taut/core/io/xdmf.hpp>

namespace taut {
namespace {

namespace fs = std::filesystem;
using hdf5::Handle;
using namespace vtkhdf;

/// Two growing meshes: whether one has all that the other has, and particles behind it.
bool same_but_for_growth(ResultMesh const& a, ResultMesh const& b) {
  const std::size_t both = std::min(a.particles, b.particles);
  const auto shift_of = [&](ResultMesh const& mesh) {
    return static_cast<std::int32_t>(mesh.particles);
  };
  if (a.triangles.size() != b.triangles.size() ||
      a.mesh.points.size() - a.particles != b.mesh.points.size() - b.particles ||
      !std::equal(a.object.begin(), a.object.begin() + static_cast<std::ptrdiff_t>(both),
                  b.object.begin())) {
    return false;
  }
  for (std::size_t t = 0; t < a.triangles.size(); ++t) {
    if (a.object[a.particles + t] != b.object[b.particles + t]) return false;
    for (std::size_t c = 0; c < 3; ++c) {
      if (a.triangles[t][c] - shift_of(a) != b.triangles[t][c] - shift_of(b)) return false;
    }
  }
  return true;
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
      // Closed before the file is opened for writing, which HDF5 refuses while the process has it
      // open for reading; behind a writer it lets a reader in.
      ResultReader const reader(path_);
      shape_ = shape_of(reader.mesh(), reader.capacity(), reader.has_velocities());
      times_ = reader.times();
      counts_.clear();
      for (std::int64_t k = 0; k < reader.frames(); ++k) counts_.push_back(reader.particles(k));
      if (shape_.growing) mesh_ = reader.mesh();
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
    const hsize_t row = times_.size() * shape_.points, rows = positions.size();
    hdf5::write_rows(points_, H5T_NATIVE_DOUBLE, row, rows, positions.data(),
                     "the positions cannot be written");
    if (shape_.velocities) {
      hdf5::write_rows(velocity_, H5T_NATIVE_DOUBLE, row, rows, velocities.data(),
                       "the velocities cannot be written");
    }
    for (std::size_t k = 0; k < scalars_.size(); ++k) {
      hdf5::write_rows(scalars_[k], H5T_NATIVE_DOUBLE, row, rows, scalars[k].data(),
                       "the numbers of a frame cannot be written");
    }
    const std::size_t particles = rows + shape_.particles - shape_.points;
    if (shape_.growing) write_cells_of_frame(particles);
    times_.push_back(time);
    counts_.push_back(particles);
    commit();
  }

  /// Of the frame behind the last one.
  void write_cells_of_frame(std::size_t particles) {
    const Cells cells(mesh_, particles);
    const hsize_t frame = times_.size();
    const auto write = [&](std::string const& name, auto const& list, hsize_t first) {
      using T = typename std::decay_t<decltype(list)>::value_type;
      hdf5::write_rows(hdf5::open_dataset(grid_, name), hdf5::memory_type<T>(), first, list.size(),
                       list.data(), "the cells of a frame cannot be written");
    };
    const auto count = [&](std::string const& name, std::size_t number) {
      write(name, std::vector<std::int64_t>{static_cast<std::int64_t>(number)}, frame);
    };
    write("Connectivity", cells.ids, frame * shape_.corners());
    write("Offsets", cells.offsets, frame * (shape_.cells() + 1));
    write("Types", cells.types, frame * shape_.cells());
    std::vector<std::int32_t> object(mesh_.object.begin(),
                                     mesh_.object.begin() + static_cast<std::ptrdiff_t>(particles));
    object.insert(object.end(), mesh_.object.begin() + static_cast<std::ptrdiff_t>(mesh_.particles),
                  mesh_.object.end());
    write("CellData/object", object, frame * shape_.cells());
    count("NumberOfPoints", shape_.points - shape_.particles + particles);
    count("NumberOfCells", cells.types.size());
    count("NumberOfConnectivityIds", cells.ids.size());
  }

  /// Moves the result into a file laid out for more frames, or of another growing mesh.
  void grow(std::int64_t capacity, ResultMesh const* mesh = nullptr) {
    replace_file(path_, [&](fs::path const& larger) {
      ResultReader const reader(path_);
      lay_out(larger, mesh ? *mesh : reader.mesh(), capacity, shape_.velocities);
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
  std::vector<std::size_t> counts_;  // particles of the frames
  ResultMesh mesh_;                  // of a growing result
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

// Every commit leaves nothing in HDF5's buffers.
void ResultWriter::sync() const { sync_file(file_->path_); }

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
  if (mesh.growing && (mesh.particles == 0 || !mesh.mesh.tets.empty())) {
    throw Error("{}: a result of {} particles and {} tets cannot grow: it has particles alone.",
                path.string(), mesh.particles, mesh.mesh.tets.size());
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
    const std::int64_t frames = std::clamp<std::int64_t>(capacity, 1, most_capacity);
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
    const bool same = mesh.growing && old.growing
                          ? same_but_for_growth(old, mesh)
                          : old.mesh.points.size() == mesh.mesh.points.size() &&
                                old.triangles == mesh.triangles && old.object == mesh.object &&
                                old.particles == mesh.particles && old.growing == mesh.growing;
    if (!same || old.mesh.tets != mesh.mesh.tets || old.scalars != mesh.scalars ||
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
    file->counts_.resize(file->times_.size());
    const std::int64_t room = std::max(std::min(capacity, most_capacity), file->shape_.capacity);
    bool whole = true;
    try {
      file->commit();
    } catch (Error const&) {
      // A kill can have torn the table that was not in use, if its header lies across two pages:
      // the frames are moved into a new file.
      whole = false;
    }
    const bool more = mesh.growing && mesh.particles > file->shape_.particles;
    if (!whole || more || room > file->shape_.capacity) file->grow(room, more ? &mesh : nullptr);
  });
  file->sidecar_.restart(file->times_, file->counts_);
  return ResultWriter(std::move(file));
}

void ResultWriter::append(double time, std::span<Point const> positions,
                          std::span<Point const> velocities,
                          std::span<std::vector<double> const> scalars) {
  ResultShape const& shape = file_->shape_;
  const std::size_t rows = positions.size(), least = shape.points - shape.particles;
  const std::size_t expected = shape.velocities ? rows : 0;
  if (!(shape.growing ? rows >= least && rows <= shape.points : rows == shape.points) ||
      velocities.size() != expected) {
    throw Error(
        "{}: a frame of {} positions and {} velocities does not fit this result of {} and "
        "{}.",
        file_->path_.string(), rows, velocities.size(), shape.points,
        shape.velocities ? shape.points : 0);
  }
  bool fits = scalars.size() == shape.scalars.size();
  for (std::vector<double> const& list : scalars) fits = fits && list.size() == rows;
  if (!fits) {
    throw Error("{}: a frame with {} lists of numbers does not fit this result of {}, of {} each.",
                file_->path_.string(), scalars.size(), shape.scalars.size(), rows);
  }
  const bool grows = frames() == shape.capacity;
  name_errors(file_->path_, fmt::format("frame {} cannot be written", frames()), [&] {
    if (grows) file_->grow(2 * shape.capacity);
    const std::size_t before = file_->times_.size();
    try {
      file_->write_frame(time, positions, velocities, scalars);
    } catch (Error const&) {
      file_->times_.resize(before);
      file_->counts_.resize(before);
      throw;
    }
  });
  if (grows) {
    file_->sidecar_.restart(file_->times_, file_->counts_);
  } else {
    file_->sidecar_.append(time, file_->counts_.back());
  }
}

}  // namespace taut
