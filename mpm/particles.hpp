// Material points: what a body is made of between the steps of a grid.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/space.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/report/error.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace taut {

/// A particle on the host, where scenes are made and results written.
struct Particle {
  Vec3<double> x{};                            ///< m
  Vec3<double> v{};                            ///< m/s
  Mat3<double> C = 0.0 * identity3<double>();  ///< affine velocity field around it, 1/s
  Mat3<double> F = identity3<double>();        ///< elastic deformation gradient
  double mass = 0;                             ///< kg
  double volume = 0;                           ///< at rest, m^3
  double stiffness = 1;                        ///< factor of both Lame parameters (hardening)
  double plastic = 1;  ///< what a return map remembers (volume ratio, strain)
  int material = 0, object = 0;
};

template <class T, class S>
using MatrixField = Kokkos::View<T* [9], typename S::layout, typename S::memory>;

template <class Field>
KOKKOS_FORCEINLINE_FUNCTION Mat3<double> matrix_at(Field const& field, int i) {
  Mat3<double> m;
  for (int k = 0; k < 9; ++k) m.a[k] = double(field(i, k));
  return m;
}
template <class Field>
KOKKOS_FORCEINLINE_FUNCTION void set_matrix(Field const& field, int i, Mat3<double> const& m) {
  using Stored = typename Field::non_const_value_type;
  for (int k = 0; k < 9; ++k) field(i, k) = static_cast<Stored>(m.a[k]);
}

/// All particles of a scene, one array per quantity, in Precision::position: what steps add up.
template <class Precision = Mixed, class Space = DefaultSpace>
struct Particles {
  using Scalar = typename Precision::position;

  VectorField<Scalar, Space> x, v;
  MatrixField<Scalar, Space> C, F;
  Array<Scalar, Space> mass, volume, stiffness, plastic;
  Kokkos::View<int*, typename Space::memory> material, object;
  int count = 0;

  Particles() = default;
  /// Throws Error for a particle with a mass or volume that is not above zero, or that has a place
  /// or velocity that is not finite.
  explicit Particles(std::vector<Particle> const& list)
      : x("particle_x", list.size()),
        v("particle_v", list.size()),
        C("particle_C", list.size()),
        F("particle_F", list.size()),
        mass("particle_mass", list.size()),
        volume("particle_volume", list.size()),
        stiffness("particle_stiffness", list.size()),
        plastic("particle_plastic", list.size()),
        material("particle_material", list.size()),
        object("particle_object", list.size()),
        count(static_cast<int>(list.size())) {
    for (std::size_t p = 0; p < list.size(); ++p) {
      Particle const& from = list[p];
      if (!(from.mass > 0 && from.volume > 0 && std::isfinite(from.mass + from.volume))) {
        throw Error("particle {}: mass {} kg, volume {} m^3; both must be above zero", p, from.mass,
                    from.volume);
      }
      if (!std::isfinite(norm(from.x) + norm(from.v))) {
        throw Error("particle {}: its place or velocity is not finite", p);
      }
    }
    write(list);
  }

  /// The same particles as they are now.
  std::vector<Particle> read() const {
    std::vector<Particle> list(count);
    auto const x_ = mirror(x), v_ = mirror(v);
    auto const C_ = mirror(C), F_ = mirror(F);
    auto const mass_ = mirror(mass), volume_ = mirror(volume), stiffness_ = mirror(stiffness),
               plastic_ = mirror(plastic);
    auto const material_ = mirror(material), object_ = mirror(object);
    for (int p = 0; p < count; ++p) {
      for (int c = 0; c < 3; ++c) {
        list[p].x[c] = double(x_(p, c));
        list[p].v[c] = double(v_(p, c));
      }
      list[p].C = matrix_at(C_, p);
      list[p].F = matrix_at(F_, p);
      list[p].mass = double(mass_(p));
      list[p].volume = double(volume_(p));
      list[p].stiffness = double(stiffness_(p));
      list[p].plastic = double(plastic_(p));
      list[p].material = material_(p);
      list[p].object = object_(p);
    }
    return list;
  }

private:
  template <class View>
  static auto mirror(View const& view) {
    return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  }
  void write(std::vector<Particle> const& list) {
    auto const x_ = Kokkos::create_mirror_view(x), v_ = Kokkos::create_mirror_view(v);
    auto const C_ = Kokkos::create_mirror_view(C), F_ = Kokkos::create_mirror_view(F);
    auto const mass_ = Kokkos::create_mirror_view(mass),
               volume_ = Kokkos::create_mirror_view(volume),
               stiffness_ = Kokkos::create_mirror_view(stiffness),
               plastic_ = Kokkos::create_mirror_view(plastic);
    auto const material_ = Kokkos::create_mirror_view(material),
               object_ = Kokkos::create_mirror_view(object);
    for (int p = 0; p < count; ++p) {
      Particle const& from = list[p];
      for (int c = 0; c < 3; ++c) {
        x_(p, c) = static_cast<Scalar>(from.x[c]);
        v_(p, c) = static_cast<Scalar>(from.v[c]);
      }
      set_matrix(C_, p, from.C);
      set_matrix(F_, p, from.F);
      mass_(p) = static_cast<Scalar>(from.mass);
      volume_(p) = static_cast<Scalar>(from.volume);
      stiffness_(p) = static_cast<Scalar>(from.stiffness);
      plastic_(p) = static_cast<Scalar>(from.plastic);
      material_(p) = from.material;
      object_(p) = from.object;
    }
    assign(x, x_);
    assign(v, v_);
    assign(C, C_);
    assign(F, F_);
    assign(mass, mass_);
    assign(volume, volume_);
    assign(stiffness, stiffness_);
    assign(plastic, plastic_);
    assign(material, material_);
    assign(object, object_);
  }
};

}  // namespace taut
