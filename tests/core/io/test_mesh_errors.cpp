// Files that are no mesh: one sentence each that says where, what and how to mend it.
#include <algorithm>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <limits>
#include <taut/core/io/file.hpp>
#include <taut/core/io/mesh_reader.hpp>

using namespace taut;
using namespace taut::test;

namespace {

/// `text` with the first `from` replaced by `to`.
std::string replaced(std::string text, std::string const& from, std::string const& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string gmsh_sentence(std::string const& content) {
  return sentence([&] { parse_gmsh(content, "body.msh"); });
}

const std::string nodes = "2\n0 0 0 0\n1 1 0 0\n";  // one tet needs more: for errors before that
const std::string four = "4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";

std::string tetgen_sentence(std::string const& node, std::string const& element) {
  return sentence([&] { parse_tetgen(node, "b.node", element, "b.ele"); });
}

std::string obj_sentence(std::string const& content) {
  return sentence([&] { parse_obj(content, "c.obj"); });
}

}  // namespace

TEST_CASE("a missing or wrong file is named with the path it was looked for under") {
  const Folder folder;
  const std::string path = (folder / "none.msh").string();
  check_says(sentence([&] { read_tet_mesh(path); }), {path, "no such file", "looked for"});
  check_says(sentence([&] { read_tet_mesh(folder / "none"); }), {"none.node", "looked for"});
  check_says(sentence([&] { read_obj(folder.path()); }), {"folder"});
  write_file_atomically(folder / "half.node", four);
  check_says(sentence([&] { read_tet_mesh(folder / "half"); }), {"half.ele", "no such file"});
  check_says(sentence([&] { read_tet_mesh("body.obj"); }), {"body.obj", "surface", "tets"});
}

TEST_CASE("gmsh: what is wrong is named with its line") {
  const std::string good = msh_4(two_tets(), false);
  REQUIRE_NOTHROW(parse_gmsh(good, "body.msh"));

  check_says(gmsh_sentence(""), {"body.msh:1", "$MeshFormat"});
  check_says(gmsh_sentence("v 1 2 3\n"), {"body.msh:1", "$MeshFormat", "convert"});
  check_says(gmsh_sentence(replaced(good, "4.1", "4.0")), {"body.msh:2", "4.0", "4.1 or 2.2"});
  check_says(gmsh_sentence(good.substr(0, good.find("$Elements"))), {"no linear tets"});
  check_says(gmsh_sentence(good.substr(0, good.find("0.2 -0.7"))), {"file ends", "truncated"});
  check_says(gmsh_sentence(replaced(good, "0.25", "nan")), {"body.msh:9", "not finite"});
  check_says(gmsh_sentence(replaced(good, "0.25", "1e999")), {"body.msh:9", "1e999"});
  check_says(gmsh_sentence(replaced(good, "0.25", "x\x01y")), {"body.msh:9", "'x?y'"});
  check_says(gmsh_sentence(replaced(good, "\n2 5 ", "\n2 6 ")), {"6 nodes", "hold 5"});
  check_says(gmsh_sentence(replaced(good, "\n2 5 ", "\n2 2000000000 ")),
             {"body.msh:5", "2000000000 nodes", "truncated"});
  check_says(gmsh_sentence(replaced(good, "\n2 5 ", "\n2 -5 ")), {"negative", "-5"});
  check_says(gmsh_sentence(replaced(good, "\n2 5 ", "\n2 9000000000 ")), {"32-bit"});
  check_says(gmsh_sentence(replaced(good, "$EndNodes", "$EndNode")), {"$EndNodes", "differ"});
  check_says(gmsh_sentence(replaced(good, "993 ", "1000 ")), {"node 1000", "twice"});
  check_says(gmsh_sentence(replaced(good, "993 ", "0 ")), {"tag 0", "not positive"});
  check_says(gmsh_sentence(replaced(good, "\n3 3 1", "\n3 4 1")), {"4 elements", "hold 3"});
  check_says(gmsh_sentence(replaced(good, "2 1000 993 986 979", "2 1000 993 986 123")),
             {"element 2", "node 123"});
  check_says(gmsh_sentence(replaced(good, "3 9 4 ", "3 9 99 ")), {"unknown type 99"});
  check_says(gmsh_sentence(replaced(good, "$EndNodeData", "")), {"$NodeData", "$EndNodeData"});
  const std::string surface = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + four +
                              "$EndNodes\n$Elements\n1\n1 2 0 1 2 3\n$EndElements\n";
  check_says(gmsh_sentence(surface), {"no linear tets", "1 of type 2", "volume mesh"});
  check_says(gmsh_sentence(replaced(surface, "$Nodes\n" + four + "$EndNodes\n", "")),
             {"body.msh:4", "before $Nodes"});
}

TEST_CASE("binary gmsh: byte order, truncation and garbage are named with their byte") {
  for (const bool is_4 : {false, true}) {
    CAPTURE(is_4);
    const std::string good = is_4 ? msh_4(two_tets(), true) : msh_2(two_tets(), true);
    REQUIRE_NOTHROW(parse_gmsh(good, "body.msh"));
    std::string swapped = good;
    std::reverse(swapped.begin() + 20, swapped.begin() + 24);  // the int after "... 1 8\n"
    check_says(gmsh_sentence(swapped), {"body.msh, byte 20", "byte order", "ASCII"});
    check_says(gmsh_sentence(replaced(good, " 1 8", " 1 4")), {"data size", "4"});

    std::string endless = good;
    const double infinite = std::numeric_limits<double>::infinity();
    const std::size_t third = good.find(std::string("\x55\x55\x55\x55\x55\x55\xd5\x3f", 8));
    REQUIRE(third != std::string::npos);  // the coordinate 1/3
    std::memcpy(endless.data() + third, &infinite, sizeof(infinite));
    check_says(gmsh_sentence(endless), {fmt::format("byte {}", third), "not finite"});
    check_says(gmsh_sentence(good.substr(0, third + 4)), {"body.msh, byte", "truncated"});
  }
}

TEST_CASE("TetGen: what is wrong is named with file and line") {
  const std::string tet = "1\n1 1 2 3 4\n";
  const std::string list = four + "# room for one more row\n";
  REQUIRE_NOTHROW(parse_tetgen(four, "b.node", tet, "b.ele"));
  check_says(tetgen_sentence("# only this\n", tet), {"b.node", "no header"});
  check_says(tetgen_sentence(replaced(list, "4\n", "5\n"), tet), {"5 nodes", "only 4"});
  check_says(tetgen_sentence(replaced(list, "4\n", "3\n"), tet), {"b.node:5", "more rows"});
  check_says(tetgen_sentence(replaced(list, "4\n", "4 2 0 0\n"), tet), {"b.node:1", "3D"});
  check_says(tetgen_sentence(replaced(list, "3 0", "5 0"), tet), {"b.node:4", "number 5"});
  check_says(tetgen_sentence(replaced(list, "1 0 0 0", "7 0 0 0"), tet), {"b.node:2", "0 or 1"});
  check_says(tetgen_sentence(replaced(list, "0 1 0\n", "0 1\n"), tet),
             {"b.node:4", "line ends", "coordinate"});
  check_says(tetgen_sentence(replaced(list, "0 1 0\n", "0 inf 0\n"), tet),
             {"b.node:4", "not finite"});
  check_says(tetgen_sentence(four, "1\n1 1 2 3 5\n"), {"b.ele:2", "node 5", "b.node", "1 to 4"});
  check_says(tetgen_sentence(four, "1\n1 0 1 2 3\n"), {"b.ele:2", "node 0"});
  check_says(tetgen_sentence(four, "1\n0 1 2 3 4\n"),
             {"b.ele:2", "tets count from 0", "b.node from 1"});
  check_says(tetgen_sentence(four, "1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n"), {"b.ele:1", "linear"});
  check_says(tetgen_sentence(four, "0\n"), {"b.ele", "no tets"});
  check_says(tetgen_sentence(four, "1000000\n1 1 2 3 4\n"), {"1000000 tets", "truncated"});
  check_says(tetgen_sentence(nodes, "1\n1 0 1 0 1.5\n"), {"b.ele:2", "'1.5'", "node number"});
}

TEST_CASE("OBJ: what is wrong is named with its line") {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  REQUIRE_NOTHROW(parse_obj(triangle, "c.obj"));
  check_says(obj_sentence("# nothing\n"), {"c.obj", "0 vertices"});
  check_says(obj_sentence(replaced(triangle, "f 1 2 3", "f 1 2 4")),
             {"c.obj:4", "vertex 4", "has 3"});
  check_says(obj_sentence(replaced(triangle, "f 1 2 3", "f 1 2 -4")), {"c.obj:4", "-4"});
  check_says(obj_sentence(replaced(triangle, "f 1 2 3", "f 1 2 0")), {"c.obj:4", "other than 0"});
  check_says(obj_sentence(replaced(triangle, "f 1 2 3", "f 1 2")), {"c.obj:4", "3 corners"});
  check_says(obj_sentence(replaced(triangle, "f 1 2 3", "f a/1 2 3")), {"c.obj:4", "corner"});
  check_says(obj_sentence(replaced(triangle, "v 1 0 0", "v 1 0")), {"c.obj:2", "line ends"});
  check_says(obj_sentence(replaced(triangle, "v 1 0 0", "v 1 0 nan")), {"c.obj:2", "not finite"});
}
