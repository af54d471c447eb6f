// Small bodies of particles for the tests, and the grid under them.
#pragma once

#include <taut/mpm/particle_blocks.hpp>
#include <taut/mpm/particles.hpp>
#include <taut/mpm/sparse_grid.hpp>

#include <array>
#include <random>
#include <vector>

namespace taut::test {

template <class Space>
using RightOf = taut::Space<typename Space::execution, Kokkos::LayoutRight>;
template <class Space>
using LeftOf = taut::Space<typename Space::execution, Kokkos::LayoutLeft>;

/// `per_axis`^3 particles in each of the cells [0, cells)^3 around `origin` cells of `dx`, at
/// jittered places, strained and moving. Objects and materials alternate along x.
inline std::vector<Particle> jittered_block(int cells, int per_axis, double dx,
                                            Vec3<double> const& origin, int materials = 1,
                                            double strain = 0.1, unsigned seed = 7) {
  std::mt19937 random(seed);
  auto const jitter = [&] { return double(random()) / 4294967296.0 - 0.5; };
  std::vector<Particle> list;
  int const n = cells * per_axis;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        Particle p;
        int const at[3] = {i, j, k};
        for (int c = 0; c < 3; ++c) {
          p.x[c] = dx * (origin[c] + (at[c] + 0.5 + 0.4 * jitter()) / per_axis);
          p.v[c] = jitter();
        }
        for (int c = 0; c < 9; ++c) {
          p.F.a[c] += strain * jitter();
          p.C.a[c] = 2 * jitter();
        }
        p.volume = dx * dx * dx / (per_axis * per_axis * per_axis) * (1 + 0.1 * jitter());
        p.mass = 1000 * p.volume;
        p.stiffness = 1 + 0.2 * jitter();
        p.material = i * materials / n;
        p.object = p.material;
        p.plastic = 0.01 * ((i + j + k) % 3);
        list.push_back(p);
      }
  return list;
}

/// Particles on their grid.
template <Spline K, class Precision, class Space>
struct OnGrid {
  using Positions = VectorField<typename Precision::position, Space>;
  Particles<Precision, Space> particles;
  ParticleBlocks<K, Space> blocks;
  SparseGrid<Space> grid;
  Positions rest;

  OnGrid(std::vector<Particle> const& list, double dx, int materials = 1) : particles(list) {
    blocks.sort(particles.x, particles.material, particles.count, materials, dx);
    grid.rebuild(blocks.cells(), blocks.cell_count(), K::width, dx);
    blocks.bind(grid.nodes());
    rest = Positions("rest", nodes());
    auto const host = Kokkos::create_mirror_view(rest);
    auto const at = places();
    for (int n = 0; n < nodes(); ++n)
      for (int c = 0; c < 3; ++c) {
        host(n, c) = static_cast<typename Precision::position>(dx * at[n][c]);
      }
    assign(rest, host);
  }
  int nodes() const { return grid.nodes().count; }
  /// The nodes in units of dx.
  std::vector<std::array<int, 3>> places() const {
    auto const ijk = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid.nodes().ijk);
    std::vector<std::array<int, 3>> list(nodes());
    for (int n = 0; n < nodes(); ++n)
      for (int c = 0; c < 3; ++c) list[n][c] = ijk(n, c);
    return list;
  }
};

}  // namespace taut::test
