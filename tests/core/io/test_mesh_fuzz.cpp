// Damaged mesh files: whatever a reader is given, it returns a mesh or throws taut::Error.
// Sanitizers watch the rest (preset serial-debug).
#include <array>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <functional>
#include <random>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/io/mesh_reader.hpp>

using namespace taut;
using namespace taut::test;

namespace {

constexpr int mutations = 4000;  // per file

class Mutator {
public:
  std::string operator()(std::string text) {
    for (std::size_t n = 1 + below(3); n > 0 && !text.empty(); --n) {
      switch (below(6)) {
        case 0:
          text[below(text.size())] ^= static_cast<char>(1 << below(8));
          break;
        case 1:
          text[below(text.size())] = static_cast<char>(below(256));
          break;
        case 2:
          text.resize(below(text.size()));
          break;
        case 3:
          replace_number(text);
          break;
        case 4:
          remove_line(text);
          break;
        case 5:
          text.insert(below(text.size()), text, below(text.size()), below(40));
          break;
      }
    }
    return text;
  }

private:
  std::size_t below(std::size_t end) { return random_() % end; }

  void replace_number(std::string& text) {
    static const std::array<std::string, 14> numbers{
        "0",   "-1",         "1",          "99",    "2147483647",          "2147483648",
        "-7",  "4294967295", "4294967296", "1e308", "9223372036854775807", "-9223372036854775808",
        "nan", "1e-320"};
    const std::size_t begin = text.find_first_of("0123456789", below(text.size()));
    if (begin == std::string::npos) return;
    const std::size_t end = text.find_first_not_of("0123456789.e-", begin);
    text.replace(begin, std::min(end, text.size()) - begin, numbers[below(numbers.size())]);
  }

  void remove_line(std::string& text) {
    const std::size_t begin = text.find('\n', below(text.size()));
    if (begin == std::string::npos) return;
    const std::size_t end = text.find('\n', begin + 1);
    text.erase(begin, std::min(end, text.size()) - begin);
  }

  std::mt19937_64 random_{20240607};
};

/// Applies `read` to mutations of `good`; it may return or throw taut::Error. Both must happen.
void fuzz(std::string const& good, std::function<void(std::string const&)> const& read) {
  Mutator mutate;
  int parsed = 0;
  int refused = 0;
  for (int i = 0; i < mutations; ++i) {
    const std::string bad = mutate(good);
    try {
      read(bad);
      ++parsed;
    } catch (Error const& error) {
      ++refused;
      const std::string text = error.what();
      if (text.find('\n') != std::string::npos) FAIL("more than one line: " << text);
    } catch (std::exception const& other) {
      FAIL("mutation " << i << " threw another exception: " << other.what());
    }
  }
  CHECK(parsed > 0);
  CHECK(refused > mutations / 4);
}

/// A mesh that a reader returned must be fit for the checks that follow.
void use(TetMesh mesh) {
  check_mesh(mesh, "fuzzed", Orientation::fix);
  boundary_faces(mesh.tets);
}

}  // namespace

TEST_CASE("damaged gmsh files are refused or read") {
  for (const bool binary : {false, true}) {
    const auto read = [](std::string const& content) { use(parse_gmsh(content, "a.msh")); };
    fuzz(msh_2(two_tets(), binary), read);
    fuzz(msh_4(two_tets(), binary), read);
  }
}

TEST_CASE("damaged TetGen files are refused or read") {
  const std::string nodes = tetgen_nodes(two_tets(), 1, true);
  const std::string elements = tetgen_elements(two_tets(), 1, true);
  fuzz(nodes, [&](std::string const& bad) { use(parse_tetgen(bad, "a.node", elements, "a.ele")); });
  fuzz(elements, [&](std::string const& bad) { use(parse_tetgen(nodes, "a.node", bad, "a.ele")); });
}

TEST_CASE("damaged OBJ files are refused or read") {
  fuzz("# a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1\nf -1 -2 -3\n",
       [](std::string const& bad) {
         for (Triangle const& t : parse_obj(bad, "a.obj").triangles) {
           if (t[0] < 0 || t[1] < 0 || t[2] < 0) FAIL("a negative vertex");
         }
       });
}
