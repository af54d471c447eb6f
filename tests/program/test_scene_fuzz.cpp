// Thousands of spoilt scene files: each either loads or ends in Error, whatever was done to it.

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <array>
#include <random>

#include "scene_text.hpp"

using namespace taut;

namespace {

/// Spoils text the way hands and disks do: bytes, numbers, lines and pieces from elsewhere.
class Mutator {
public:
  explicit Mutator(std::vector<std::string> texts) : texts_(std::move(texts)) {}

  std::string operator()() {
    std::string text = texts_[below(texts_.size())];
    for (std::size_t edits = 1 + below(2); edits > 0; --edits) edit(text);
    return text;
  }

private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : engine_() % n; }

  void edit(std::string& text) {
    constexpr std::array<char const*, 20> pieces{
        "0",       "-1",        "1e308", "nan",     "inf",   "99999999999999999999",
        "\"\"",    "true",      "[]",    "{}",      "[[1]]", "=",
        "\n[[",    "]]\n",      ".",     "\"all\"", "0.5",   "\xff\xfe",
        "\n[a]\n", "2001-01-01"};
    constexpr std::array<char const*, 8> numbers{"0",    "1",    "2",   "0.3",
                                                 "-0.5", "1e-9", "7e4", "1e9"};
    std::size_t const at = below(text.size());
    switch (below(8)) {
      case 0:
        text[at] = static_cast<char>(engine_());
        break;
      case 1:
        text.erase(at, 1 + below(12));
        break;
      case 2:
        text.insert(at, pieces[below(pieces.size())]);
        break;
      case 3:
        replace_number(text, at, pieces[below(pieces.size())]);
        break;
      case 4:
        move_line(text, at);
        break;
      case 5: {
        std::string const& other = texts_[below(texts_.size())];
        text.insert(line_start(text, at), other.substr(line_start(other, below(other.size())), 80));
        break;
      }
      default:
        replace_number(text, at, numbers[below(numbers.size())]);
    }
    if (text.empty()) text = "\n";
  }

  static std::size_t line_start(std::string const& text, std::size_t at) {
    std::size_t const newline = text.rfind('\n', at);
    return newline == std::string::npos ? 0 : newline + 1;
  }

  static void replace_number(std::string& text, std::size_t from, char const* by) {
    std::size_t const first = text.find_first_of("0123456789", from);
    if (first == std::string::npos) return;
    std::size_t const last = text.find_first_not_of("0123456789.e", first);
    text.replace(first, last == std::string::npos ? std::string::npos : last - first, by);
  }

  void move_line(std::string& text, std::size_t at) {
    std::size_t const start = line_start(text, at);
    std::size_t const end = std::min(text.find('\n', start), text.size() - 1) + 1;
    std::string const line = text.substr(start, end - start);
    if (below(2) == 0) text.erase(start, end - start);
    text.insert(line_start(text, below(text.size() + 1)), line);
  }

  std::vector<std::string> texts_;
  std::mt19937_64 engine_{20261122};
};

/// Whether the geometry is small enough to be built thousands of times.
bool quick(ProceduralShape const& shape) {
  if (shape.resolution > 9) return false;
  if (auto const* rod = std::get_if<CylinderShape>(&shape.shape))
    return rod->length <= 10 * rod->radius;
  if (auto const* torus = std::get_if<TorusShape>(&shape.shape))
    return torus->radius <= 10 * torus->tube_radius;
  if (auto const* funnel = std::get_if<FunnelShape>(&shape.shape))
    return funnel->radius + funnel->thickness <= 10 * (funnel->height + funnel->spout);
  if (auto const* bowl = std::get_if<BowlShape>(&shape.shape))
    return bowl->thickness <= 10 * bowl->height;
  return true;
}

bool quick(Scene const& scene) {
  if (scene.objects.size() > 20) return false;
  for (SceneObject const& object : scene.objects) {
    auto const* shape = std::get_if<ProceduralShape>(&object.geometry);
    if (shape == nullptr || !quick(*shape)) return false;
  }
  for (SceneObstacle const& obstacle : scene.obstacles) {
    auto const* shape = std::get_if<ProceduralShape>(&obstacle.geometry);
    if (shape != nullptr && !quick(*shape)) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("spoilt scenes load or end in Error, never otherwise") {
  std::vector<std::string> texts{test::plain_scene + R"(
[[pin.motion]]
start = 1
end = 2
velocity = [0, 1, 0]
axis = [0, 1, 0]
centre = [0, 0, 0]
angular_velocity = 30

[[object]]
name = "ring"
shape = { kind = "torus", radius = 0.5, tube_radius = 0.2, resolution = 2 }
start = { kind = "random", seed = 3, box = [[0, 0, 0], [1, 1, 1]] }
rotate = { axis = [1, 0, 0], angle = 30 }
material = { model = "arap", young = 1e5, poisson = 0.4, density = 1000 }

[[object]]
name = "frame"
shape = { kind = "boxes", boxes = [[[0, 0, 0], [2, 1, 1]], [[0, 1, 0], [1, 2, 1]]], resolution = 2 }
material = { model = "arap", young = 1e5, poisson = 0.4, density = 1000 }

[[object]]
name = "tets"
shape = { kind = "tets", points = [[9, 0, 0], [8, 0, 0], [9, 1, 0], [9, 0, 1]], tets = [[0, 1, 2, 3]] }
copies = { count = [2, 1, 2], step = [0, 3, 4] }
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[obstacle]]
name = "ground"
shape = { kind = "half_space", point = [0, -5, 0] }
friction = 0.3

[[obstacle]]
name = "room"
shape = { kind = "box", inside = true, size = [20, 20, 20] }
motion = [{ velocity = [0, 1, 0] }]

[[obstacle]]
name = "funnel"
shape = { kind = "funnel", radius = 2, throat = 1, height = 1, spout = 0.5, thickness = 0.1, resolution = 3 }

[[obstacle]]
name = "cup"
shape = { kind = "bowl", radius = 2, thickness = 0.3, height = 1, resolution = 3 }
scale = 2

[solver]
tolerance = 1e-3
method = "newton"
)"};
  test::ScratchFolder const folder;
  for (auto const& entry : std::filesystem::directory_iterator(test::scene_folder())) {
    std::ifstream stream(entry.path());
    texts.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    folder.write(entry.path().filename(), texts.back());  // the bases of others
  }
  std::sort(texts.begin() + 1, texts.end());
  REQUIRE(texts.size() > 15);

  Mutator mutate(texts);
  int loaded = 0, built = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string const text = mutate();
    auto const file = folder.write("spoilt.toml", text);
    try {
      Scene const scene = load_scene(file);
      ++loaded;
      if (!quick(scene)) continue;
      build_geometry(scene);
      ++built;
    } catch (Error const& error) {
      ++refused;
      if (std::string_view(error.what()).size() < 20) FAIL(error.what() << "\n" << text);
    } catch (std::exception const& other) {
      FAIL(other.what() << "\n" << text);
    }
  }
  CHECK(loaded > 300);
  CHECK(built > 100);
  CHECK(refused > 1000);
}
