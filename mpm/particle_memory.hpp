// What points remember from step to step, for materials that look at it within one
// (materials/hencky.hpp): two numbers each, beside what all sweeps read.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/fem/element_material.hpp>
#include <taut/materials/yield_memory.hpp>
#include <taut/mpm/particle_blocks.hpp>
#include <taut/mpm/particles.hpp>

namespace taut {

/// `remember`: what a point brings into a step; `with`: the material of such a point; `lags`:
/// whether it is taken anew after a minimisation (LaggedTerm).
template <class M>
concept RememberingMaterial = ElementMaterial<M> &&
    requires(typename M::template Parameters<double> const& parameters, Mat3<double> const& F,
             YieldMemory<double> const& memory) {
  { M::remember(parameters, F, 1.0) } -> std::same_as<YieldMemory<double>>;
  { M::with(parameters, memory) } -> std::same_as<typename M::template Parameters<double>>;
  { M::lags(parameters) } -> std::same_as<bool>;
};

namespace kernels {

/// Per slot (particle_blocks.hpp).
template <class S, class Real>
struct PointMemory {
  static constexpr int numbers = 2;
  using Layout = SlotLayout<S, Real, numbers>;
  Kokkos::View<Real*, typename S::memory> data;

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION YieldMemory<T> at(int slot) const {
    Real const* const from = data.data();
    return {load<T>(from + Layout::place(slot, 0)), load<T>(from + Layout::place(slot, 1))};
  }
  KOKKOS_FORCEINLINE_FUNCTION void write(int slot, YieldMemory<double> const& memory) const {
    data(Layout::place(slot, 0)) = static_cast<Real>(memory.limit);
    data(Layout::place(slot, 1)) = static_cast<Real>(memory.gained);
  }
};

/// Where a step begins, from the particles as they are.
template <class S, class Precision, class Material, Spline K>
struct Remember {
  using Real = typename Precision::real;
  BlockViews<K, S> blocks;
  Particles<Precision, S> particles;
  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  PointMemory<S, Real> memory;

  KOKKOS_FUNCTION void operator()(int patch) const {
    auto const material = materials(blocks.material(patch));
    for (int slot = blocks.slot_begin(patch); slot < blocks.slot_end(patch); ++slot) {
      int const p = blocks.like(slot);
      memory.write(slot, Material::remember(material, matrix_at(particles.F, p),
                                            double(particles.plastic(p))));
    }
  }
};

/// Takes what lags as it is for the F of the nodes at x, and sums, weighed by volumes, the squares
/// of what that changes and of what there is.
template <class Reader, class S, class Precision, class Material, class Displacement>
struct RememberAnew {
  using Real = typename Precision::real;
  using Sum = typename Precision::sum;
  Reader reader;
  Particles<Precision, S> particles;
  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  Displacement displacement;
  double dx;
  PointMemory<S, Real> memory;

  KOKKOS_FUNCTION void operator()(int patch, Sums<Sum, 2>& sums) const {
    auto const& blocks = reader.blocks;
    auto const material = materials(blocks.material(patch));
    if (!Material::lags(material)) return;
    int const first = blocks.slot_begin(patch);
    for (int slot = first; slot < first + blocks.count(patch); ++slot) {
      Mat3<double> const before = reader.deformation(slot);
      Mat3<double> const G = reader.gradient(slot, blocks.nodes_of(patch), displacement);
      YieldMemory<double> const now =
          Material::remember(material, before + (1 / dx) * (G * before),
                             double(particles.plastic(blocks.particle(slot))));
      double const change = now.limit - double(memory.template at<Real>(slot).limit);
      double const weight = reader.number(slot, 12);
      sums[0] += static_cast<Sum>(weight * change * change);
      sums[1] += static_cast<Sum>(weight * now.limit * now.limit);
      memory.write(slot, now);
    }
  }
};

}  // namespace kernels
}  // namespace taut
