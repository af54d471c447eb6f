// Every format read back to the mesh that was written, bit for bit.
#include <array>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <fstream>
#include <support/data.hpp>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/mesh_reader.hpp>

using namespace taut;
using namespace taut::test;

namespace {

void check_equal(TetMesh const& read, TetMesh const& written) {
  CHECK(read.points == written.points);
  CHECK(read.tets == written.tets);
}

}  // namespace

TEST_CASE("gmsh 2.2 and 4.1, ASCII and binary, are read to the last bit") {
  const TetMesh mesh = two_tets();
  for (const bool binary : {false, true}) {
    CAPTURE(binary);
    check_equal(parse_gmsh(msh_2(mesh, binary), "a.msh"), mesh);
    check_equal(parse_gmsh(msh_4(mesh, binary), "a.msh"), mesh);
  }
}

TEST_CASE("gmsh files with carriage returns are read") {
  std::string text;
  for (const char c : msh_4(two_tets(), false)) text += c == '\n' ? "\r\n" : std::string(1, c);
  check_equal(parse_gmsh(text, "a.msh"), two_tets());
}

TEST_CASE("gmsh elements that fill space and are passed over are warned of") {
  std::vector<std::string> warnings;
  check_equal(parse_gmsh(msh_2(two_tets(), false), "a.msh", &warnings), two_tets());
  CHECK(warnings.empty());  // its triangles are the surface of what the tets fill
  // Two more, a prism and a tet of ten nodes, whose nodes nobody looks at.
  std::string text = msh_2(two_tets(), false);
  const std::string tail = "$EndElements", count = "$Elements\n3\n";
  text.insert(text.find(tail), "8 6 2 5 6 1 1 1 1 1 1\n9 11 2 5 6 1 1 1 1 1 1 1 1 1 1\n");
  REQUIRE(text.find(count) != std::string::npos);
  text.replace(text.find(count), count.size(), "$Elements\n5\n");
  check_equal(parse_gmsh(text, "a.msh", &warnings), two_tets());
  REQUIRE(warnings.size() == 1);
  check_says(warnings[0], {"a.msh: 1 prisms (type 6), 1 tets of higher order (type 11) are passed",
                           "of the 2 linear tets alone"});
}

TEST_CASE("TetGen pairs count from 0 or 1 and have short or full headers") {
  const TetMesh mesh = two_tets();
  for (const int base : {0, 1}) {
    for (const bool full : {false, true}) {
      CAPTURE(base, full);
      check_equal(parse_tetgen(tetgen_nodes(mesh, base, full), "a.node",
                               tetgen_elements(mesh, base, full), "a.ele"),
                  mesh);
    }
  }
}

TEST_CASE("a mesh file is chosen by its extension, a TetGen pair also by its stem") {
  const Folder folder;
  const TetMesh mesh = two_tets();
  write_file_atomically(folder / "a.msh", msh_4(mesh, true));
  write_file_atomically(folder / "b.1.node", tetgen_nodes(mesh, 1, true));
  write_file_atomically(folder / "b.1.ele", tetgen_elements(mesh, 1, true));
  for (char const* const name : {"a.msh", "b.1.node", "b.1.ele", "b.1"}) {
    CAPTURE(name);
    check_equal(read_tet_mesh(folder / name), mesh);
  }
}

TEST_CASE("OBJ: corners in all forms, negative indices, polygons as fans, other lines unread") {
  const TriangleMesh mesh = parse_obj(
      "# comment\nmtllib a.mtl\no body\nv 0 0 0\nv 1 0 0 1.0\nv +1 1 0 0.5 0.5 0.5\nv 0 1 0\n"
      "vt 0 0\nvn 0 0 1\nf 1 2/1 3/1/1 4//1 # a quad\nv 0 0 1e0\nf -1 -5 -4\nf 6 1 2\nv 9 9 9\n",
      "a.obj");
  CHECK(mesh.points ==
        std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {9, 9, 9}});
  CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {4, 0, 1}, {5, 0, 1}});
}

TEST_CASE("an OBJ that is written is read back bitwise") {
  const Folder folder;
  const TriangleMesh mesh{{{0.1, -1.0 / 3, 1e-300}, {1e17, 5, 6}, {0, -0.0, 2}}, {{0, 2, 1}}};
  write_obj(folder / "new/a.obj", mesh);
  const TriangleMesh read = read_obj(folder / "new/a.obj");
  CHECK(read.points == mesh.points);
  CHECK(std::signbit(read.points[2][1]));
  CHECK(read.triangles == mesh.triangles);
}

TEST_CASE("the boundary of two tets is six faces that enclose their volume") {
  const TetMesh mesh = two_tets();
  const std::vector<Triangle> faces = boundary_faces(mesh.tets);
  REQUIRE(faces.size() == 6);
  // Divergence theorem: the cones over outward faces add up to the volume.
  double cones = 0;
  for (Triangle const& f : faces) {
    const TetMesh cone{{{0, 0, 0}, mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]]}, {}};
    cones += six_volume(cone, {0, 1, 2, 3});
  }
  const double volume = six_volume(mesh, mesh.tets[0]) + six_volume(mesh, mesh.tets[1]);
  CHECK(std::abs(cones - volume) < 1e-15);
  CHECK(volume > 1);
}

TEST_CASE("the paper's TetGen meshes have the counts of the inventory") {
  const auto inventory = read_json(data_file("mesh_inventory.json"));
  REQUIRE(inventory.size() >= 19);
  for (auto const& [name, entry] : inventory.items()) {
    CAPTURE(name);
    TetMesh mesh = read_tet_mesh(data_file("meshes/pncg") / name / name);
    CHECK(mesh.points.size() == entry.at("nodes").get<std::size_t>());
    CHECK(mesh.tets.size() == entry.at("tets").get<std::size_t>());
    CHECK(boundary_faces(mesh.tets).size() == entry.at("bfaces").get<std::size_t>());
    const MeshReport report = check_mesh(mesh, name);
    CHECK(report.flipped == 0);
    const auto volume = entry.at("volume").get<double>();
    CHECK(std::abs(report.volume - volume) < 1e-11 * volume);
  }
}

TEST_CASE("the gmsh meshes and surfaces of the IPC benchmarks are read") {
  int meshes = 0;
  int surfaces = 0;
  for (auto const& entry : std::filesystem::directory_iterator(data_file("meshes/ipc"))) {
    const std::string name = entry.path().filename().string();
    CAPTURE(name);
    if (entry.path().extension() == ".msh") {
      ++meshes;
      TetMesh mesh = read_tet_mesh(entry.path());
      const std::size_t boundary = boundary_faces(mesh.tets).size();
      // The files carry their boundary in a section of their own, its size in the second line.
      std::string text = read_file(entry.path());
      text = text.substr(text.find("$Surface") + 8);
      CHECK(boundary == std::stoul(text));
      CHECK_NOTHROW(check_mesh(mesh, name));
    } else if (entry.path().extension() == ".obj") {
      ++surfaces;
      CHECK_FALSE(read_obj(entry.path()).triangles.empty());
    }
  }
  CHECK(meshes == 13);
  CHECK(surfaces == 8);
}
