// The result file: what is written is read back bitwise, and its layout is VTKHDF's.
#include <fcntl.h>
#include <hdf5.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/generators/catch_generators.hpp>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <fstream>
#include <taut/core/io/file.hpp>
#include <taut/core/io/vtkhdf.hpp>

using namespace taut;
using namespace taut::test;

namespace {

ResultMesh sample() { return {two_tets(), {0, 1}, {"left & right", "größer"}}; }

/// With the triangles of an obstacle and of one that is only drawn; no points are added, so that
/// the same frames fit.
ResultMesh mixed_sample() {
  return {two_tets(),
          {0, 1, 2, 3, 3},
          {"left & right", "größer", "bowl", "floor"},
          {{0, 1, 2}, {1, 3, 4}, {2, 1, 4}},
          {ObjectKind::body, ObjectKind::body, ObjectKind::obstacle, ObjectKind::drawn_only}};
}

void check_same(ResultMesh const& a, ResultMesh const& b) {
  CHECK(a.mesh.points == b.mesh.points);
  CHECK(a.mesh.tets == b.mesh.tets);
  CHECK(a.triangles == b.triangles);
  CHECK(a.object == b.object);
  CHECK(a.object_names == b.object_names);
  for (std::size_t i = 0; i < a.object_names.size(); ++i) CHECK(a.kind(i) == b.kind(i));
}

/// Positions or velocities of frame k of the sample: other numbers everywhere.
std::vector<Point> frame(int k, double sign) {
  std::vector<Point> points = two_tets().points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a)
      points[i][a] += sign * (k + 0.1 * double(i) + 0.01 * double(a));
  }
  return points;
}

void append_frames(ResultWriter& writer, int first, int end) {
  for (int k = first; k < end; ++k) writer.append(k / 60.0, frame(k, 1), frame(k, -1));
}

/// A result with room for 5 frames.
void write_result(std::filesystem::path const& path, int frames) {
  auto writer = ResultWriter::create(path, sample(), 5, ResultWriter::IfExists::refuse);
  append_frames(writer, 0, frames);
}

void check_frames(std::filesystem::path const& path, int count) {
  const ResultReader reader(path);
  REQUIRE(reader.frames() == count);
  REQUIRE(reader.times().size() == static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    CHECK(reader.times()[static_cast<std::size_t>(k)] == k / 60.0);
    CHECK(reader.positions(k) == frame(k, 1));
    CHECK(reader.velocities(k) == frame(k, -1));
  }
}

std::vector<std::int64_t> integers(hid_t file, std::string const& name) {
  const hid_t dataset = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  REQUIRE(dataset >= 0);
  const hid_t space = H5Dget_space(dataset);
  std::vector<std::int64_t> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  CHECK(H5Dread(dataset, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
  H5Sclose(space);
  H5Dclose(dataset);
  return values;
}

std::vector<std::int64_t> integer_attribute(hid_t file, std::string const& object,
                                            char const* name) {
  const hid_t attribute = H5Aopen_by_name(file, object.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
  REQUIRE(attribute >= 0);
  const hid_t space = H5Aget_space(attribute);
  std::vector<std::int64_t> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  CHECK(H5Aread(attribute, H5T_NATIVE_INT64, values.data()) >= 0);
  H5Sclose(space);
  H5Aclose(attribute);
  return values;
}

std::vector<hsize_t> shape(hid_t file, std::string const& name) {
  const hid_t dataset = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  REQUIRE(dataset >= 0);
  const hid_t space = H5Dget_space(dataset);
  std::vector<hsize_t> dims(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  H5Sclose(space);
  H5Dclose(dataset);
  return dims;
}

}  // namespace

TEST_CASE("frames, mesh and names are read back bitwise") {
  const Folder folder;
  const auto path = folder / "deep/er/result.vtkhdf";
  auto writer = ResultWriter::create(path, sample(), 4, ResultWriter::IfExists::refuse);
  check_frames(path, 0);
  append_frames(writer, 0, 3);
  CHECK(writer.frames() == 3);
  check_frames(path, 3);  // while the writer lives
  const ResultReader reader(path);
  check_same(reader.mesh(), sample());
  CHECK(reader.capacity() == 4);
}

TEST_CASE("a result without velocities says so") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  auto writer = ResultWriter::create(path, sample(), 2, ResultWriter::IfExists::refuse, false);
  writer.append(0, frame(0, 1), {});
  const ResultReader reader(path);
  CHECK_FALSE(reader.has_velocities());
  CHECK(reader.positions(0) == frame(0, 1));
  check_says(sentence([&] { reader.velocities(0); }), {path.string(), "without velocities"});
}

TEST_CASE("a result grows beyond the frames it was laid out for") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  auto writer = ResultWriter::create(path, sample(), 2, ResultWriter::IfExists::refuse);
  append_frames(writer, 0, 11);
  check_frames(path, 11);
  CHECK(ResultReader(path).capacity() == 16);
  // Nothing but the result and its sidecar is left behind.
  const auto entries = std::filesystem::directory_iterator(folder.path());
  CHECK(std::distance(begin(entries), end(entries)) == 2);
}

TEST_CASE("a result of very many frames is laid out for some of them", "[io][result]") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  constexpr std::int64_t very_many = 100'000'000;
  {
    auto writer = ResultWriter::create(path, sample(), very_many, ResultWriter::IfExists::refuse);
    append_frames(writer, 0, 3);
    writer.sync();
  }
  CHECK(ResultReader(path).capacity() == ResultWriter::most_capacity);
  CHECK(std::filesystem::file_size(path) < 1 << 28);
  auto writer = ResultWriter::resume(path, sample(), 2, very_many);
  append_frames(writer, 2, 3);
  check_frames(path, 3);
  CHECK(ResultReader(path).capacity() == ResultWriter::most_capacity);
}

