// gmsh MSH 2.2 and 4.1, ASCII and binary: https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format.
// Read are the nodes and the linear tets (element type 4) of all entities; other elements and other
// sections are passed over. Node tags may be sparse and in any order.
#include <algorithm>
#include <map>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/io/scanner.hpp>
#include <utility>

namespace taut {
namespace {

constexpr int linear_tet = 4;

/// Number of nodes of gmsh's element types 1 to 31; 0 for a type this table does not know.
int nodes_of_type(std::int64_t type) {
  constexpr std::array<int, 32> nodes{0, 2,  3,  4,  4, 8,  6,  5,  3,  6,  9, 10, 27, 18, 14, 1,
                                      8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5,  6,  20, 35, 56};
  return type > 0 && type < std::ssize(nodes) ? nodes[static_cast<std::size_t>(type)] : 0;
}

/// What elements of a type fill space with, for sentences; empty if they do not.
std::string_view solids_of_type(std::int64_t type) {
  switch (type) {
    case linear_tet:
      return "linear tets";
    case 11:
    case 29:
    case 30:
    case 31:
      return "tets of higher order";
    case 5:
    case 12:
    case 17:
      return "hexahedra";
    case 6:
    case 13:
    case 18:
      return "prisms";
    case 7:
    case 14:
    case 19:
      return "pyramids";
    default:
      return "";
  }
}

// The fewest bytes of one entry, which bound what a stated count can mean.
constexpr std::size_t shortest_node = 8;       // "1 0 0 0\n"
constexpr std::size_t shortest_element = 4;    // "1 1\n"
constexpr std::size_t binary_node_2 = 4 + 24;  // tag and three doubles
constexpr std::size_t binary_node_4 = 8 + 24;
constexpr std::size_t binary_element_4 = 8 + 8;  // tag and one node

/// From node tags, distinct positive integers, to positions in the file.
class NodeNumbers {
public:
  void add(std::int64_t tag) {
    consecutive_ = consecutive_ && (numbers_.empty() || tag - 1 == numbers_.back().first);
    numbers_.emplace_back(tag, static_cast<std::int32_t>(numbers_.size()));
  }
  /// Prepares find(); returns a tag that was added twice, if there is one.
  std::int64_t const* finish() {
    if (!consecutive_) std::sort(numbers_.begin(), numbers_.end());
    const auto twin = std::adjacent_find(numbers_.begin(), numbers_.end(),
                                         [](auto a, auto b) { return a.first == b.first; });
    return twin == numbers_.end() ? nullptr : &twin->first;
  }
  /// -1 for an unknown tag.
  std::int32_t find(std::int64_t tag) const {
    if (numbers_.empty()) return -1;
    const std::int64_t first = numbers_.front().first;
    if (consecutive_) {
      return tag >= first && tag <= numbers_.back().first ? static_cast<std::int32_t>(tag - first)
                                                          : -1;
    }
    const auto at = std::lower_bound(numbers_.begin(), numbers_.end(), std::pair(tag, -1));
    return at != numbers_.end() && at->first == tag ? at->second : -1;
  }
  bool empty() const { return numbers_.empty(); }

private:
  std::vector<std::pair<std::int64_t, std::int32_t>> numbers_;
  bool consecutive_ = true;
};

class GmshParser {
public:
  GmshParser(std::string_view content, std::string const& name)
      : name_(name), scanner_(content, name) {}

  TetMesh parse(std::vector<std::string>* warnings) {
    if (scanner_.word() != "$MeshFormat") {
      scanner_.fail("a gmsh file begins with $MeshFormat; convert the mesh to MSH 4.1 or 2.2.");
    }
    read_format();
    while (scanner_.has_word()) {
      const std::string section(scanner_.word());
      if (section.front() != '$') {
        scanner_.fail("a section like $Nodes should begin here; export the mesh again.");
      }
      if (section == "$Nodes") {
        scanner_.finish_line();
        read_nodes();
        expect("$EndNodes");
      } else if (section == "$Elements") {
        if (numbers_.empty()) {
          scanner_.fail("$Elements comes before $Nodes or without nodes; export the mesh again.");
        }
        scanner_.finish_line();
        read_elements();
        expect("$EndElements");
      } else if (!scanner_.skip_behind("$End" + section.substr(1))) {
        scanner_.fail("{} has no $End{}; the file is truncated, copy or export it again.", section,
                      section.substr(1));
      }
    }
    if (mesh_.tets.empty()) fail_without_tets();
    if (warnings) warn_of_solids(*warnings);
    return std::move(mesh_);
  }

private:
  // Integers are 4 bytes in binary files; 4.1 stores counts and tags as 8 (its size_t).
  std::int64_t integer(std::string_view what) {
    return binary_ ? scanner_.raw<std::int32_t>(what) : scanner_.number<std::int64_t>(what);
  }
  std::int64_t wide(std::string_view what) {
    return binary_ ? scanner_.raw<std::int64_t>(what) : scanner_.number<std::int64_t>(what);
  }
  double real(std::string_view what) {
    return binary_ ? scanner_.raw<double>(what) : scanner_.number<double>(what);
  }

