// Scenes that nobody has seen: bodies of any shape, size, stiffness and density, of tets or of
// material points, thrown at each other and at an obstacle, with the defaults. TAUT_RANDOM_SCENES=N
// runs scenes 0 to N - 1 instead of a few.
#include "command_line.hpp"

#include <taut/apps/program/commands.hpp>
#include <taut/core/io/file.hpp>

#include <fmt/format.h>
#include <support/data.hpp>

#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

using namespace taut;
using namespace taut::test;

namespace {

/// The same numbers wherever it runs, which distributions of the standard library do not promise;
/// as long as no two are drawn in one argument list, whose order is the compiler's.
class Dice {
public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * double(engine_()) / double(std::mt19937::max());
  }
  /// As likely in every decade.
  double decades(double low, double high) {
    return std::pow(10, between(std::log10(low), std::log10(high)));
  }
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
  template <class T, std::size_t n>
  T one_of(std::array<T, n> const& choices) {
    return choices[static_cast<std::size_t>(below(n))];
  }

private:
  std::mt19937 engine_;
};

/// A shape about `size` across.
std::string random_shape(Dice& dice, double size) {
  int const kind = dice.below(6), finer = dice.below(3);
  double const height = size * dice.between(0.3, 1), width = size * dice.between(0.3, 1);
  switch (kind) {
    case 0:
      return fmt::format("{{ kind = \"box\", size = [{}, {}, {}], resolution = {} }}", 0.7 * size,
                         height, width, 2 + finer);
    case 1:
      return fmt::format(
          "{{ kind = \"sheet\", length = {0}, width = {0}, thickness = {1}, resolution = {2} }}",
          size, 0.06 * size, 6 + 2 * finer);
    case 2:
      return fmt::format("{{ kind = \"sphere\", radius = {}, resolution = {} }}", 0.4 * size,
                         3 + finer);
    case 3:
      return fmt::format("{{ kind = \"torus\", radius = {}, tube_radius = {}, resolution = 2 }}",
                         0.35 * size, 0.12 * size);
    case 4:
      return fmt::format("{{ kind = \"rod\", radius = {}, length = {}, resolution = 3 }}",
                         0.1 * size, size);
    default:
      return fmt::format("{{ kind = \"letter_e\", height = {}, depth = {}, resolution = 9 }}",
                         0.7 * size, 0.3 * size);
  }
}

/// Bodies above each other, each thrown at the one below it.
std::string random_scene(unsigned seed) {
  Dice dice(seed);
  double const size = dice.one_of<double>(std::array{0.05, 0.3, 1.0, 4.0});
  double const step = dice.one_of<double>(std::array{0.002, 0.01, 0.02, 0.04});
  char const* const integrator = dice.below(4) == 0 ? "bdf2" : "implicit_euler";
  double const friction = dice.one_of<double>(std::array{0.0, 0.2, 0.6});
  std::string text = fmt::format(
      "name = \"random_{}\"\ngravity = [0, -9.81, 0]\n[time]\nstep = {}\nframes = 10\n"
      "integrator = \"{}\"\n[contact]\nfriction = {}\n[[obstacle]]\n",
      seed, step, integrator, friction);
  if (dice.below(2) == 0) {
    text += "name = \"floor\"\nshape = { kind = \"half_space\" }\n";
  } else {
    text += fmt::format(
        "name = \"room\"\nshape = {{ kind = \"box\", inside = true, size = [{0}, {0}, {0}] }}\n"
        "translate = [0, {1}, 0]\n",
        10 * size, 5 * size);
  }
  // So fast that what is highest reaches the floor in most of the steps.
  double const fastest = 3 * size / (10 * step);
  int const bodies = 1 + dice.below(3);
  for (int b = 0; b < bodies; ++b) {
    std::string const shape = random_shape(dice, size);
    // Braces keep the order of what is drawn.
    std::array const axis{dice.between(-1, 1), dice.between(-1, 1), dice.between(0.1, 1)};
    std::array const place{size * dice.between(-0.2, 0.2), size * (0.8 + 1.5 * b),
                           size * dice.between(-0.2, 0.2)};
    std::array const velocity{fastest * dice.between(-0.2, 0.2), -fastest * dice.between(0.3, 1)};
    std::array const models{"stable_neo_hookean", "neo_hookean", "fixed_corotated", "arap"};
    double const angle = dice.between(0, 360), tilt = dice.between(-1, 1);
    double const spin = dice.between(-200, 200) * std::min(1.0, 0.01 / step);
    char const* const model = dice.one_of<char const*>(models);
    double const young = dice.decades(1e4, 1e8), poisson = dice.between(0.2, 0.45);
    double const density = dice.decades(100, 8000);
    text += fmt::format(
        "[[object]]\nname = \"body_{}\"\nshape = {}\ntranslate = [{}, {}, {}]\n"
        "rotate = {{ axis = [{}, {}, {}], angle = {} }}\n",
        b, shape, place[0], place[1], place[2], axis[0], axis[1], axis[2], angle);
    text += fmt::format(
        "velocity = {{ linear = [{}, {}, 0], axis = [0, {}, 1], centre = [0, {}, 0], "
        "angular_velocity = {} }}\n",
        velocity[0], velocity[1], tilt, place[1], spin);
    text += fmt::format("material = {{ model = \"{}\", young = {}, poisson = {}, density = {} }}\n",
                        model, young, poisson, density);
  }
  return text;
}