TEST_CASE("a result that is gone cannot wait for the disk", "[io][result]") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  auto writer = ResultWriter::create(path, sample(), 2, ResultWriter::IfExists::refuse);
  CHECK_NOTHROW(writer.sync());
  std::filesystem::remove(path);
  check_says(sentence([&] { writer.sync(); }), {path.string(), "cannot be written to the disk"});
}

TEST_CASE("a resumed result drops later frames and ends as an uninterrupted one") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  write_result(path, 5);
  for (const std::int64_t capacity : {5, 9}) {
    {
      auto writer = ResultWriter::resume(path, sample(), 2, capacity);
      CHECK(writer.frames() == 2);
      check_frames(path, 2);
      append_frames(writer, 2, 7);
    }
    check_frames(path, 7);
  }
}

TEST_CASE("a step table that a kill has torn does not stop a resumed run") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  write_result(path, 2);
  // Two frames have turned the link twice: the table b is not in use.
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  H5O_info_t info;
  REQUIRE(H5Oget_info_by_name(file, "taut/steps_b", &info, H5P_DEFAULT) >= 0);
  H5Fclose(file);
  std::string bytes = read_file(path);
  bytes[info.addr + 20] ^= 0x55;
  write_file_atomically(path, bytes);
  CHECK(in_own_process([&] {
          auto writer = ResultWriter::resume(path, sample(), 2, 5);
          append_frames(writer, 2, 4);
          return 0;
        }) == 0);
  check_frames(path, 4);
}

TEST_CASE("triangles of obstacles are read back, resumed and grown with the tets") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  {
    auto writer = ResultWriter::create(path, mixed_sample(), 2, ResultWriter::IfExists::refuse);
    append_frames(writer, 0, 5);
  }
  CHECK(ResultReader(path).capacity() == 8);
  check_same(ResultReader(path).mesh(), mixed_sample());
  check_frames(path, 5);
  {
    auto writer = ResultWriter::resume(path, mixed_sample(), 3, 20);
    append_frames(writer, 3, 7);
  }
  check_frames(path, 7);
  check_same(ResultReader(path).mesh(), mixed_sample());
}

TEST_CASE("a result of other triangles or kinds is not resumed") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  ResultWriter::create(path, mixed_sample(), 2, ResultWriter::IfExists::refuse);
  ResultMesh other = mixed_sample();
  SECTION("triangles") { std::swap(other.triangles[0], other.triangles[1]); }
  SECTION("their objects") { other.object[3] = 2; }
  SECTION("kinds") { other.object_kind[2] = ObjectKind::drawn_only; }
  SECTION("no kinds") { other.object_kind.clear(); }
  check_says(sentence([&] { ResultWriter::resume(path, other, 0, 2); }), {"another mesh"});
  ResultWriter::resume(path, mixed_sample(), 0, 2);
}

