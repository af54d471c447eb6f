// `taut render`: pictures of frames of a result, and an animation.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace taut {

struct RenderOptions {
  std::filesystem::path result;         ///< a folder that `taut run` wrote, or a result file
  std::vector<std::string> frames;      ///< numbers or "last"; empty: first, middle and last
  std::string colour = "object";        ///< or "speed", "displacement"
  std::string animation = "gif";        ///< "gif", "mp4" or "none"
  double frames_per_second = 30;        ///< of the animation
  int most_frames = 150;                ///< in the animation; more are thinned out
  int width = 1280, height = 720;       ///< pixels
  std::vector<double> view{1, 0.5, 2};  ///< from the scene towards the camera
  std::filesystem::path out;            ///< empty: the folder `pictures` beside the result
  bool force = false;                   ///< replaces pictures that are there
};

/// Writes frame_00010.png and so on, and animation.gif. Throws Error.
int render_command(RenderOptions const& options);

/// Frame numbers for what the user has named. Throws Error for a name that is no frame.
std::vector<int> resolve_frames(std::vector<std::string> const& names, int frames);

}  // namespace taut
