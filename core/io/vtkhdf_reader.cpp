#include <algorithm>
#include <array>
#include <cstring>
#include <taut/core/io/file.hpp>
#include <taut/core/io/hdf5.hpp>
#include <taut/core/io/vtkhdf.hpp>

namespace taut {
namespace {

using hdf5::Handle;

constexpr std::uint8_t vtk_vertex = 1, vtk_triangle = 5, vtk_tetra = 10;

std::vector<Point> read_points(hid_t dataset, std::int64_t first, std::size_t rows) {
  std::vector<Point> points(rows);
  hdf5::read_rows(dataset, H5T_NATIVE_DOUBLE, static_cast<hsize_t>(first), rows, points.data(),
                  "a frame cannot be read");
  return points;
}

/// Throws Error unless `dataset` holds one vector, or one number, per point and frame; in a growing
/// result there is room for as many.
void check_shape(hid_t dataset, std::size_t points, std::int64_t frames, bool vectors = true) {
  const hdf5::Shape shape = hdf5::shape_of(dataset);
  hdf5::stored_values(dataset, "its point data");
  const std::size_t room = points == 0 ? 0 : shape.at(0) / points;
  const bool right = vectors ? shape.size() == 2 && shape[1] == 3 : shape.size() == 1;
  if (!right || room < static_cast<std::size_t>(frames)) {
    throw Error("its point data have another size than its steps need");
  }
}

/// The numbers of particles, of the tets behind them, and of the triangles behind these.
std::array<std::size_t, 3> count_cells(std::vector<std::uint8_t> const& types) {
  std::array<std::size_t, 3> counts{};
  std::size_t sum = 0;
  for (std::size_t kind = 0; kind < 3; ++kind) {
    const std::uint8_t type = std::array{vtk_vertex, vtk_tetra, vtk_triangle}[kind];
    while (sum < types.size() && types[sum] == type) ++sum, ++counts[kind];
  }
  if (sum != types.size())
    throw Error("its cells are not particles, tets and triangles, in this order");
  return counts;
}

/// Results of before there were obstacles have no kinds.
std::vector<ObjectKind> read_kinds(hid_t file, std::size_t objects) {
  std::vector<ObjectKind> kinds(objects, ObjectKind::body);
  if (H5Lexists(file, "taut/object_kind", H5P_DEFAULT) <= 0) return kinds;
  const auto numbers = hdf5::read_dataset<std::uint8_t>(file, "taut/object_kind");
  if (numbers.size() != objects) throw Error("not every object has a kind");
  for (std::size_t i = 0; i < objects; ++i) {
    if (numbers[i] > static_cast<std::uint8_t>(ObjectKind::drawn_only)) {
      throw Error("there is no kind {} of objects", numbers[i]);
    }
    kinds[i] = static_cast<ObjectKind>(numbers[i]);
  }
  return kinds;
}

ResultMesh read_mesh(hid_t file) {
  ResultMesh result;
  const Handle points = hdf5::open_dataset(file, "taut/points");
  const hdf5::Shape shape = hdf5::shape_of(points);
  if (shape.size() != 2 || shape[1] != 3) throw Error("its points are not in three dimensions");
  hdf5::stored_values(points, "its points");
  result.mesh.points = read_points(points, 0, shape[0]);
  result.object_names = hdf5::read_strings(file, "taut/object_names");
  result.object_kind = read_kinds(file, result.object_names.size());
  result.growing = H5Lexists(file, "taut/growing", H5P_DEFAULT) > 0;
  result.object = hdf5::read_dataset<std::int32_t>(
      file, result.growing ? "taut/object" : "VTKHDF/CellData/object");
  const auto below = [](std::vector<std::int32_t> const& numbers, std::size_t end) {
    return std::all_of(numbers.begin(), numbers.end(), [&](std::int32_t number) {
      return number >= 0 && static_cast<std::size_t>(number) < end;
    });
  };
  if (!below(result.object, result.object_names.size()))
    throw Error("its cells are of objects that do not exist");
  if (H5Lexists(file, "taut/scalars", H5P_DEFAULT) > 0) {
    result.scalars = hdf5::read_strings(file, "taut/scalars");
  }
  if (result.growing) {
    const auto count = hdf5::read_dataset<std::int64_t>(file, "taut/growing");
    const auto corners = hdf5::read_dataset<std::int32_t>(file, "taut/triangles");
    if (count.size() != 1 || count[0] < 0 ||
        static_cast<std::size_t>(count[0]) > result.mesh.points.size() || corners.size() % 3 != 0 ||
        result.object.size() != static_cast<std::size_t>(count[0]) + corners.size() / 3 ||
        !below(corners, result.mesh.points.size())) {
      throw Error("its cells are not those of its points");
    }
    result.particles = static_cast<std::size_t>(count[0]);
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      result.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
    }
    return result;
  }