TEST_CASE("objects and kinds that do not fit the cells are refused") {
  const Folder folder;
  const auto begin = [&](ResultMesh const& mesh) {
    return sentence([&] {
      ResultWriter::create(folder / "result.vtkhdf", mesh, 2, ResultWriter::IfExists::refuse);
    });
  };
  ResultMesh mesh = mixed_sample();
  mesh.object.pop_back();
  check_says(begin(mesh), {"2 tets and 3 triangles have 4 object numbers"});
  mesh = mixed_sample();
  mesh.object_kind.pop_back();
  check_says(begin(mesh), {"4 objects have 3 kinds"});
}

TEST_CASE("a result from before there were obstacles is read and goes on") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  write_result(path, 2);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(file >= 0);
  REQUIRE(H5Ldelete(file, "taut/object_kind", H5P_DEFAULT) >= 0);
  H5Fclose(file);
  check_same(ResultReader(path).mesh(), sample());
  {
    auto writer = ResultWriter::resume(path, sample(), 2, 9);
    append_frames(writer, 2, 6);
  }
  check_frames(path, 6);
}

TEST_CASE("an existing result is never overwritten unasked") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  write_result(path, 2);
  check_says(
      sentence([&] { ResultWriter::create(path, sample(), 5, ResultWriter::IfExists::refuse); }),
      {path.string(), "--force"});
  check_frames(path, 2);
  ResultWriter::create(path, sample(), 5, ResultWriter::IfExists::replace);
  check_frames(path, 0);
}

