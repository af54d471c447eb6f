// Readers of tetrahedral meshes (gmsh, TetGen) and triangle surfaces (OBJ).
//
// gmsh: $Nodes and $Elements of the MSH formats 2.2 and 4.1, ASCII and binary
// (https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format). TetGen: .node and .ele
// (https://wias-berlin.de/software/tetgen/fformats.html).
//
// What a file says is kept: vertices and elements in its order, orientation as it is (check_mesh in
// core/fem/mesh_check.hpp judges that). Whatever cannot be a mesh throws Error with one sentence
// naming file and line (byte for binary), what is wrong and how to mend it; memory is only taken
// for what the size of the file can justify.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <taut/core/fem/tet_mesh.hpp>
#include <vector>

namespace taut {

/// Reads `.msh`, or a TetGen pair named by its `.node`, its `.ele` or their common stem. Adds a
/// sentence to `warnings` if the file has other elements that fill space, which are passed over.
TetMesh read_tet_mesh(std::filesystem::path const& path,
                      std::vector<std::string>* warnings = nullptr);

/// Reads the vertices and faces of a Wavefront OBJ; polygons become fans of triangles.
TriangleMesh read_obj(std::filesystem::path const& path);

/// Writes `.obj` in one step (a crash leaves the old file); coordinates survive bitwise.
void write_obj(std::filesystem::path const& path, TriangleMesh const& mesh);

// The same from memory; `name` stands for the file in messages.
TetMesh parse_gmsh(std::string_view content, std::string const& name,
                   std::vector<std::string>* warnings = nullptr);
TetMesh parse_tetgen(std::string_view nodes, std::string const& node_name,
                     std::string_view elements, std::string const& element_name);
TriangleMesh parse_obj(std::string_view content, std::string const& name);

}  // namespace taut
