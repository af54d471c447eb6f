// `taut check`: looks at every frame of a result for what must not be there.
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/intersections.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <cmath>
#include <optional>

namespace taut {

std::filesystem::path result_file(std::filesystem::path const& result) {
  if (std::filesystem::is_directory(result)) {
    auto const file = result / "result.vtkhdf";
    if (std::filesystem::exists(file)) return file;
    throw Error("{}: the folder holds no result.vtkhdf; name a folder that `taut run` wrote",
                result.string());
  }
  if (!std::filesystem::exists(result)) {
    throw Error("{}: there is no such result; name a folder that `taut run` wrote",
                result.string());
  }
  return result;
}

namespace {
std::size_t not_finite(std::vector<Point> const& field) {
  std::size_t count = 0;
  for (Point const& p : field) {
    count += !(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]));
  }
  return count;
}
}  // namespace

namespace {

/// Material points: what is not finite, and J <= 0.
int check_particles(ResultReader const& reader) {
  ResultMesh const& all = reader.mesh();
  std::int64_t bad = 0;
  for (std::int64_t frame = 0; frame < reader.frames(); ++frame) {
    std::size_t lost = not_finite(reader.positions(frame));
    if (reader.has_velocities()) lost += not_finite(reader.velocities(frame));
    auto const J = reader.scalar("J", frame);
    std::size_t inverted = 0, first = 0;
    for (std::size_t p = reader.particles(frame); p-- > 0;) {
      if (J[p] > 0) continue;  // what is not a number counts as inverted
      ++inverted;
      first = p;
    }
    if (inverted == 0 && lost == 0) continue;
    ++bad;
    fmt::print("frame {} ({:.6g} s): {} inverted particles{}, {} values not finite\n", frame,
               reader.times()[frame], inverted,
               inverted == 0 ? "" : fmt::format(" (first: {})", first), lost);
  }
  fmt::print("{} frames of {} particles: {}\n", reader.frames(), all.particles,
             bad == 0 ? "clean" : fmt::format("{} with faults", bad));
  return bad == 0 ? 0 : 1;
}

}  // namespace

int check_command(std::filesystem::path const& result, bool intersections) {
  ResultReader const reader(result_file(result));
  ResultMesh const& all = reader.mesh();
  if (all.particles > 0) return check_particles(reader);
  TetMesh const& mesh = all.mesh;
  std::optional<ObjectIntersections> surface;
  if (intersections) surface.emplace(all);
  constexpr std::int64_t in_detail = 3;  // frames whose first intersections are listed
  std::int64_t bad = 0, intersecting = 0;
  std::size_t sum = 0;
  for (std::int64_t frame = 0; frame < reader.frames(); ++frame) {
    auto const x = reader.positions(frame);
    auto const inverted = inverted_tets(mesh, x);
    std::size_t lost = not_finite(x);
    std::vector<Intersection> found;
    bool const looked = surface && lost == 0;
    if (looked) found = surface->find(x);
    if (reader.has_velocities()) lost += not_finite(reader.velocities(frame));
    if (inverted.empty() && lost == 0 && found.empty()) continue;
    ++bad;
    fmt::print("frame {} ({:.6g} s): {} inverted elements{}, {} values not finite{}\n", frame,
               reader.times()[frame], inverted.size(),
               inverted.empty() ? "" : fmt::format(" (first: {})", inverted.front()), lost,
               !found.empty()       ? ", " + surface->count(found)
               : surface && !looked ? ", not looked for intersections"
                                    : "");
    if (found.empty()) continue;
    sum += found.size();
    if (++intersecting <= in_detail) fmt::print("{}", surface->first_few(found, 3));
  }
  fmt::print("{} frames of {} tets: {}{}\n", reader.frames(), mesh.tets.size(),
             bad == 0 ? "clean" : fmt::format("{} with faults", bad),
             !intersections ? ", not looked for intersections"
             : sum > 0      ? fmt::format("; {} intersections in {} of them", sum, intersecting)
                            : "");
  return bad == 0 ? 0 : 1;
}

}  // namespace taut