TEST_CASE("equal runs leave equal files") {
  const Folder folder;
  for (char const* const name : {"a.vtkhdf", "b.vtkhdf"}) {
    auto writer = ResultWriter::create(folder / name, sample(), 5, ResultWriter::IfExists::refuse);
    append_frames(writer, 0, 4);
  }
  CHECK(read_file(folder / "a.vtkhdf") == read_file(folder / "b.vtkhdf"));
  // Also where they are not of the same second: nothing is stamped, the root group neither.
  const hid_t file = H5Fopen((folder / "a.vtkhdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  H5O_info_t info;
  REQUIRE(H5Oget_info(file, &info) >= 0);
  H5Fclose(file);
  CHECK(info.ctime == 0);
  CHECK(info.mtime == 0);
}

TEST_CASE("the layout is VTKHDF's: unstructured grid, static topology, steps") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  const int capacity = 6;
  {
    auto writer = ResultWriter::create(path, sample(), capacity, ResultWriter::IfExists::refuse);
    append_frames(writer, 0, 3);
  }
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  CHECK(integer_attribute(file, "VTKHDF", "Version") == std::vector<std::int64_t>{2, 0});
  const hid_t type = H5Aopen_by_name(file, "VTKHDF", "Type", H5P_DEFAULT, H5P_DEFAULT);
  const hid_t text = H5Aget_type(type);
  CHECK(H5Tget_class(text) == H5T_STRING);
  CHECK(H5Tis_variable_str(text) == 0);  // VTK insists on it
  std::string name(H5Tget_size(text), '\0');
  CHECK(H5Aread(type, text, name.data()) >= 0);
  CHECK(name == "UnstructuredGrid");
  H5Tclose(text);
  H5Aclose(type);

  using List = std::vector<std::int64_t>;
  CHECK(integers(file, "VTKHDF/NumberOfPoints") == List{5});
  CHECK(integers(file, "VTKHDF/NumberOfCells") == List{2});
  CHECK(integers(file, "VTKHDF/NumberOfConnectivityIds") == List{8});
  CHECK(integers(file, "VTKHDF/Connectivity") == List{0, 1, 2, 3, 0, 2, 1, 4});
  CHECK(integers(file, "VTKHDF/Offsets") == List{0, 4, 8});
  CHECK(integers(file, "VTKHDF/Types") == List{10, 10});
  CHECK(integers(file, "VTKHDF/CellData/object") == List{0, 1});
  CHECK(shape(file, "VTKHDF/Points") == std::vector<hsize_t>{5 * capacity, 3});
  CHECK(shape(file, "VTKHDF/PointData/velocity") == std::vector<hsize_t>{5 * capacity, 3});

  CHECK(integer_attribute(file, "VTKHDF/Steps", "NSteps") == List{3});
  // Exactly as many times as steps: VTK copies them all into room for NSteps.
  CHECK(shape(file, "VTKHDF/Steps/Values") == std::vector<hsize_t>{3});
  const List rows{0, 5, 10, 15, 20, 25};
  CHECK(integers(file, "VTKHDF/Steps/PointOffsets") == rows);
  CHECK(integers(file, "VTKHDF/Steps/PointDataOffsets/velocity") == rows);
  for (char const* const zero :
       {"PartOffsets", "CellOffsets", "ConnectivityIdOffsets", "CellDataOffsets/object"}) {
    CHECK(integers(file, std::string("VTKHDF/Steps/") + zero) == List(capacity, 0));
  }
  CHECK(shape(file, "VTKHDF/Steps/CellOffsets") == std::vector<hsize_t>{capacity, 1});
  CHECK(integers(file, "VTKHDF/Steps/NumberOfParts") == List(capacity, 1));

  // What a step commits is one write within one page: the header of /VTKHDF.
  H5O_info_t info;
  REQUIRE(H5Oget_info_by_name(file, "VTKHDF", &info, H5P_DEFAULT) >= 0);
  CHECK(info.hdr.nchunks == 1);
  CHECK(info.addr + info.hdr.space.total <= 4096);
  H5Fclose(file);
}

TEST_CASE("tets and triangles are cells of one grid, the tets first") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  {
    auto writer = ResultWriter::create(path, mixed_sample(), 3, ResultWriter::IfExists::refuse);
    append_frames(writer, 0, 2);
  }
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(file >= 0);
  using List = std::vector<std::int64_t>;
  CHECK(integers(file, "VTKHDF/NumberOfPoints") == List{5});
  CHECK(integers(file, "VTKHDF/NumberOfCells") == List{5});
  CHECK(integers(file, "VTKHDF/NumberOfConnectivityIds") == List{17});
  CHECK(integers(file, "VTKHDF/Connectivity") ==
        List{0, 1, 2, 3, 0, 2, 1, 4, 0, 1, 2, 1, 3, 4, 2, 1, 4});
  CHECK(integers(file, "VTKHDF/Offsets") == List{0, 4, 8, 11, 14, 17});
  CHECK(integers(file, "VTKHDF/Types") == List{10, 10, 5, 5, 5});
  CHECK(integers(file, "VTKHDF/CellData/object") == List{0, 1, 2, 3, 3});
  CHECK(integers(file, "taut/object_kind") == List{0, 0, 1, 2});
  CHECK(integers(file, "VTKHDF/Steps/PointOffsets") == List{0, 5, 10});
  CHECK(integers(file, "VTKHDF/Steps/ConnectivityIdOffsets") == List{0, 0, 0});
  H5Fclose(file);
  // The sidecar shows the tets: the first 8 of 17 numbers of vertices, the first 2 of 5 objects.
  check_says(read_file(folder / "result.xdmf"),
             {"NumberOfElements=\"2\"><DataItem ItemType=\"HyperSlab\" Dimensions=\"8\">",
              ">0 1 8<", "<DataItem Dimensions=\"17\"", ">0 1 2<", "<DataItem Dimensions=\"5\""});
}

TEST_CASE("cells in another order than particles, tets and triangles are no result") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  ResultWriter::create(path, mixed_sample(), 2, ResultWriter::IfExists::refuse);
  const auto [name, at, value, reason] = GENERATE(table<char const*, int, int, char const*>(
      {{"VTKHDF/Types", 0, 5, "not particles, tets and triangles, in this order"},
       {"VTKHDF/Types", 4, 12, "not particles, tets and triangles, in this order"},
       {"VTKHDF/Types", 2, 10, "not those of its points"},
       {"VTKHDF/CellData/object", 4, 4, "objects that do not exist"},
       {"VTKHDF/Connectivity", 16, 5, "not those of its points"},
       {"taut/object_kind", 1, 3, "no kind 3"}}));
  INFO(name);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(file >= 0);
  std::vector<std::int64_t> values = integers(file, name);
  values.at(static_cast<std::size_t>(at)) = value;
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  CHECK(H5Dwrite(dataset, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
  H5Dclose(dataset);
  H5Fclose(file);
  check_says(sentence([&] { ResultReader reader(path); }), {path.string(), "no result", reason});
}

TEST_CASE("the sidecar names every finished frame's rows") {
  const Folder folder;
  auto writer =
      ResultWriter::create(folder / "a&b.vtkhdf", sample(), 3, ResultWriter::IfExists::refuse);
  append_frames(writer, 0, 2);
  const std::string xml = read_file(folder / "a&b.xdmf");
  check_says(xml, {"<Grid Name=\"frame 0\"><Time Value=\"0\"/>", "<Grid Name=\"frame 1\">",
                   "Format=\"XML\">5 0 1 1 5 3<", "Dimensions=\"15 3\"",
                   "a&amp;b.vtkhdf:/VTKHDF/PointData/velocity", "</Xdmf>"});
  CHECK(xml.find("frame 2") == std::string::npos);
}

TEST_CASE("a viewer that holds the file open does not stop the run") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  auto writer = ResultWriter::create(path, sample(), 3, ResultWriter::IfExists::refuse);
  const int viewer = ::open(path.c_str(), O_RDONLY);
  REQUIRE(::flock(viewer, LOCK_SH | LOCK_NB) == 0);  // as HDF5 takes it to read
  append_frames(writer, 0, 2);
  writer = ResultWriter::resume(path, sample(), 1, 3);
  append_frames(writer, 1, 3);
  ::close(viewer);
  check_frames(path, 3);
}

