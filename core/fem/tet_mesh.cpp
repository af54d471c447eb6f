#include <algorithm>
#include <taut/core/fem/tet_mesh.hpp>
#include <utility>

namespace taut {

std::vector<Triangle> boundary_faces(std::vector<Tet> const& tets) {
  // Face k lies opposite vertex k and is counter-clockwise seen from outside a positive tet.
  constexpr std::array<std::array<std::size_t, 3>, 4> corners{
      {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  const auto face = [&](std::size_t id) {
    Tet const& tet = tets[id / 4];
    const auto& c = corners[id % 4];
    return Triangle{tet[c[0]], tet[c[1]], tet[c[2]]};
  };
  std::vector<std::pair<Triangle, std::size_t>> faces(4 * tets.size());  // sorted corners, id
  for (std::size_t id = 0; id < faces.size(); ++id) {
    Triangle key = face(id);
    std::sort(key.begin(), key.end());
    faces[id] = {key, id};
  }
  std::sort(faces.begin(), faces.end());

  std::vector<std::size_t> single;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].first == faces[i].first) ++end;
    if (end == i + 1) single.push_back(faces[i].second);
    i = end;
  }
  std::sort(single.begin(), single.end());  // the order of the tets, not of the keys

  std::vector<Triangle> boundary;
  boundary.reserve(single.size());
  for (const std::size_t id : single) boundary.push_back(face(id));
  return boundary;
}

TriangleMesh boundary_surface(TetMesh const& mesh) {
  TriangleMesh surface{{}, boundary_faces(mesh.tets)};
  std::vector<std::int32_t> number(mesh.points.size(), -1);
  for (Triangle const& triangle : surface.triangles)
    for (const std::int32_t v : triangle) number[static_cast<std::size_t>(v)] = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<std::int32_t>(surface.points.size());
    surface.points.push_back(mesh.points[v]);
  }
  for (Triangle& triangle : surface.triangles)
    for (std::int32_t& v : triangle) v = number[static_cast<std::size_t>(v)];
  return surface;
}

std::vector<Edge> edges_of(std::span<Triangle const> triangles) {
  std::vector<Edge> edges;
  for (Triangle const& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t const a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace taut
