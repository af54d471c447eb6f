// The local terms: inertia and forces on single unknowns. Kernels are in fp64 throughout; their
// cost is one pass over the unknowns.
#pragma once

#include <taut/core/exec/growing.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/potential/unknowns.hpp>

namespace taut {

/// Inertia 1/2 m |x - x~|^2. The time integrator sets x~ and may switch it off (quasi-static).
template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class Inertia {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Positions = VectorField<typename Precision::position, Space>;

  struct Kernel {
    Array<typename Precision::real, Space> mass;
    Positions target;
    double on;

    KOKKOS_FUNCTION Vec3<double> offset(int i, Vec3<double> const& x) const {
      return {x[0] - double(target(i, 0)), x[1] - double(target(i, 1)),
              x[2] - double(target(i, 2))};
    }
    KOKKOS_FUNCTION double value(int i, Vec3<double> const& x) const {
      Vec3<double> const d = offset(i, x);
      return 0.5 * on * double(mass(i)) * dot(d, d);
    }
    KOKKOS_FUNCTION double change(int i, Vec3<double> const& x, Vec3<double> const& s) const {
      return on * double(mass(i)) * dot(s, offset(i, x) + 0.5 * s);
    }
    KOKKOS_FUNCTION Vec3<double> gradient(int i, Vec3<double> const& x) const {
      return (on * double(mass(i))) * offset(i, x);
    }
    KOKKOS_FUNCTION Sym3<double> curvature(int i, Vec3<double> const&) const {
      double const m = on * double(mass(i));
      return {{m, m, m, 0, 0, 0}};
    }
  };

  explicit Inertia(Unknowns<Precision, Space> const& unknowns) { resize(unknowns); }

  /// The unknowns have become others, perhaps more or fewer; so have their targets.
  void resize(Unknowns<Precision, Space> const& unknowns) {
    mass_ = unknowns.mass;
    target_ = memory_.resize("inertia_target", unknowns.size());
  }
  Kernel kernel(double) const { return {mass_, target_, on_ ? 1.0 : 0.0}; }

  /// x~, filled by the time integrator; inertia is off in a quasi-static solve.
  Positions const& target() const { return target_; }
  void switch_on(bool on) { on_ = on; }

private:
  Array<typename Precision::real, Space> mass_;
  Positions target_;
  Resizable<Positions> memory_;
  bool on_ = true;
};

/// Potential of forces that do not depend on position: -(m a + f) . x, with an acceleration a
/// common to all unknowns (gravity) and a force f per unknown (absent if empty).
template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class BodyForce {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Forces = VectorField<typename Precision::real, Space>;

  struct Kernel {
    Array<typename Precision::real, Space> mass;
    Forces force;
    Vec3<double> acceleration;
    double scale;

    KOKKOS_FUNCTION Vec3<double> total(int i) const {
      Vec3<double> f = double(mass(i)) * acceleration;
      if (force.extent(0) > 0) {
        for (int c = 0; c < 3; ++c) f[c] += double(force(i, c));
      }
      return scale * f;
    }
    KOKKOS_FUNCTION double value(int i, Vec3<double> const& x) const { return -dot(total(i), x); }
    KOKKOS_FUNCTION double change(int i, Vec3<double> const&, Vec3<double> const& s) const {
      return -dot(total(i), s);
    }
    KOKKOS_FUNCTION Vec3<double> gradient(int i, Vec3<double> const&) const { return -total(i); }
    KOKKOS_FUNCTION Sym3<double> curvature(int, Vec3<double> const&) const { return {}; }
  };

  /// acceleration in m/s^2
  explicit BodyForce(Unknowns<Precision, Space> const& unknowns,
                     Vec3<double> const& acceleration = {0, 0, 0})
      : mass_(unknowns.mass), acceleration_(acceleration) {}

  /// The unknowns have become others: forces on single ones are gone.
  void resize(Unknowns<Precision, Space> const& unknowns) {
    mass_ = unknowns.mass;
    force_ = Forces();
  }
  Kernel kernel(double scale) const { return {mass_, force_, acceleration_, scale}; }

  void set_acceleration(Vec3<double> const& acceleration) { acceleration_ = acceleration; }
  Vec3<double> const& acceleration() const { return acceleration_; }
  /// One force per unknown, N; an empty field removes them.
  void set_forces(Forces const& force) { force_ = force; }
  Forces const& forces() const { return force_; }

private:
  Array<typename Precision::real, Space> mass_;
  Forces force_;
  Vec3<double> acceleration_;
};

}  // namespace taut