/// What a material of this model may do besides.
std::string random_plasticity(Dice& dice, std::string_view model, double young) {
  int const kind = dice.below(4);
  double const yield = young * dice.decades(1e-3, 1e-1);
  double const compression = dice.decades(0.005, 0.05), angle = dice.between(20, 40);
  if (kind == 0 && model != "hencky_plastic") return "";
  if (kind == 1 && model != "hencky_plastic")
    return fmt::format(
        ", plasticity = {{ kind = \"snow\", compression = {}, stretch = {}, hardening = 10 }}",
        compression, compression / 3);
  if (kind == 2) return fmt::format(", plasticity = {{ kind = \"sand\", angle = {} }}", angle);
  return fmt::format(", plasticity = {{ kind = \"von_mises\", yield_stress = {} }}", yield);
}

/// Bodies of particles above each other, each thrown at the one below it, some eight cells thick.
std::string random_particles(unsigned seed) {
  Dice dice(seed);
  double const size = dice.one_of<double>(std::array{0.05, 0.3, 1.0, 4.0});
  double const step = dice.one_of<double>(std::array{0.002, 0.01, 0.02, 0.04});
  std::string text = fmt::format(
      "name = \"random_{}\"\ngravity = [0, -9.81, 0]\n[time]\nstep = {}\nframes = 4\n"
      "[grid]\nspacing = {}\ntransfer = \"{}\"\n",
      seed, step, size / 8, dice.one_of<char const*>(std::array{"apic", "rpic", "flip"}));
  text += fmt::format("[[boundary]]\nname = \"floor\"\ncontact = \"{}\"\n",
                      dice.one_of<char const*>(std::array{"stick", "slip", "separate"}));
  text += dice.below(2) == 0 ? "shape = { kind = \"half_space\" }\n"
                             : fmt::format(
                                   "shape = {{ kind = \"sphere\", radius = {0}, inside = true }}\n"
                                   "translate = [0, {0}, 0]\n",
                                   6 * size);
  std::array const models{"fixed_corotated", "neo_hookean", "hencky", "hencky_plastic"};
  double const fastest = 2 * size / (4 * step);
  int const bodies = 1 + dice.below(3);
  for (int b = 0; b < bodies; ++b) {
    int const kind = dice.below(3);
    std::string const shape =
        kind == 0   ? fmt::format("{{ kind = \"box\", size = [{0}, {1}, {0}] }}", size, 0.6 * size)
        : kind == 1 ? fmt::format("{{ kind = \"sphere\", radius = {} }}", 0.5 * size)
                    : fmt::format("{{ kind = \"torus\", radius = {}, tube_radius = {} }}",
                                  0.4 * size, 0.15 * size);
    std::array const velocity{fastest * dice.between(-0.2, 0.2), -fastest * dice.between(0.3, 1)};
    char const* const model = dice.one_of<char const*>(models);
    double const angle = dice.between(0, 360), spin = dice.between(-100, 100);
    double const young = dice.decades(1e4, 1e8), poisson = dice.between(0.1, 0.45);
    double const density = dice.decades(100, 8000), height = size * (1 + 1.8 * b);
    text += fmt::format(
        "[[object]]\nname = \"body_{}\"\nshape = {}\ntranslate = [0, {}, 0]\n"
        "rotate = {{ axis = [1, 1, 0], angle = {} }}\n",
        b, shape, height, angle);
    text += fmt::format(
        "velocity = {{ linear = [{}, {}, 0], centre = [0, {}, 0], angular_velocity = {} }}\n",
        velocity[0], velocity[1], height, spin);
    text +=
        fmt::format("material = {{ model = \"{}\", young = {}, poisson = {}, density = {}{} }}\n",
                    model, young, poisson, density, random_plasticity(dice, model, young));
  }
  return text;
}

/// Runs scenes of `make(seed)`, and has `look` judge their summaries.
template <class Make, class Look>
void run_random(Make const& make, CheckRun check, Look const& look) {
  char const* const asked = std::getenv("TAUT_RANDOM_SCENES");
  int const count = asked ? std::atoi(asked) : 6;
  for (int seed = 0; seed < count; ++seed) {
    ScratchFolder const folder;
    std::string const text = make(static_cast<unsigned>(seed));
    CAPTURE(seed, text);
    RunOptions options;
    options.scene.scene = folder.write("random.toml", text).string();
    options.out = folder.path() / "result";
    options.check = check;
    CHECK(run_command(options) == 0);
    auto const summary = test::read_json(options.out / "summary.json");
    CHECK(summary.at("ended") == "finished");
    CHECK(summary.at("steps_converged") == summary.at("frames_asked"));
    look(summary);
  }
}

}  // namespace

TEST_CASE("scenes that nobody has seen run clean", "[contact][scenes][random]") {
  run_random(random_scene, CheckRun::every_step, [](auto const& summary) {
    CHECK(summary.at("intersections") == "none");
    CHECK(summary.at("smallest_gap") > 0);
  });
}

TEST_CASE("scenes of material points that nobody has seen run clean",
          "[particles][scenes][random]") {
  run_random(random_particles, CheckRun::off,
             [](auto const& summary) { CHECK(summary.at("most_inverted_elements") == 0); });
}