  const auto types = hdf5::read_dataset<std::uint8_t>(file, "VTKHDF/Types");
  const auto [particles, tets, triangles] = count_cells(types);
  const auto ids = hdf5::read_dataset<std::int32_t>(file, "VTKHDF/Connectivity");
  const std::size_t of_tets = particles, of_triangles = particles + 4 * tets;
  if (!below(ids, result.mesh.points.size()) || ids.size() != of_triangles + 3 * triangles ||
      types.size() != result.object.size()) {
    throw Error("its cells are not those of its points");
  }
  result.particles = particles;
  result.mesh.tets.reserve(tets);
  for (std::size_t i = of_tets; i < of_triangles; i += 4) {
    result.mesh.tets.push_back({ids[i], ids[i + 1], ids[i + 2], ids[i + 3]});
  }
  result.triangles.reserve(triangles);
  for (std::size_t i = of_triangles; i < ids.size(); i += 3) {
    result.triangles.push_back({ids[i], ids[i + 1], ids[i + 2]});
  }
  return result;
}

}  // namespace

struct ResultReader::File {
  explicit File(std::filesystem::path const& path) : path_(path) {
    const hdf5::Quiet quiet;
    try {
      file_ = hdf5::open_file(path, H5F_ACC_RDONLY);
      mesh_ = read_mesh(file_);
      const Handle steps = hdf5::open_group(file_, "VTKHDF/Steps");
      const std::int64_t frames = hdf5::read_attribute(steps, "NSteps");
      times_ = hdf5::read_dataset<double>(steps, "Values");
      if (frames < 0 || frames > std::ssize(times_)) throw Error("its steps and times differ");
      times_.resize(static_cast<std::size_t>(frames));
      points_ = hdf5::open_dataset(file_, "VTKHDF/Points");
      check_shape(points_, mesh_.mesh.points.size(), frames);
      capacity_ = static_cast<std::int64_t>(
          hdf5::shape_of(hdf5::open_dataset(steps, "PointOffsets")).at(0));
      const Handle point_data = hdf5::open_group(file_, "VTKHDF/PointData");
      if (H5Lexists(point_data, "velocity", H5P_DEFAULT) > 0) {
        velocity_ = hdf5::open_dataset(point_data, "velocity");
        check_shape(velocity_, mesh_.mesh.points.size(), frames);
      }
      for (std::string const& name : mesh_.scalars) {
        scalars_.push_back(hdf5::open_dataset(point_data, name));
        check_shape(scalars_.back(), mesh_.mesh.points.size(), frames, false);
      }
      if (mesh_.growing) read_counts(frames);
    } catch (Error const& error) {
      throw Error(
          "{}: this is no result of a run that can be read, because {}; name the .vtkhdf "
          "file that 'run' wrote.",
          path.string(), error.what());
    }
  }

