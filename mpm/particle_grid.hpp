// The grid of a step: made around the particles, with their mass and velocity on its nodes, which
// are the unknowns of the step. Made anew each step; memory is kept.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/unknowns.hpp>
#include <taut/mpm/boundary.hpp>
#include <taut/mpm/sparse_grid.hpp>
#include <taut/mpm/transfer.hpp>

#include <span>

namespace taut {

namespace kernels {

template <class S, class Precision>
struct PlaceOfNode {
  using Scalar = typename Precision::position;
  GridNodes<S> grid;
  Array<Scalar, S> transferred;
  VectorField<Scalar, S> rest;
  Array<typename Precision::real, S> mass;
  KOKKOS_FUNCTION void operator()(int n) const {
    for (int c = 0; c < 3; ++c) rest(n, c) = static_cast<Scalar>(grid.dx * grid.ijk(n, c));
    mass(n) = static_cast<typename Precision::real>(transferred(n));
  }
};

/// Nodes in a sticky boundary go where it goes.
template <class S, class Precision>
struct Stick {
  using Scalar = typename Precision::position;
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  int count;
  double h;
  VectorField<Scalar, S> rest, prescribed;
  FixedMask<S> fixed;
  KOKKOS_FUNCTION void operator()(int n) const {
    Vec3<double> const x{double(rest(n, 0)), double(rest(n, 1)), double(rest(n, 2))};
    fixed(n) = 0;
    for (int k = 0; k < count && !fixed(n); ++k) {
      if (boundaries(k).contact != BoundaryContact::sticky || !boundaries(k).holds(x)) continue;
      fixed(n) = 1;
      Vec3<double> const v = boundaries(k).velocity_at(x);
      for (int c = 0; c < 3; ++c) prescribed(n, c) = static_cast<Scalar>(x[c] + h * v[c]);
    }
  }
};

/// The first particle of which something is not a number.
template <class S, class Precision>
struct FindNotFinite {
  Particles<Precision, S> particles;
  KOKKOS_FUNCTION void operator()(int p, int& first) const {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += double(particles.v(p, c));
    for (int c = 0; c < 9; ++c) sum += double(particles.C(p, c)) + double(particles.F(p, c));
    sum += double(particles.mass(p)) + double(particles.volume(p)) + double(particles.stiffness(p));
    if (!Kokkos::isfinite(sum)) first = Kokkos::min(first, p);
  }
};

template <class S, class Scalar>
struct Fastest {
  VectorField<Scalar, S> v;
  KOKKOS_FUNCTION void operator()(int p, double& fastest) const {
    Vec3<double> const w{double(v(p, 0)), double(v(p, 1)), double(v(p, 2))};
    // A maximum passes over what is not a number; infinity does not.
    double const speed = norm(w);
    fastest = Kokkos::max(
        fastest, Kokkos::isfinite(speed) ? speed : Kokkos::Experimental::infinity_v<double>);
  }
};

}  // namespace kernels

/// The largest speed of any particle, m/s; infinite where one is not a number.
template <class Precision, class Space>
double fastest(Particles<Precision, Space> const& particles) {
  return maximum<Space>("fastest", particles.count, 0.0,
                        kernels::Fastest<Space, typename Precision::position>{particles.v});
}

template <Spline K = QuadraticSpline, class Precision_ = Mixed, class Space_ = DefaultSpace>
class ParticleGrid {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Kernel = K;
  using Positions = VectorField<typename Precision::position, Space>;
  using Blocks = ParticleBlocks<K, Space>;

  /// `dx`: spacing, m. Throws Error unless dx > 0.
  explicit ParticleGrid(double dx) : dx_(dx) {
    if (!(dx > 0) || !std::isfinite(dx)) {
      throw Error("a grid of spacing {} m; give one above 0", dx);
    }
    unknowns_.length = dx;
  }

  double dx() const { return dx_; }
  Unknowns<Precision, Space> const& unknowns() const { return unknowns_; }
  Blocks const& blocks() const { return blocks_; }
  SparseGrid<Space> const& sparse() const { return grid_; }
  GridNodes<Space> const& nodes() const { return grid_.nodes(); }
  int size() const { return unknowns_.size(); }
  Positions const& rest() const { return rest_; }  ///< places of the nodes, m
  /// Where the step begins, m/s.
  Positions const& velocity() const { return transfer_.velocity(); }

  /// Makes the grid around particles of `materials` materials, and brings their mass and momentum
  /// to it. Throws Error for a particle of which something is not a number, or that is out of
  /// reach.
  void rebuild(Particles<Precision, Space> const& particles, int materials) {
    int const bad = minimum<Space>("check_particles", particles.count, particles.count,
                                   kernels::FindNotFinite<Space, Precision>{particles});
    if (bad < particles.count) {
      throw Error("particle {}: its velocity or deformation is not finite; take smaller steps",
                  bad);
    }
    blocks_.sort(particles.x, particles.material, particles.count, materials, dx_);
    grid_.rebuild(blocks_.cells(), blocks_.cell_count(), K::width, dx_);
    int const n = grid_.nodes().count;
    blocks_.bind(grid_.nodes());
    transfer_.to_grid(particles, blocks_, n, dx_);
    rest_ = memory_[0].resize("node_rest", n);
    unknowns_.prescribed = memory_[1].resize("node_prescribed", n);
    unknowns_.mass = mass_memory_.resize("node_mass", n);
    unknowns_.fixed = fixed_memory_.resize("node_fixed", n);
    for_each<Space>("node_places", n,
                    kernels::PlaceOfNode<Space, Precision>{grid_.nodes(), transfer_.mass(), rest_,
                                                           unknowns_.mass});
    assign_on<Space>(unknowns_.fixed, std::uint8_t(0));
  }

  /// Fixes nodes in sticky boundaries, which are where they will be in h seconds.
  void fix(BoundaryList<Space> const& boundaries, double h) {
    for_each<Space>("stick", size(),
                    kernels::Stick<Space, Precision>{boundaries.list(), boundaries.count(), h,
                                                     rest_, unknowns_.prescribed, unknowns_.fixed});
  }

  /// Moves particles by a step of h seconds in which the nodes went to x, with the velocities v at
  /// its end.
  template <Transfer T, Flow F>
  void to_particles(Particles<Precision, Space> const& particles, Positions const& x,
                    Positions const& v, double h, T const& transfer, F const& flow) const {
    transfer_.to_particles(particles, blocks_, x, rest_, v, h, dx_, transfer, flow);
  }

private:
  double dx_;
  Blocks blocks_;
  SparseGrid<Space> grid_;
  GridTransfer<K, Precision, Space> transfer_;
  Unknowns<Precision, Space> unknowns_;
  Positions rest_;
  Resizable<Positions> memory_[2];
  Resizable<Array<typename Precision::real, Space>> mass_memory_;
  Resizable<FixedMask<Space>> fixed_memory_;
};

}  // namespace taut
