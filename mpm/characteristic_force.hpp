// The force that a deformation of the size of a cell meets at a node (Zhu et al. 2018; Wang et al.
// 2020, section 6), by which residuals are measured:
//
//   F_i = 24 dx^2 xi_i,      xi_i = Sum_p w_ip m_p |d2Psi/dF2 (I)|_p / Sum_p w_ip m_p
//
// with the Frobenius norm of the 9x9 derivative, times what hardens the particle. Terms add their
// parts of both sums.
#pragma once

#include <taut/mpm/particle_matrix_kernels.hpp>
#include <taut/mpm/particles.hpp>

namespace taut {

/// |d2Psi/dF2| of a material at F = I, Pa.
template <class Material, class Parameters>
double norm_at_rest(Parameters const& parameters) {
  auto const frame = Material::frame(Material::evaluate(parameters, identity3<double>()));
  double sum = 0;
  for (int k = 0; k < 9; ++k) {
    Mat3<double> unit{};
    unit.a[k] = 1;
    Mat3<double> const column = frame.apply(unit);
    sum += contract(column, column);
  }
  return Kokkos::sqrt(sum);
}

namespace kernels {

/// Sum w m |.| and Sum w m of what the particles of a patch give to its nodes.
template <class S, class Precision, Spline K>
struct CharacteristicSums {
  using Real = typename Precision::real;
  PointReader<S, Real, K> reader;
  Particles<Precision, S> particles;
  Kokkos::View<double const*, typename S::memory> norm;  ///< per material
  Kokkos::View<double*, typename S::memory> partial;

  KOKKOS_FUNCTION void operator()(int patch) const {
    auto const& blocks = reader.blocks;
    constexpr int nodes = BlockViews<K, S>::nodes;
    double* const rows = partial.data() + std::size_t(2 * nodes) * patch;
    for (int k = 0; k < 2 * nodes; ++k) rows[k] = 0;
    double const of_material = norm(blocks.material(patch));
    int const first = blocks.slot_begin(patch);
    for (int slot = first; slot < first + blocks.count(patch); ++slot) {
      int const p = blocks.particle(slot);
      double const mass = double(particles.mass(p));
      double const stiff = mass * of_material * double(particles.stiffness(p));
      Weights<K, double> const at = reader.weights(slot);
      int const corner = blocks.corner(slot) / 4;
      for (int a = 0; a < K::width; ++a)
        for (int b = 0; b < K::width; ++b)
          for (int c = 0; c < K::width; ++c) {
            double const w = at.weight(a, b, c);
            double* const row = rows + 2 * (corner + BlockViews<K, S>::local(a, b, c));
            row[0] += w * stiff;
            row[1] += w * mass;
          }
    }
  }
};

template <class S>
struct AddCharacteristicForce {
  Array<double, S> force, mass;
  double factor;
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, double const (&sum)[numbers]) const {
    force(node) += factor * sum[0];
    mass(node) += sum[1];
  }
};

}  // namespace kernels
}  // namespace taut