  /// How many points the frames of a growing result have.
  void read_counts(std::int64_t frames) {
    const auto numbers = hdf5::read_dataset<std::int64_t>(file_, "VTKHDF/NumberOfPoints");
    const std::size_t all = mesh_.mesh.points.size(), least = all - mesh_.particles;
    if (std::ssize(numbers) < frames) throw Error("not every frame says how many points it has");
    for (std::int64_t k = 0; k < frames; ++k) {
      const auto count = static_cast<std::size_t>(numbers[static_cast<std::size_t>(k)]);
      if (count < least || count > all) throw Error("frame {} has {} of {} points", k, count, all);
      counts_.push_back(count);
    }
  }
  std::size_t points_of(std::int64_t frame) const {
    require(frame);
    return mesh_.growing ? counts_[static_cast<std::size_t>(frame)] : mesh_.mesh.points.size();
  }

  void require(std::int64_t frame) const {
    if (frame >= 0 && frame < std::ssize(times_)) return;
    throw Error("{}: there is no frame {}, the result has {} (counted from 0).", path_.string(),
                frame, times_.size());
  }
  std::vector<Point> read(hid_t dataset, std::int64_t frame) const {
    const std::size_t count = points_of(frame);
    const hdf5::Quiet quiet;
    return read_points(dataset, frame * std::ssize(mesh_.mesh.points), count);
  }
  std::vector<double> read_numbers(hid_t dataset, std::int64_t frame) const {
    std::vector<double> numbers(points_of(frame));
    const hdf5::Quiet quiet;
    hdf5::read_rows(dataset, H5T_NATIVE_DOUBLE,
                    static_cast<hsize_t>(frame) * mesh_.mesh.points.size(), numbers.size(),
                    numbers.data(), "a frame cannot be read");
    return numbers;
  }

  std::filesystem::path path_;
  Handle file_;
  Handle points_;
  Handle velocity_;
  std::vector<Handle> scalars_;  ///< of mesh_.scalars
  ResultMesh mesh_;
  std::vector<double> times_;
  std::vector<std::size_t> counts_;  ///< points of the frames of a growing result
  std::int64_t capacity_ = 0;
};

ResultReader::ResultReader(std::filesystem::path const& path) {
  if (!std::filesystem::exists(path)) {
    throw Error("{}: there is no such result (looked for {}); correct the name or run the scene.",
                path.string(), std::filesystem::absolute(path).string());
  }
  file_ = std::make_unique<File>(path);
}
ResultReader::ResultReader(ResultReader&&) noexcept = default;
ResultReader& ResultReader::operator=(ResultReader&&) noexcept = default;
ResultReader::~ResultReader() = default;

std::int64_t ResultReader::frames() const { return std::ssize(file_->times_); }
std::int64_t ResultReader::capacity() const { return file_->capacity_; }
std::vector<double> const& ResultReader::times() const { return file_->times_; }
ResultMesh const& ResultReader::mesh() const { return file_->mesh_; }
bool ResultReader::has_velocities() const { return file_->velocity_ >= 0; }
std::size_t ResultReader::particles(std::int64_t frame) const {
  ResultMesh const& all = file_->mesh_;
  return all.particles + file_->points_of(frame) - all.mesh.points.size();
}

std::vector<Point> ResultReader::positions(std::int64_t frame) const {
  return file_->read(file_->points_, frame);
}

std::vector<Point> ResultReader::velocities(std::int64_t frame) const {
  if (!has_velocities()) {
    throw Error("{}: this result was written without velocities.", file_->path_.string());
  }
  return file_->read(file_->velocity_, frame);
}

std::vector<double> ResultReader::scalar(std::string const& name, std::int64_t frame) const {
  std::vector<std::string> const& names = file_->mesh_.scalars;
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw Error("{}: this result was written without \"{}\".", file_->path_.string(), name);
  }
  return file_->read_numbers(file_->scalars_[static_cast<std::size_t>(found - names.begin())],
                             frame);
}

}  // namespace taut