  void expect(std::string_view end) {
    if (scanner_.word() != end) {
      scanner_.fail(
          "{} should stand here: the numbers of entries announced and found differ; "
          "export the mesh again.",
          end);
    }
  }

  void read_format() {
    const std::string version(scanner_.word());
    is_4_ = version == "4.1";
    if (!is_4_ && version != "2.2" && version != "2.1" && version != "2") {
      scanner_.fail("MSH version '{}' is not read; save the mesh as 4.1 or 2.2.",
                    version.substr(0, 16));
    }
    binary_ = scanner_.number<int>("the file type (0 ASCII, 1 binary)") != 0;
    const int size = scanner_.number<int>("the data size");
    // Some exporters leave ASCII files with another size; it says nothing there.
    if (binary_ && size != 8) {
      scanner_.fail("the data size is {} bytes, 8 is what can be read; save the mesh as ASCII.",
                    size);
    }
    scanner_.finish_line();
    if (binary_) {
      scanner_.binary_from_here();
      if (scanner_.raw<std::int32_t>("the byte-order mark") != 1) {
        scanner_.fail(
            "the binary data has another machine's byte order or is damaged; save the "
            "mesh as ASCII.");
      }
    }
    expect("$EndMeshFormat");
  }

  void read_nodes() {
    if (!numbers_.empty()) scanner_.fail("there is a second $Nodes; keep one.");
    is_4_ ? read_nodes_4() : read_nodes_2();
    if (std::int64_t const* const tag = numbers_.finish()) {
      scanner_.fail("node {} is listed twice; export the mesh again.", *tag);
    }
  }

  void add_tag(std::int64_t tag) {
    if (tag < 1) scanner_.fail("node tag {} is not positive; export the mesh again.", tag);
    numbers_.add(tag);
  }

  void read_point(std::int64_t parameters) {
    Point point;
    for (double& x : point) x = real("a coordinate");
    for (std::int64_t p = 0; p < parameters; ++p) real("a parametric coordinate");
    mesh_.points.push_back(point);
  }

  void read_nodes_2() {
    const auto stated = scanner_.number<std::int64_t>("the number of nodes");
    if (binary_) scanner_.finish_line();
    const std::size_t count =
        scanner_.checked_count(stated, binary_ ? binary_node_2 : shortest_node, "nodes");
    mesh_.points.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      add_tag(integer("a node tag"));
      read_point(0);
    }
  }

  void read_nodes_4() {
    const std::int64_t blocks = wide("the number of node blocks");
    const std::int64_t stated = wide("the number of nodes");
    const std::size_t bytes = binary_ ? binary_node_4 : shortest_node;
    mesh_.points.reserve(scanner_.checked_count(stated, bytes, "nodes"));
    wide("the least node tag");
    wide("the greatest node tag");
    for (std::int64_t block = 0; block < blocks; ++block) {
      const std::int64_t dimension = integer("an entity's dimension");
      integer("an entity's tag");
      const bool parametric = integer("the parametric flag") != 0;
      if (dimension < 0 || dimension > 3) {
        scanner_.fail("entity dimension {} is not 0 to 3; export the mesh again.", dimension);
      }
      const std::size_t count =
          scanner_.checked_count(wide("a block's number of nodes"), bytes, "nodes");
      for (std::size_t i = 0; i < count; ++i) add_tag(wide("a node tag"));
      for (std::size_t i = 0; i < count; ++i) read_point(parametric ? dimension : 0);
    }
    check_total(stated, std::ssize(mesh_.points), "nodes");
  }

  void read_elements() { is_4_ ? read_elements_4() : read_elements_2(); }