TEST_CASE("what is no result, or not this one, is refused with a sentence") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  check_says(sentence([&] { ResultReader reader(path); }), {path.string(), "looked for"});
  write_file_atomically(path, "no HDF5");
  check_says(sentence([&] { ResultReader reader(path); }), {path.string(), "no result"});
  check_says(sentence([&] { ResultWriter::resume(path, sample(), 0, 2); }), {"no result"});

  auto writer = ResultWriter::create(path, sample(), 2, ResultWriter::IfExists::replace);
  append_frames(writer, 0, 2);
  std::vector<Point> few(3);
  check_says(sentence([&] { writer.append(1, few, few); }), {"3 positions", "5"});
  check_says(sentence([&] { ResultReader(path).positions(2); }), {"no frame 2", "has 2"});
  check_says(sentence([&] { ResultReader(path).positions(-1); }), {"no frame -1"});
  check_says(sentence([&] { ResultWriter::resume(path, sample(), 3, 5); }),
             {"has 2 frames", "3 are needed"});
  ResultMesh other = sample();
  std::swap(other.mesh.tets[0], other.mesh.tets[1]);
  check_says(sentence([&] { ResultWriter::resume(path, other, 1, 5); }), {"another mesh"});
  check_frames(path, 2);

  // A file in place of the folder.
  check_says(sentence([&] {
               ResultWriter::create(path / "deeper.vtkhdf", sample(), 2,
                                    ResultWriter::IfExists::refuse);
             }),
             {"folder", path.string()});
}

TEST_CASE("a result of particles carries numbers, and triangles behind them", "[io][result]") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  ResultMesh mesh{{two_tets().points, {}},
                  {0, 0, 1, 2},
                  {"sand", "stone", "wall"},
                  {{0, 1, 2}},
                  {ObjectKind::body, ObjectKind::body, ObjectKind::drawn_only},
                  3,
                  {"J", "plastic"}};
  const std::size_t n = mesh.mesh.points.size();
  const auto numbers = [&](int k) {
    std::vector<std::vector<double>> lists(2, std::vector<double>(n));
    for (std::size_t p = 0; p < n; ++p)
      lists[0][p] = k + 0.1 * double(p), lists[1][p] = -k - double(p);
    return lists;
  };
  {
    auto writer = ResultWriter::create(path, mesh, 2, ResultWriter::IfExists::refuse);
    for (int k = 0; k < 3; ++k) writer.append(k / 60.0, frame(k, 1), frame(k, -1), numbers(k));
    CHECK_THROWS_AS(writer.append(1, frame(3, 1), frame(3, -1)), Error);
  }
  {
    auto writer = ResultWriter::resume(path, mesh, 2, 9);  // grows
    writer.append(7 / 60.0, frame(7, 1), frame(7, -1), numbers(7));
    mesh.scalars.pop_back();
    CHECK_THROWS_AS(ResultWriter::resume(path, mesh, 2, 9), Error);
    mesh.scalars.push_back("plastic");
  }
  const ResultReader reader(path);
  check_same(reader.mesh(), mesh);
  CHECK(reader.mesh().particles == 3);
  CHECK(reader.mesh().scalars == mesh.scalars);
  REQUIRE(reader.frames() == 3);
  const int kept[] = {0, 1, 7};
  for (int k = 0; k < 3; ++k) {
    CHECK(reader.positions(k) == frame(kept[k], 1));
    CHECK(reader.scalar("J", k) == numbers(kept[k])[0]);
    CHECK(reader.scalar("plastic", k) == numbers(kept[k])[1]);
  }
  CHECK_THROWS_AS(reader.scalar("mass", 0), Error);
  CHECK(read_file(folder / "result.xdmf").find("Polyvertex") != std::string::npos);
  mesh.particles = n + 1;
  mesh.object.assign(n + 2, 0);
  CHECK_THROWS_AS(
      ResultWriter::create(folder / "other.vtkhdf", mesh, 2, ResultWriter::IfExists::refuse),
      Error);
}

