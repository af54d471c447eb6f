#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/first_few.hpp>
#include <utility>

namespace taut {
namespace {

constexpr double zero_volume = 1e-12;  // of 6V over the longest edge cubed
constexpr double sliver_quality = 0.05;

Point difference(Point const& a, Point const& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double dot(Point const& a, Point const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point cross(Point const& a, Point const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point const& vertex(TetMesh const& mesh, std::int32_t index) {
  return mesh.points[static_cast<std::size_t>(index)];
}

std::array<double, 6> squared_edges(TetMesh const& mesh, Tet const& tet) {
  std::array<double, 6> edges{};
  std::size_t e = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) {
      const Point d = difference(vertex(mesh, tet[b]), vertex(mesh, tet[a]));
      edges[e++] = dot(d, d);
    }
  }
  return edges;
}

/// "3 tets (4, 17, 203)", with the first few by name.
std::string named(std::vector<std::size_t> const& elements, std::string_view noun,
                  std::string_view plural) {
  constexpr std::size_t shown = 6;
  return fmt::format("{} {} ({})", elements.size(), elements.size() == 1 ? noun : plural,
                     first_few(elements, shown));
}

std::string tets(std::vector<std::size_t> const& elements) {
  return named(elements, "tet", "tets");
}

void check_points(TetMesh const& mesh, std::string const& name) {
  std::vector<std::size_t> bad;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Point const& x = mesh.points[i];
    if (!std::isfinite(x[0]) || !std::isfinite(x[1]) || !std::isfinite(x[2])) bad.push_back(i);
  }
  if (bad.empty()) return;
  throw Error("mesh {}: {} with coordinates that are not finite; export the mesh again.", name,
              named(bad, "vertex", "vertices"));
}

void check_indices(TetMesh const& mesh, std::string const& name) {
  std::vector<std::size_t> bad;
  const auto n = static_cast<std::int64_t>(mesh.points.size());
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    const auto [least, most] = std::minmax_element(mesh.tets[i].begin(), mesh.tets[i].end());
    if (*least < 0 || *most >= n) bad.push_back(i);
  }
  if (bad.empty()) return;
  throw Error("mesh {}: {} with a vertex that is not among its {} vertices; export the mesh again.",
              name, tets(bad), n);
}

/// Volumes, qualities and orientation; flips what may be flipped.
void check_shapes(TetMesh& mesh, std::string const& name, Orientation orientation,
                  MeshReport& report) {
  std::vector<std::size_t> flat;
  std::vector<std::size_t> inverted;
  std::vector<std::size_t> slivers;
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    Tet const& tet = mesh.tets[i];
    const double volume = six_volume(mesh, tet);
    const auto edges = squared_edges(mesh, tet);
    const double longest = std::sqrt(*std::max_element(edges.begin(), edges.end()));
    // Negated, so that an overflow to NaN counts as flat too.
    if (!(std::abs(volume) > zero_volume * longest * longest * longest)) {
      flat.push_back(i);
      continue;
    }
    if (volume < 0) inverted.push_back(i);
    const double quality = mean_ratio(mesh, tet);
    if (quality < sliver_quality) slivers.push_back(i);
    report.least_quality = std::min(report.least_quality, quality);
    report.volume += std::abs(volume) / 6;
  }
  if (!flat.empty()) {
    throw Error("mesh {}: {} of zero volume; remove them or mesh the body again.", name,
                tets(flat));
  }
  const bool all = inverted.size() == mesh.tets.size();
  if (!inverted.empty() && !all && orientation == Orientation::require) {
    throw Error(
        "mesh {}: {} inverted, of {} in all; exchange two vertices of each (fix the "
        "orientation) or mesh the body again.",
        name, tets(inverted), mesh.tets.size());
  }
  if (!inverted.empty()) {
    for (const std::size_t i : inverted) std::swap(mesh.tets[i][2], mesh.tets[i][3]);
    report.flipped = std::ssize(inverted);
    report.warnings.push_back(
        all ? fmt::format("mesh {}: all {} tets were oriented negatively and have been flipped.",
                          name, mesh.tets.size())
            : fmt::format("mesh {}: {} inverted and flipped.", name, tets(inverted)));
  }
  if (!slivers.empty()) {
    report.warnings.push_back(fmt::format(
        "mesh {}: {} of mean-ratio quality below {} (worst {:.2g}, 1 is regular), which slow the "
        "solver; mesh the body again if it matters.",
        name, tets(slivers), sliver_quality, report.least_quality));
  }
}

