// TetGen: "<file>.node" lists numbered points, "<file>.ele" numbered tets of four node numbers,
// both counted from 0 or from 1. Header fields after the count are optional here; attributes and
// boundary markers at the end of a row are not used.
#include <taut/core/io/file.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/io/scanner.hpp>

namespace taut {
namespace {

constexpr std::size_t shortest_node = 8;  // bytes of "0 0 0 0\n"
constexpr std::size_t shortest_tet = 10;  // bytes of "0 0 1 2 3\n"

/// Reads "<count> [<columns>] ...": the count, after checking that `columns`, where it is stated,
/// is the one that can be read.
std::size_t read_header(Scanner& scanner, std::string_view what, std::size_t shortest_row,
                        std::int64_t columns, std::string_view columns_mend) {
  if (!scanner.begin_row('#')) {
    scanner.fail("the file has no header with the number of {}; export the mesh again.", what);
  }
  const auto count = scanner.number<std::int64_t>("the number of " + std::string(what));
  if (scanner.has_word()) {
    const auto stated = scanner.number<std::int64_t>("the second number of the header");
    if (stated != columns) {
      scanner.fail("the header says {} per row of {}, {} is what can be read; {}.", stated, what,
                   columns, columns_mend);
    }
  }
  scanner.end_row();
  return scanner.checked_count(count, shortest_row, what);
}

/// Begins row `i` of `count` and returns its number, which must follow the one before.
void begin_numbered_row(Scanner& scanner, std::size_t i, std::size_t count, std::string_view what,
                        std::int64_t& first) {
  if (!scanner.begin_row('#')) {
    scanner.fail(
        "the header announces {} {} but only {} follow; the file is truncated, copy or "
        "export it again.",
        count, what, i);
  }
  const auto number = scanner.number<std::int64_t>("the row's number");
  if (i == 0) {
    if (number != 0 && number != 1) {
      scanner.fail("the first of the {} has the number {}, not 0 or 1; renumber them.", what,
                   number);
    }
    first = number;
  } else if (number != first + static_cast<std::int64_t>(i)) {
    scanner.fail(
        "number {} stands where {} number {} should be; a row is missing or doubled, "
        "export the mesh again.",
        number, what, first + static_cast<std::int64_t>(i));
  }
}

void expect_end(Scanner& scanner, std::size_t count, std::string_view what) {
  if (scanner.begin_row('#')) {
    scanner.fail(
        "the header announces {} {} but more rows follow; correct the header or export "
        "the mesh again.",
        count, what);
  }
}

}  // namespace

TetMesh parse_tetgen(std::string_view nodes, std::string const& node_name,
                     std::string_view elements, std::string const& element_name) {
  TetMesh mesh;
  std::int64_t first_node = 0;
  {
    Scanner scanner(nodes, node_name);
    const std::size_t count =
        read_header(scanner, "nodes", shortest_node, 3, "only 3D meshes are solids");
    mesh.points.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      begin_numbered_row(scanner, i, count, "nodes", first_node);
      for (double& x : mesh.points[i]) x = scanner.number<double>("a coordinate");
      scanner.end_row();
    }
    expect_end(scanner, count, "nodes");
  }
  Scanner scanner(elements, element_name);
  const std::size_t count =
      read_header(scanner, "tets", shortest_tet, 4, "export linear tets (without TetGen's -o2)");
  if (count == 0) scanner.fail("the mesh has no tets; export a volume mesh.");
  const auto n_nodes = static_cast<std::int64_t>(mesh.points.size());
  std::int64_t first_tet = 0;
  mesh.tets.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    begin_numbered_row(scanner, i, count, "tets", first_tet);
    for (std::int32_t& vertex : mesh.tets[i]) {
      const auto node = scanner.number<std::int64_t>("a node number");
      if (node < first_node || node >= first_node + n_nodes) {
        scanner.fail(
            "node {} does not exist, {} has the nodes {} to {}; use the .node and .ele of "
            "one export.",
            node, node_name, first_node, first_node + n_nodes - 1);
      }
      vertex = static_cast<std::int32_t>(node - first_node);
    }
    // Nodes of a file that counts otherwise could be meant by either number.
    if (first_tet != first_node) {
      scanner.fail(
          "the tets count from {}, the nodes of {} from {}; use the .node and .ele of one export.",
          first_tet, node_name, first_node);
    }
    scanner.end_row();
  }
  expect_end(scanner, count, "tets");
  return mesh;
}

TetMesh read_tet_mesh(std::filesystem::path const& path, std::vector<std::string>* warnings) {
  namespace fs = std::filesystem;
  const std::string extension = path.extension().string();
  if (extension == ".msh") return parse_gmsh(read_file(path), path.string(), warnings);
  if (extension == ".obj") {
    throw Error(
        "{}: an OBJ file holds a surface, and tets are needed here; fill it by a mesh generator "
        "and give its .msh, or its .node and .ele.",
        path.string());
  }

  const bool named_file = extension == ".node" || extension == ".ele";
  const fs::path stem = named_file ? fs::path(path).replace_extension() : path;
  const std::string node_name = stem.string() + ".node";
  const std::string element_name = stem.string() + ".ele";
  if (!named_file && !fs::exists(node_name) && !fs::exists(element_name)) {
    throw Error(
        "{}: this is neither a gmsh .msh file nor the stem of TetGen's .node and .ele files "
        "(looked for {}); correct the name or convert the mesh.",
        path.string(), fs::absolute(node_name).string());
  }
  return parse_tetgen(read_file(node_name), node_name, read_file(element_name), element_name);
}

}  // namespace taut