TEST_CASE("a result of particles grows, and triangles stay behind them", "[io][result]") {
  const Folder folder;
  const auto path = folder / "result.vtkhdf";
  const auto mesh_of = [](std::size_t particles) {
    ResultMesh mesh;
    for (std::size_t p = 0; p < particles + 3; ++p) mesh.mesh.points.push_back({double(p), 0, 1});
    mesh.object.assign(particles, 1);
    mesh.object[0] = 0;
    mesh.object.push_back(2);
    mesh.object_names = {"stone", "source", "wall"};
    mesh.object_kind = {ObjectKind::body, ObjectKind::body, ObjectKind::obstacle};
    const auto first = static_cast<std::int32_t>(particles);
    mesh.triangles = {{first, first + 1, first + 2}};
    mesh.particles = particles;
    mesh.scalars = {"J"};
    mesh.growing = true;
    return mesh;
  };
  /// Places of frame k, which has 1 + 2 k particles.
  const auto places = [](int k) {
    std::vector<Point> list;
    for (int p = 0; p < 1 + 2 * k; ++p) list.push_back({double(p), 0.5 * k, -1});
    for (int v = 0; v < 3; ++v) list.push_back({double(v), -7, double(k)});
    return list;
  };
  const auto numbers = [&](int k) {
    std::vector<double> list;
    for (Point const& x : places(k)) list.push_back(10 * x[0] + k);
    return std::vector<std::vector<double>>{list};
  };
  {
    auto writer = ResultWriter::create(path, mesh_of(5), 2, ResultWriter::IfExists::refuse);
    for (int k = 0; k < 3; ++k) writer.append(k, places(k), places(k), numbers(k));
    CHECK_THROWS_AS(writer.append(3, places(3), places(3), numbers(3)), Error);  // more than 5
    CHECK_THROWS_AS(writer.append(3, {}, {}, {}), Error);                        // no wall
    CHECK_THROWS_AS(writer.append(3, places(2), places(1), numbers(2)), Error);
  }
  {  // prolonged, with more to come out; and with less, as if it were to end sooner
    auto writer = ResultWriter::resume(path, mesh_of(9), 2, 6);
    for (int k = 2; k < 5; ++k) writer.append(k, places(k), places(k), numbers(k));
    ResultWriter::resume(path, mesh_of(3), 5, 6);
    ResultMesh other = mesh_of(9);
    other.object[3] = 0;
    CHECK_THROWS_AS(ResultWriter::resume(path, other, 2, 6), Error);
    other = mesh_of(9);
    other.growing = false;
    CHECK_THROWS_AS(ResultWriter::resume(path, other, 2, 6), Error);
  }
  const ResultReader reader(path);
  check_same(reader.mesh(), mesh_of(9));
  CHECK(reader.mesh().growing);
  REQUIRE(reader.frames() == 5);
  for (int k = 0; k < 5; ++k) {
    CHECK(reader.particles(k) == std::size_t(1 + 2 * k));
    CHECK(reader.positions(k) == places(k));
    CHECK(reader.velocities(k) == places(k));
    CHECK(reader.scalar("J", k) == numbers(k)[0]);
  }
  CHECK_THROWS_AS(reader.particles(5), Error);
  std::string const sidecar = read_file(folder / "result.xdmf");
  CHECK(sidecar.find("NumberOfElements=\"9\"") != std::string::npos);
  CHECK(sidecar.find("NumberOfElements=\"7\"") != std::string::npos);
}
