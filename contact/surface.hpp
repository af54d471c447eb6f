// The collision surface: the triangles that can touch, with their edges and vertices, in the
// numbering of the mesh's vertices. The boundary of a tet mesh (boundary_faces) and a mesh of
// triangles alone (a moving obstacle) enter alike, and several bodies are one surface.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/tet_mesh.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

namespace taut {

struct Surface {
  std::vector<std::int32_t> vertices;  ///< of the triangles, ascending
  std::vector<Edge> edges;             ///< each once, lower vertex first, in lexicographic order
  std::vector<Triangle> triangles;     ///< as given; counter-clockwise seen from outside
  std::vector<int> object;             ///< per vertex of the mesh: the body that it belongs to
};

/// `object[v]` says which body vertex v of the mesh belongs to. Throws Error for a triangle that
/// names a vertex twice, one that does not exist, or vertices of two bodies.
Surface make_surface(std::vector<Triangle> triangles, std::vector<int> object);

/// What is unusual about a surface. Contact works on all of it, but an open or crowded edge has
/// no inside, so it often tells of a mesh that was exported wrongly.
struct SurfaceReport {
  std::vector<Edge> open;             ///< edges of one triangle
  std::vector<Edge> crowded;          ///< edges of more than two triangles: not a manifold
  std::vector<Edge> twisted;          ///< edges whose two triangles are oriented against each other
  std::vector<std::size_t> repeated;  ///< triangles with the vertices of an earlier one
  std::vector<std::string> warnings;  ///< one sentence for each kind that occurs, naming the first
};

/// `name` is the surface in the warnings; vertices and triangles count from 0.
SurfaceReport check_surface(Surface const& surface, std::string const& name);

struct EdgeLengths {
  double mean = 0, min = 0, max = 0;  ///< m; zero if there are no edges
};

/// Of the edges of `surface` with its vertices at `points`, m.
EdgeLengths edge_lengths(Surface const& surface, std::span<Point const> points);

/// Of the box around the vertices of `surface`, m.
double box_diagonal(Surface const& surface, std::span<Point const> points);

/// From what distance on contact acts if nothing is said, m: 0.3 of the mean edge of the body whose
/// edges are shortest, so that nothing small is held off further than it is large.
double default_dhat(Surface const& surface, std::span<Point const> points);

/// The surface where kernels read it.
template <class S>
struct SurfaceViews {
  using Indices =
      Kokkos::View<int const*, typename S::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>>;

  Indices vertex;    ///< those on the surface
  Indices edge;      ///< 2 vertices each
  Indices triangle;  ///< 3 vertices each
  Indices object;    ///< per vertex of the mesh

  int vertices() const { return static_cast<int>(vertex.extent(0)); }
  int edges() const { return static_cast<int>(edge.extent(0)) / 2; }
  int triangles() const { return static_cast<int>(triangle.extent(0)) / 3; }
};

template <class S>
SurfaceViews<S> copy_surface(Surface const& surface) {
  std::vector<int> edge, triangle;
  for (Edge const& e : surface.edges) edge.insert(edge.end(), e.begin(), e.end());
  std::vector<Triangle> sorted = surface.triangles;
  std::stable_sort(sorted.begin(), sorted.end(), [](Triangle const& a, Triangle const& b) {
    return *std::min_element(a.begin(), a.end()) < *std::min_element(b.begin(), b.end());
  });
  for (Triangle const& t : sorted) triangle.insert(triangle.end(), t.begin(), t.end());
  return {to_space<S>("surface_vertex", surface.vertices), to_space<S>("surface_edge", edge),
          to_space<S>("surface_triangle", triangle), to_space<S>("surface_object", surface.object)};
}

}  // namespace taut