/// The sorted vertices of every simplex with its number, in order of the vertices.
template <std::size_t Size>
using Keys = std::vector<std::pair<std::array<std::int32_t, Size>, std::size_t>>;

void check_duplicates(TetMesh const& mesh, std::string const& name) {
  Keys<4> keys(mesh.tets.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    keys[i] = {mesh.tets[i], i};
    std::sort(keys[i].first.begin(), keys[i].first.end());
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> duplicates;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first == keys[i - 1].first) duplicates.push_back(keys[i].second);
  }
  if (duplicates.empty()) return;
  std::sort(duplicates.begin(), duplicates.end());
  throw Error("mesh {}: {} with the four vertices of an earlier tet; remove the duplicates.", name,
              tets(duplicates));
}

void warn_of_crowded_faces(TetMesh const& mesh, std::string const& name, MeshReport& report) {
  Keys<3> keys;
  keys.reserve(4 * mesh.tets.size());
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    Tet t = mesh.tets[i];
    std::sort(t.begin(), t.end());
    keys.push_back({{t[0], t[1], t[2]}, i});
    keys.push_back({{t[0], t[1], t[3]}, i});
    keys.push_back({{t[0], t[2], t[3]}, i});
    keys.push_back({{t[1], t[2], t[3]}, i});
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> crowded;  // the third and later tets of a face
  for (std::size_t i = 2; i < keys.size(); ++i) {
    if (keys[i].first == keys[i - 2].first) crowded.push_back(keys[i].second);
  }
  if (crowded.empty()) return;
  std::sort(crowded.begin(), crowded.end());
  crowded.erase(std::unique(crowded.begin(), crowded.end()), crowded.end());
  report.warnings.push_back(
      fmt::format("mesh {}: {} on a face that two other tets share already, so parts of the body "
                  "overlap; mesh the body again if that is not meant.",
                  name, tets(crowded)));
}

void check_isolated(TetMesh const& mesh, std::string const& name) {
  std::vector<bool> used(mesh.points.size(), false);
  for (Tet const& tet : mesh.tets) {
    for (const std::int32_t v : tet) used[static_cast<std::size_t>(v)] = true;
  }
  std::vector<std::size_t> isolated;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) isolated.push_back(i);
  }
  if (isolated.empty()) return;
  throw Error(
      "mesh {}: {} in no tet, which would have no mass; export only the nodes that tets "
      "use.",
      name, named(isolated, "vertex", "vertices"));
}

}  // namespace

double six_volume(TetMesh const& mesh, Tet const& tet) {
  Point const& origin = vertex(mesh, tet[0]);
  return dot(
      difference(vertex(mesh, tet[1]), origin),
      cross(difference(vertex(mesh, tet[2]), origin), difference(vertex(mesh, tet[3]), origin)));
}

double mean_ratio(TetMesh const& mesh, Tet const& tet) {
  double squares = 0;
  for (const double e : squared_edges(mesh, tet)) squares += e;
  const double three_volumes = std::abs(six_volume(mesh, tet)) / 2;
  return 12 * std::cbrt(three_volumes * three_volumes) / squares;
}

MeshReport check_mesh(TetMesh& mesh, std::string const& name, Orientation orientation) {
  if (mesh.tets.empty()) {
    throw Error("mesh {}: it has no tets; name a volume mesh instead of a surface.", name);
  }
  MeshReport report;
  check_points(mesh, name);
  check_indices(mesh, name);
  check_shapes(mesh, name, orientation, report);
  check_duplicates(mesh, name);
  check_isolated(mesh, name);
  warn_of_crowded_faces(mesh, name, report);
  return report;
}

}  // namespace taut