  void read_elements_2() {
    const auto stated = scanner_.number<std::int64_t>("the number of elements");
    if (binary_) scanner_.finish_line();
    // Binary elements come in runs of one type that share a header; an ASCII line is a run of one.
    std::int64_t read = 0;
    while (read < stated) {
      const std::int64_t tag = binary_ ? 0 : integer("an element number");
      const std::int64_t type = integer("an element type");
      const std::int64_t run = binary_ ? integer("the length of a run of elements") : 1;
      const std::int64_t tags = integer("the number of element tags");
      if (tags < 0 || run < 1 || run > stated - read) {
        scanner_.fail("a run of {} elements with {} tags cannot be; export the mesh again.", run,
                      tags);
      }
      for (std::int64_t i = 0; i < run; ++i) {
        const std::int64_t element = binary_ ? integer("an element number") : tag;
        for (std::int64_t t = 0; t < tags; ++t) integer("an element tag");
        read_element(element, type, &GmshParser::integer);
      }
      read += run;
    }
  }

  void read_elements_4() {
    const std::int64_t blocks = wide("the number of element blocks");
    const std::int64_t stated = wide("the number of elements");
    wide("the least element tag");
    wide("the greatest element tag");
    std::int64_t read = 0;
    for (std::int64_t block = 0; block < blocks; ++block) {
      integer("an entity's dimension");
      integer("an entity's tag");
      const std::int64_t type = integer("an element type");
      const std::int64_t count = wide("a block's number of elements");
      scanner_.checked_count(count, binary_ ? binary_element_4 : shortest_element, "elements");
      for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t element = wide("an element tag");
        read_element(element, type, &GmshParser::wide);
      }
      read += count;
    }
    check_total(stated, read, "elements");
  }

  /// Reads the nodes of one element with `next`; keeps it when it is a linear tet.
  void read_element(std::int64_t tag, std::int64_t type,
                    std::int64_t (GmshParser::*next)(std::string_view)) {
    if (type == linear_tet) {
      Tet tet;
      for (std::int32_t& vertex : tet) {
        const std::int64_t node = (this->*next)("a node tag");
        vertex = numbers_.find(node);
        if (vertex < 0) {
          scanner_.fail(
              "element {} names node {}, which $Nodes does not list; export the mesh "
              "again.",
              tag, node);
        }
      }
      mesh_.tets.push_back(tet);
      return;
    }
    const int nodes = nodes_of_type(type);
    if (nodes == 0) {
      scanner_.fail("element {} has the unknown type {}; save only the volume's linear tets.", tag,
                    type);
    }
    for (int i = 0; i < nodes; ++i) (this->*next)("a node tag");
    ++passed_over_[type];
  }

  void check_total(std::int64_t stated, std::int64_t found, std::string_view what) const {
    if (stated != found) {
      scanner_.fail("{} {} are announced but the blocks hold {}; export the mesh again.", stated,
                    what, found);
    }
  }

  /// Points, lines and faces belong to the geometry that was meshed; what fills space is a piece of
  /// the body that will be missing.
  void warn_of_solids(std::vector<std::string>& warnings) const {
    std::string solids;
    for (const auto& [type, count] : passed_over_) {
      const std::string_view kind = solids_of_type(type);
      if (kind.empty()) continue;
      solids += fmt::format("{}{} {} (type {})", solids.empty() ? "" : ", ", count, kind, type);
    }
    if (solids.empty()) return;
    warnings.push_back(
        fmt::format("{}: {} are passed over, the body is of the {} linear tets alone; export a "
                    "mesh of linear tets",
                    name_, solids, mesh_.tets.size()));
  }

  [[noreturn]] void fail_without_tets() const {
    std::string types;
    for (const auto& [type, count] : passed_over_) {
      types += fmt::format("{}{} of type {}", types.empty() ? "" : ", ", count, type);
    }
    scanner_.fail(
        "the mesh has no linear tets (type {}), other elements: {}; export a volume mesh "
        "of first order.",
        linear_tet, types.empty() ? "none" : types);
  }

  std::string const& name_;
  Scanner scanner_;
  bool is_4_ = false;
  bool binary_ = false;
  TetMesh mesh_;
  NodeNumbers numbers_;
  std::map<std::int64_t, std::int64_t> passed_over_;  // element type -> count
};

}  // namespace

TetMesh parse_gmsh(std::string_view content, std::string const& name,
                   std::vector<std::string>* warnings) {
  return GmshParser(content, name).parse(warnings);
}

}  // namespace taut
