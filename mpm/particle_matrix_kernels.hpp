// What particles do one at a time, in fp64: the Hessian's blocks, and how far a step may go before
// one of them inverts.
#pragma once

#include <taut/core/math/cubic.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/mpm/particle_kernels.hpp>

namespace taut::kernels {

/// A particle as sweeps store it (BlockSweep::Points), one number at a time.
template <class S, class Real, Spline K>
struct PointReader {
  BlockViews<K, S> blocks;
  Kokkos::View<Real const*, typename S::memory> data;

  KOKKOS_FORCEINLINE_FUNCTION double number(int slot, int k) const {
    return double(data(SlotLayout<S, Real, point_numbers>::place(slot, k)));
  }
  KOKKOS_FORCEINLINE_FUNCTION Weights<K, double> weights(int slot) const {
    return Weights<K, double>({number(slot, 0), number(slot, 1), number(slot, 2)});
  }
  KOKKOS_FORCEINLINE_FUNCTION Mat3<double> deformation(int slot) const {
    Mat3<double> F;
    for (int k = 0; k < 9; ++k) F.a[k] = number(slot, 3 + k);
    return F;
  }
  /// Sum_i g_i (grad w_i)^T per cell, of a field on the nodes less that of the first.
  template <class Field>
  KOKKOS_FUNCTION Mat3<double> gradient(int slot, int const* node, Field const& field) const {
    int const corner = blocks.corner(slot) / 4;
    Weights<K, double> const at = weights(slot);
    Mat3<double> sum = 0.0 * identity3<double>();
    int const first = node[corner];
    for (int a = 0; a < K::width; ++a)
      for (int b = 0; b < K::width; ++b)
        for (int c = 0; c < K::width; ++c) {
          int const n = node[corner + BlockViews<K, S>::local(a, b, c)];
          Vec3<double> g;
          for (int k = 0; k < 3; ++k) g[k] = double(field(n, k) - field(first, k));
          sum = sum + outer(g, at.gradient(a, b, c));
        }
    return sum;
  }
};

/// The largest step along p up to `at_most` that inverts no particle of the patch; see
/// InversionSweep.
template <class S, class Precision, class Material, Spline K, bool packed>
struct ParticleInversion : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  VectorField<Real, S> p;
  double at_most;
  bool strict;
  Kokkos::View<double*, typename S::memory> bound;  ///< per patch

  std::size_t scratch_bytes() const { return 2 * Base::row_bytes(3); }

  /// What is beyond `shortest` may be answered by infinity.
  KOKKOS_FUNCTION double step_to_flat(int slot, int const* node, double shortest) const {
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    PointReader<S, Real, K> const reader{this->blocks, this->data};
    double const per_dx = 1 / double(this->dx);
    Mat3<double> const before = reader.deformation(slot);
    Mat3<double> const F =
        before + (per_dx * reader.gradient(slot, node, this->displacement)) * before;
    Mat3<double> const dF = (per_dx * reader.gradient(slot, node, p)) * before;
    if (contract(dF, dF) == 0) return infinity;
    Mat3<double> const C = cofactor(F), c = cofactor(dF);
    double const det = dot(F.column(0), C.column(0));
    if (!(det > 0)) return strict ? 0 : infinity;
    return smallest_positive_root(det, contract(C, dF), contract(F, c), determinant(dF), shortest);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    Local const local_p(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    InversionCertificate<T> const certificate =
        this->certificate(this->largest(team, local_x), this->largest(team, local_p));
    auto const points = this->points(patch, this->data.data());
    T square_length(Kokkos::Experimental::finite_max_v<Real>);
    auto const certify = [&](int g, bool) __attribute__((always_inline)) {
      std::uint16_t const* const corner = points.corners(g);
      Weights<K, T> const at = points.weights(g);
      Mat3<T> const before = points.deformation(g);
      Mat3<T> const F = before + this->change_of_F(at, corner, local_x.data(), before);
      Mat3<T> const dF = this->change_of_F(at, corner, local_p.data(), before);
      square_length = min(square_length, certificate.square_length(this->noise(before), F, dF));
    };
    this->in_rounds(team, patch, certify);
    double length = this->smallest(team, square_length);
    if (length < at_most) {
      int const* const node = this->blocks.nodes_of(patch);
      int const slots = this->blocks.slot_begin(patch);
      length = at_most;
      auto const solve = [&](int k) {
        length = Kokkos::min(length, step_to_flat(slots + k, node, length));
      };
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->blocks.count(patch)), solve);
      if (team.team_size() > 1) team.team_reduce(Kokkos::Min<double>(length));
    }
    Kokkos::single(Kokkos::PerTeam(team), [&]() { bound(patch) = Kokkos::min(length, at_most); });
  }
};

/// Adds the projected Hessian of the particles of one colour of blocks: blocks of a colour, two
/// blocks apart, share no node.
template <class S, class Precision, class Material, Spline K, class Matrix>
struct AssembleBlocks {
  using Real = typename Precision::real;
  static_assert(BlockViews<K, S>::side <= 8);
  PointReader<S, Real, K> reader;
  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  Kokkos::View<int const*, typename S::memory> order;  ///< blocks, colour after colour
  int first;                                           ///< of the colour
  Displacement<S, typename Precision::position> displacement;
  FixedMask<S> fixed;
  Matrix matrix;
  double dx, scale;
  PointMemory<S, Real> memory;

  KOKKOS_FUNCTION void operator()(int k) const {
    int const block = order(first + k);
    auto const& blocks = reader.blocks;
    for (int patch = blocks.patch_begin(block); patch < blocks.patch_begin(block + 1); ++patch) {
      int const slots = blocks.slot_begin(patch);
      for (int p = 0; p < blocks.count(patch); ++p) add(patch, slots + p);
    }
  }
  KOKKOS_FUNCTION void add(int patch, int slot) const {
    constexpr int width = K::width, stencil = width * width * width;
    auto const& blocks = reader.blocks;
    int const* const at_node = blocks.nodes_of(patch) + blocks.corner(slot) / 4;
    Mat3<double> const before = reader.deformation(slot);
    Mat3<double> const F =
        before + ((1 / dx) * reader.gradient(slot, blocks.nodes_of(patch), displacement)) * before;
    auto own = materials(blocks.material(patch));
    if constexpr (RememberingMaterial<Material>) {
      auto const [limit, gained] = memory.template at<Real>(slot);
      own = Material::with(own, YieldMemory<double>{double(limit), double(gained)});
    }
    auto const frame = Material::frame(Material::evaluate(own, F));
    double const weight = scale * reader.number(slot, 12);
    Weights<K, double> const at = reader.weights(slot);
    Mat3<double> const to_beta = (1 / dx) * (transpose(frame.V) * transpose(before));
    int node[stencil];
    Vec3<double> beta[stencil];
    for (int n = 0; n < stencil; ++n) {
      int const a = n / (width * width), b = n / width % width, c = n % width;
      node[n] = at_node[BlockViews<K, S>::local(a, b, c)];
      beta[n] = to_beta * at.gradient(a, b, c);
    }
    for (int i = 0; i < stencil; ++i) {
      if (fixed(node[i])) continue;
      for (int j = i; j < stencil; ++j) {
        if (fixed(node[j])) continue;
        Mat3<double> const h = weight * frame.vertex_pair(beta[i], beta[j]);
        matrix.add(node[i], node[j], h);
        if (i != j) matrix.add(node[j], node[i], transpose(h));
      }
    }
  }
};

}  // namespace taut::kernels
