// A lattice of cubes, some of them filled, and its split into tets: what procedural shapes are made
// of. core/fem/shapes.hpp says how the split is done and why.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/report/error.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace taut {

inline constexpr std::int64_t max_lattice_cells = std::int64_t{1} << 24;

using Cell = std::array<int, 3>;

/// Cells of a lattice, filled or empty. Axis 2 may close on itself.
class Lattice {
public:
  explicit Lattice(Cell const& size, bool filled = true, bool periodic = false)
      : size_(size), periodic_(periodic) {
    std::int64_t count = 1;
    for (int const n : size) {
      count *= n;  // each factor and the product so far are below 2^31 and 2^24: no overflow
      if (count > max_lattice_cells)
        throw Error("the shape needs more than {} lattice cells: lower its resolution",
                    max_lattice_cells);
    }
    filled_.assign(static_cast<std::size_t>(count), filled);
  }

  void fill(Cell const& low, Cell const& high) {
    for (int i = low[0]; i < high[0]; ++i)
      for (int j = low[1]; j < high[1]; ++j)
        for (int k = low[2]; k < high[2]; ++k) filled_[index({i, j, k})] = true;
  }

  bool filled(Cell cell) const {
    if (periodic_) cell[2] = (cell[2] + size_[2]) % size_[2];
    for (std::size_t a = 0; a < 3; ++a)
      if (cell[a] < 0 || cell[a] >= size_[a]) return false;
    return filled_[index(cell)];
  }

  Cell const& size() const { return size_; }
  bool periodic() const { return periodic_; }

private:
  std::size_t index(Cell const& c) const {
    return static_cast<std::size_t>((c[0] * size_[1] + c[1]) * size_[2] + c[2]);
  }

  Cell size_;
  bool periodic_;
  std::vector<bool> filled_;
};

/// Throws Error where filled cells touch in an edge or a vertex only.
void require_manifold(Lattice const& lattice);

/// Splits the filled cells into tets. `map` takes lattice coordinates u in [-1, 1]^3, exactly
/// antisymmetric about the middle, to a point.
template <class Map>
TetMesh split(Lattice const& lattice, Map const& map) {
  // Vertices sit on the lattice refined by two: corners at even coordinates, centres of cells at
  // odd.
  Cell const& n = lattice.size();
  Cell const doubled{2 * n[0] + 1, 2 * n[1] + 1, lattice.periodic() ? 2 * n[2] : 2 * n[2] + 1};
  auto const vertex = [&](Cell const& c) {
    int const z = lattice.periodic() ? (c[2] + doubled[2]) % doubled[2] : c[2];
    return static_cast<std::int32_t>((c[0] * doubled[1] + c[1]) * doubled[2] + z);
  };

  TetMesh mesh;
  for (std::size_t a = 0; a < 3; ++a) {
    std::size_t const b = (a + 1) % 3, c = (a + 2) % 3;
    bool const closed = a == 2 && lattice.periodic();
    for (int i = 0; i <= n[a] - closed; ++i)
      for (int j = 0; j < n[b]; ++j)
        for (int k = 0; k < n[c]; ++k) {
          auto const at = [&](int along, int across, int up) {
            Cell r{};
            r[a] = along, r[b] = across, r[c] = up;
            return r;
          };
          bool const below = lattice.filled(at(i - 1, j, k)), above = lattice.filled(at(i, j, k));
          if (!below && !above) continue;
          std::int32_t const low = vertex(at(below ? 2 * i - 1 : 2 * i, 2 * j + 1, 2 * k + 1));
          std::int32_t const high = vertex(at(above ? 2 * i + 1 : 2 * i, 2 * j + 1, 2 * k + 1));
          std::array<std::int32_t, 4> const ring{
              vertex(at(2 * i, 2 * j, 2 * k)), vertex(at(2 * i, 2 * j + 2, 2 * k)),
              vertex(at(2 * i, 2 * j + 2, 2 * k + 2)), vertex(at(2 * i, 2 * j, 2 * k + 2))};
          for (std::size_t m = 0; m < 4; ++m)
            mesh.tets.push_back({low, ring[m], ring[(m + 1) % 4], high});
        }
  }

  std::vector<std::int32_t> number(static_cast<std::size_t>(doubled[0]) *
                                       static_cast<std::size_t>(doubled[1]) *
                                       static_cast<std::size_t>(doubled[2]),
                                   -1);
  for (Tet const& tet : mesh.tets)
    for (std::int32_t const v : tet) number[static_cast<std::size_t>(v)] = 0;
  auto const coordinate = [](int i, int cells) { return static_cast<double>(i - cells) / cells; };
  std::size_t next = 0;
  for (int i = 0; i < doubled[0]; ++i)
    for (int j = 0; j < doubled[1]; ++j)
      for (int k = 0; k < doubled[2]; ++k, ++next) {
        if (number[next] < 0) continue;
        number[next] = static_cast<std::int32_t>(mesh.points.size());
        mesh.points.push_back(
            map(Point{coordinate(i, n[0]), coordinate(j, n[1]), coordinate(k, n[2])}));
      }
  for (Tet& tet : mesh.tets)
    for (std::int32_t& v : tet) v = number[static_cast<std::size_t>(v)];
  return mesh;
}

}  // namespace taut
