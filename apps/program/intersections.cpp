#include <taut/apps/program/intersections.hpp>

#include <taut/core/fem/connected.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace taut {

ObjectIntersections::ObjectIntersections(ResultMesh const& mesh) : test_(pieces(mesh)) {}

IntersectionMesh ObjectIntersections::pieces(ResultMesh const& mesh) {
  std::size_t const vertices = mesh.mesh.points.size(), tets = mesh.mesh.tets.size();
  IntersectionMesh result{boundary_faces(mesh.mesh.tets), {}, {}};
  result.body.assign(vertices, -1);
  std::vector<std::int32_t> number(vertices, -1);
  auto const add = [&](auto const& cell, std::int32_t first, std::int32_t object) {
    std::int32_t& piece = number[first];
    if (piece < 0) {
      piece = static_cast<std::int32_t>(name_of_body_.size());
      name_of_body_.push_back(mesh.object_names[object]);
      is_obstacle_.push_back(mesh.kind(object) != ObjectKind::body);
    }
    for (std::int32_t const v : cell) result.body[v] = piece;
  };
  auto const first_of_tets = smallest_connected(vertices, mesh.mesh.tets);
  for (std::size_t t = 0; t < tets; ++t) {
    Tet const& tet = mesh.mesh.tets[t];
    add(tet, first_of_tets[tet[0]], mesh.object[t]);
  }
  auto const first_of_triangles = smallest_connected(vertices, mesh.triangles);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle const& triangle = mesh.triangles[t];
    std::int32_t const object = mesh.object[tets + t];
    if (mesh.kind(object) == ObjectKind::drawn_only) continue;
    add(triangle, first_of_triangles[triangle[0]], object);
    result.triangles.push_back(triangle);
  }
  result.edges = edges_of(result.triangles);
  return result;
}

std::vector<Intersection> ObjectIntersections::find(std::span<Point const> x) const {
  std::vector<Intersection> found = test_.find(x);
  std::erase_if(found, [&](Intersection const& i) {
    return is_obstacle_[i.edge_body] && is_obstacle_[i.triangle_body];
  });
  return found;
}

std::string ObjectIntersections::count(std::vector<Intersection> const& found) const {
  std::map<std::pair<std::string, std::string>, std::size_t> pairs;
  for (Intersection const& i : found) {
    std::string const& a = name_of_body_[i.edge_body];
    std::string const& b = name_of_body_[i.triangle_body];
    ++pairs[std::minmax(a, b)];
  }
  // The most frequent pairs; the map has them by name, which settles ties.
  std::vector<std::pair<std::pair<std::string, std::string>, std::size_t>> sorted(pairs.begin(),
                                                                                  pairs.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](auto const& a, auto const& b) { return a.second > b.second; });
  constexpr std::size_t most = 3;
  std::string of_whom;
  for (std::size_t k = 0; k < std::min(most, sorted.size()); ++k) {
    auto const& [names, number] = sorted[k];
    of_whom += fmt::format("{}{} of {} with {}", k == 0 ? "" : ", ", number, names.first,
                           names.first == names.second ? "itself" : names.second);
  }
  if (sorted.size() > most)
    of_whom += fmt::format(", and {} more pairs of objects", sorted.size() - most);
  return fmt::format("{} intersection{} ({})", found.size(), found.size() == 1 ? "" : "s", of_whom);
}

std::string ObjectIntersections::first_few(std::vector<Intersection> const& found,
                                           std::size_t most) const {
  std::string lines;
  for (std::size_t k = 0; k < std::min(most, found.size()); ++k)
    lines += fmt::format("  {}\n", text(found[k]));
  if (found.size() > most) lines += fmt::format("  and {} more\n", found.size() - most);
  return lines;
}

}  // namespace taut
