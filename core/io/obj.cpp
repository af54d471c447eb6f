// Wavefront OBJ: "v x y z", "f a b c ..." with a = vertex[/texture[/normal]], vertices counted from
// 1 or, negative, backwards from the last one read. Every other line is left unread.
#include <fmt/format.h>

#include <iterator>
#include <taut/core/io/file.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/io/scanner.hpp>

namespace taut {
namespace {

/// The vertex of one corner ("7", "7/1", "7//3", "-1/2/3"), counted from 0. A face may name
/// vertices that follow later in the file, so only the lower bound can be checked here.
std::int64_t read_corner(Scanner const& scanner, std::string_view corner, std::size_t n_points) {
  const std::string_view digits = corner.substr(0, corner.find('/'));
  std::int64_t index = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
  if (error != std::errc{} || end != digits.data() + digits.size() || index == 0) {
    scanner.fail(
        "a face corner must be a vertex number other than 0, optionally with /texture and "
        "/normal; correct it or export the mesh again.");
  }
  const std::int64_t vertex = index > 0 ? index - 1 : static_cast<std::int64_t>(n_points) + index;
  if (vertex < 0) {
    scanner.fail(
        "face corner {} counts back beyond the first vertex, {} are read so far; export "
        "the mesh again.",
        index, n_points);
  }
  return vertex;
}

}  // namespace

TriangleMesh parse_obj(std::string_view content, std::string const& name) {
  TriangleMesh mesh;
  Scanner scanner(content, name);
  std::vector<std::int64_t> polygon;
  std::int64_t highest = -1;          // the highest vertex that a face names,
  Scanner highest_at(content, name);  // and where it does
  for (; scanner.begin_row('#'); scanner.end_row()) {
    const std::string_view keyword = scanner.word();
    if (keyword == "v") {
      Point point;
      for (double& x : point) x = scanner.number<double>("a coordinate");
      mesh.points.push_back(point);
    } else if (keyword == "f") {
      polygon.clear();
      while (scanner.has_word()) {
        polygon.push_back(read_corner(scanner, scanner.word(), mesh.points.size()));
        if (polygon.back() > std::numeric_limits<std::int32_t>::max()) {
          scanner.fail("vertex {} is beyond 32-bit indices; split the mesh.", polygon.back() + 1);
        }
        if (polygon.back() > highest) {
          highest = polygon.back();
          highest_at = scanner;
        }
      }
      if (polygon.size() < 3) {
        scanner.fail(
            "a face needs at least 3 corners and has {}; remove it or export the mesh "
            "again.",
            polygon.size());
      }
      for (std::size_t k = 2; k < polygon.size(); ++k) {
        mesh.triangles.push_back({static_cast<std::int32_t>(polygon[0]),
                                  static_cast<std::int32_t>(polygon[k - 1]),
                                  static_cast<std::int32_t>(polygon[k])});
      }
    }
  }
  if (mesh.points.empty() || mesh.triangles.empty()) {
    throw Error(
        "{}: an OBJ surface needs 'v' and 'f' lines, this file has {} vertices and {} "
        "triangles; export the surface again.",
        name, mesh.points.size(), mesh.triangles.size());
  }
  if (highest >= static_cast<std::int64_t>(mesh.points.size())) {
    highest_at.fail("the face names vertex {} but the file has {}; export the mesh again.",
                    highest + 1, mesh.points.size());
  }
  return mesh;
}

TriangleMesh read_obj(std::filesystem::path const& path) {
  return parse_obj(read_file(path), path.string());
}

void write_obj(std::filesystem::path const& path, TriangleMesh const& mesh) {
  std::string text;
  const auto out = std::back_inserter(text);
  // The shortest digits that read back as the same double.
  for (Point const& x : mesh.points) fmt::format_to(out, "v {} {} {}\n", x[0], x[1], x[2]);
  for (Triangle const& t : mesh.triangles) {
    fmt::format_to(out, "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  write_file_atomically(path, text);
}

}  // namespace taut
