#include <taut/apps/program/intersections.hpp>

#include <taut/contact/connected.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace taut {

namespace {

IntersectionMesh boundary(std::vector<Tet> const& tets, std::vector<std::int32_t> const& body) {
  auto const faces = boundary_faces(tets);
  return {faces, edges_of(faces), body};
}

}  // namespace

ObjectIntersections::ObjectIntersections(std::vector<Tet> const& tets,
                                         std::span<std::int32_t const> object,
                                         std::vector<std::string> const& names,
                                         std::size_t vertices)
    : ObjectIntersections(tets, pieces(tets, object, names, vertices)) {}

ObjectIntersections::ObjectIntersections(std::vector<Tet> const& tets, Pieces pieces)
    : name_of_body_(std::move(pieces.names)), test_(boundary(tets, pieces.of_vertex)) {}

ObjectIntersections::Pieces ObjectIntersections::pieces(std::vector<Tet> const& tets,
                                                        std::span<std::int32_t const> object,
                                                        std::vector<std::string> const& names,
                                                        std::size_t vertices) {
  auto const first = smallest_connected(vertices, tets);
  Pieces pieces{std::vector<std::int32_t>(vertices, -1), {}};
  std::vector<std::int32_t> number(vertices, -1);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    std::int32_t& piece = number[first[tets[t][0]]];
    if (piece < 0) {
      piece = static_cast<std::int32_t>(pieces.names.size());
      pieces.names.push_back(names[object[t]]);
    }
    for (std::int32_t const v : tets[t]) pieces.of_vertex[v] = piece;
  }
  return pieces;
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
