#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/render.hpp>
#include <taut/apps/program/render_python.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <charconv>

namespace taut {
namespace {

void require_choice(char const* option, std::string const& value,
                    std::vector<std::string> const& choices) {
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return;
  std::string list;
  for (std::string const& choice : choices) list += (list.empty() ? "" : ", ") + choice;
  throw Error("{} {}: choose one of {}", option, value, list);
}

void require_absent(std::filesystem::path const& file, bool force) {
  if (force || !std::filesystem::exists(file)) return;
  throw Error("{}: is there already: choose another --out or replace it with --force",
              file.string());
}

}  // namespace

std::vector<int> resolve_frames(std::vector<std::string> const& names, int frames) {
  if (frames == 0) throw Error("the result holds no frame yet: let `taut run` write one");
  std::vector<int> numbers;
  if (names.empty()) numbers = {0, frames / 2, frames - 1};
  for (std::string const& name : names) {
    int number = frames - 1;
    if (name != "last") {
      auto const [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
      bool const whole = error == std::errc() && end == name.data() + name.size();
      if (!whole || number < 0 || number >= frames) {
        throw Error("--frames {}: the result has the frames 0 to {}, and \"last\"", name,
                    frames - 1);
      }
    }
    numbers.push_back(number);
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

int render_command(RenderOptions const& options) {
  namespace fs = std::filesystem;
  require_choice("--colour", options.colour, {"object", "speed", "displacement"});
  require_choice("--animation", options.animation, {"gif", "mp4", "none"});
  fs::path const result = result_file(options.result);
  fs::path const out = options.out.empty() ? result.parent_path() / "pictures" : options.out;

  int frames = 0;
  std::vector<std::string> kinds;
  {
    // The script opens the file itself.
    ResultReader const reader(result);
    frames = static_cast<int>(reader.frames());
    for (ObjectKind const kind : reader.mesh().object_kind)
      kinds.push_back(std::to_string(static_cast<int>(kind)));
    if (options.colour == "speed" && !reader.has_velocities()) {
      throw Error("{}: the result has no velocities: choose --colour displacement",
                  result.string());
    }
  }
  std::vector<std::string> arguments{"--result", fs::absolute(result).string(), "--out",
                                     fs::absolute(out).string(), "--frames"};
  for (int frame : resolve_frames(options.frames, frames)) {
    require_absent(out / fmt::format("frame_{:05}.png", frame), options.force);
    arguments.push_back(std::to_string(frame));
  }
  arguments.push_back("--kinds");
  arguments.insert(arguments.end(), kinds.begin(), kinds.end());
  arguments.insert(arguments.end(),
                   {"--colour", options.colour, "--size", std::to_string(options.width),
                    std::to_string(options.height), "--view"});
  for (double v : options.view) arguments.push_back(fmt::format("{}", v));
  DrawingScript script{"draw_result.py", {"pyvista"}, {"pyvista>=0.47,<0.50", "vtk>=9.4,<9.8"}};
  if (options.animation != "none" && frames > 1) {
    fs::path const animation = out / ("animation." + options.animation);
    require_absent(animation, options.force);
    arguments.insert(arguments.end(), {"--animation", fs::absolute(animation).string(), "--fps",
                                       fmt::format("{}", options.frames_per_second),
                                       "--most-frames", std::to_string(options.most_frames)});
    if (options.animation == "mp4") {
      script.modules.insert(script.modules.end(), {"imageio", "imageio_ffmpeg"});
      script.packages.insert(script.packages.end(), {"imageio<3", "imageio-ffmpeg<1"});
    }
  }
  fs::create_directories(out);
  run_drawing(script, arguments, result);
  fmt::print("pictures {}\n", out.string());
  return 0;
}

}  // namespace taut
