// What the io tests share: a private folder, the two-tet sample mesh and writers of the formats
// that the readers read, written from the formats' documentation and independent of the readers.
#pragma once

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/report/error.hpp>
#include <vector>

namespace taut::test {

/// A folder of its own per test, removed at its end.
class Folder {
public:
  Folder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() / fmt::format("taut-{}-{}", ::getpid(), count++);
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(Folder const&) = delete;
  Folder& operator=(Folder const&) = delete;
  std::filesystem::path operator/(std::string const& name) const { return path_ / name; }
  std::filesystem::path const& path() const { return path_; }

private:
  std::filesystem::path path_;
};

/// The sentence of the Error that `action` throws; every other outcome fails the test.
template <class Action>
std::string sentence(Action&& action) {
  try {
    action();
  } catch (Error const& error) {
    return error.what();
  }
  FAIL("no error was thrown");
  return {};
}

/// Checks that `text` holds every one of `parts`.
inline void check_says(std::string const& text, std::vector<std::string> const& parts) {
  for (std::string const& part : parts) CHECK_THAT(text, Catch::Matchers::ContainsSubstring(part));
}

/// Two tets that share a face; coordinates that need all 17 digits among them.
/// What f() returns in a process of its own, 1 if it throws: HDF5 keeps parts of damaged files open
/// and complains of them at its end.
template <class F>
int in_own_process(F const& f) {
  pid_t const child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    try {
      ::_exit(f());
    } catch (...) {
      ::_exit(1);
    }
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  return WEXITSTATUS(status);
}

inline TetMesh two_tets() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.0 / 3}, {0.1, 0.2, -0.7}},
          {{0, 1, 2, 3}, {0, 2, 1, 4}}};
}

/// Appends the bytes of a value to a binary file's content.
template <class T>
void put(std::string& out, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

/// The tag of vertex i: with gaps and falling, so that tags are not positions.
inline int sparse_tag(std::size_t i) { return 1000 - 7 * static_cast<int>(i); }

/// MSH 2.2: the nodes, one triangle (type 2) to pass over and the tets.
inline std::string msh_2(TetMesh const& mesh, bool binary) {
  std::string out = fmt::format("$MeshFormat\n2.2 {} 8\n", binary ? 1 : 0);
  if (binary) put<int>(out, 1), out += '\n';
  out += "$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"body\"\n$EndPhysicalNames\n";
  out += fmt::format("$Nodes\n{}\n", mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Point const& x = mesh.points[i];
    if (binary) {
      put<int>(out, sparse_tag(i));
      for (const double c : x) put(out, c);
    } else {
      out += fmt::format("{} {} {} {}\n", sparse_tag(i), x[0], x[1], x[2]);
    }
  }
  out += fmt::format("{}$EndNodes\n$Elements\n{}\n", binary ? "\n" : "", 1 + mesh.tets.size());
  if (binary) {
    for (const int word : {2, 1, 2, 1, 5, 6, sparse_tag(0), sparse_tag(1), sparse_tag(2)}) {
      put<int>(out, word);
    }
    for (const int word : {4, static_cast<int>(mesh.tets.size()), 2}) put<int>(out, word);
  } else {
    out += fmt::format("1 2 2 5 6 {} {} {}\n", sparse_tag(0), sparse_tag(1), sparse_tag(2));
  }
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    std::vector<int> words{2 + static_cast<int>(i)};
    if (!binary) words.insert(words.end(), {4, 2});
    words.insert(words.end(), {5, 6});
    for (const int v : mesh.tets[i]) words.push_back(sparse_tag(static_cast<std::size_t>(v)));
    for (const int word : words) {
      if (binary) {
        put<int>(out, word);
      } else {
        out += fmt::format("{} ", word);
      }
    }
    if (!binary) out += '\n';
  }
  return out + (binary ? "\n" : "") + "$EndElements\n";
}

/// MSH 4.1: two node blocks (the first parametric on a surface), a block of triangles, two of tets.
inline std::string msh_4(TetMesh const& mesh, bool binary) {
  std::string out = fmt::format("$MeshFormat\n4.1 {} 8\n", binary ? 1 : 0);
  if (binary) put<int>(out, 1), out += '\n';
  out += "$EndMeshFormat\n";
  const auto integers = [&](std::vector<int> const& values) {
    for (const int v : values) binary ? put<int>(out, v) : void(out += fmt::format("{} ", v));
  };
  const auto sizes = [&](std::vector<std::size_t> const& values) {
    for (const auto v : values) {
      binary ? put<std::uint64_t>(out, v) : void(out += fmt::format("{} ", v));
    }
    if (!binary) out += '\n';
  };
  const auto reals = [&](std::vector<double> const& values) {
    for (const double v : values) binary ? put<double>(out, v) : void(out += fmt::format("{} ", v));
    if (!binary) out += '\n';
  };
  const auto tag = [](auto i) {
    return static_cast<std::size_t>(sparse_tag(static_cast<std::size_t>(i)));
  };
  const std::size_t n = mesh.points.size();
  out += "$Nodes\n";
  sizes({2, n, tag(n - 1), tag(0)});
  integers({2, 9, 1});  // a surface, parametric: two more numbers per node
  sizes({2});
  sizes({tag(0)});
  sizes({tag(1)});
  for (std::size_t i = 0; i < 2; ++i) {
    Point const& x = mesh.points[i];
    reals({x[0], x[1], x[2], 0.25, 0.75});
  }
  integers({3, 9, 0});
  sizes({n - 2});
  for (std::size_t i = 2; i < n; ++i) sizes({tag(i)});
  for (std::size_t i = 2; i < n; ++i) {
    Point const& x = mesh.points[i];
    reals({x[0], x[1], x[2]});
  }
  out += binary ? "\n$EndNodes\n$Elements\n" : "$EndNodes\n$Elements\n";
  const std::size_t m = mesh.tets.size();
  sizes({3, 1 + m, 1, 1 + m});
  integers({2, 9, 2});
  sizes({1});
  sizes({1, tag(0), tag(1), tag(2)});
  const auto tets = [&](std::size_t first, std::size_t end) {
    integers({3, 9, 4});
    sizes({end - first});
    for (std::size_t i = first; i < end; ++i) {
      Tet const& t = mesh.tets[i];
      sizes({2 + i, tag(t[0]), tag(t[1]), tag(t[2]), tag(t[3])});
    }
  };
  tets(0, 1);
  tets(1, m);
  out += binary ? "\n$EndElements\n" : "$EndElements\n";
  return out + "$NodeData\n1\n\"unused\"\n$EndNodeData\n";
}

inline std::string tetgen_nodes(TetMesh const& mesh, int base, bool full_header) {
  std::string out =
      fmt::format("# nodes\n{}{}\n", mesh.points.size(), full_header ? "  3  1  1" : "");
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Point const& x = mesh.points[i];
    out += fmt::format("{}  {} {} {}{}\n", static_cast<int>(i) + base, x[0], x[1], x[2],
                       full_header ? "  0.5  1 # an attribute and a marker" : "");
  }
  return out + "# end\n";
}

inline std::string tetgen_elements(TetMesh const& mesh, int base, bool full_header) {
  std::string out = fmt::format("{}{}\n", mesh.tets.size(), full_header ? "  4  1" : "");
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    Tet const& t = mesh.tets[i];
    out += fmt::format("{} {} {} {} {}{}\n", static_cast<int>(i) + base, t[0] + base, t[1] + base,
                       t[2] + base, t[3] + base, full_header ? " 7" : "");
  }
  return out;
}

}  // namespace taut::test
