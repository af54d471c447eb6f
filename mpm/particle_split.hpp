// A particle's share of the alternating direction method of multipliers: its own copy Z of the
// deformation gradient, and what is left between the two, U (scaled dual, Boyd et al. 2011, section
// 3.1.1; for material points Fang et al. 2019),
//
//   Z <- argmin Psi(Z) + k/2 |Z - T|^2,   U <- T - Z,   T = r F(x) + (1 - r) Z_before + U,
//
// with k a stiffness of the material (Pa) and r a relaxation. The volume drops out. The minimum is
// found by Newton's method on the singular values, with the exactly projected second derivative.
//
// In x what the particle stands for is then quadratic, V k/2 |F(x) - Z + U|^2, and its Hessian the
// same in all iterations: a weighted Laplacian in each coordinate.
#pragma once

#include <taut/core/math/svd.hpp>
#include <taut/mpm/particle_operator_kernels.hpp>

namespace taut {
namespace kernels {

/// Z and U of a particle, by columns.
inline constexpr int split_numbers = 18;

/// A^-1 of what is positive definite, by k at least.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Sym3<T> inverse_of_positive(Sym3<T> const& A) {
  T const a = A.s[0], b = A.s[1], c = A.s[2], d = A.s[3], e = A.s[4], f = A.s[5];
  T const xx = b * c - e * e, yy = a * c - f * f, zz = a * b - d * d;
  T const xy = e * f - d * c, yz = d * f - a * e, zx = d * e - b * f;
  T const scale = T(1) / (a * xx + d * xy + f * zx);
  return {{scale * xx, scale * yy, scale * zz, scale * xy, scale * yz, scale * zx}};
}

/// argmin Psi(Z) + k/2 |Z - target|^2. Psi is isotropic, so Z has the singular vectors of the
/// target, and its singular values are sought: from those of the target, but from where nothing is
/// flat or inside out.
template <class Material, class Parameters, class T>
KOKKOS_FUNCTION Mat3<T> proximal(Parameters const& material, T const& k, Mat3<T> const& target) {
  using Real = ValueType<T>;
  constexpr int most_steps = 60, most_halvings = 25;
  // Of a squared step: what is left after it is of the order of its square.
  constexpr Real enough = std::is_same_v<Real, float> ? Real(1e-12) : Real(1e-22);
  constexpr Real flat = Real(0.1);
  Svd<T> const frame = svd(target);
  Mat3<T> goal, Z;
  for (int c = 0; c < 9; ++c) goal.a[c] = Z.a[c] = T(0);
  for (int c = 0; c < 3; ++c) {
    goal(c, c) = frame.s[c];
    Z(c, c) = max(frame.s[c], T(flat));
  }
  T const little = T(enough) * (T(1) + contract(goal, goal));
  for (int n = 0; n < most_steps; ++n) {
    auto const state = Material::evaluate(material, Z);
    auto inverse = Material::frame(state);
    for (int c = 0; c < 3; ++c) {
      inverse.scaling.s[c] = inverse.scaling.s[c] + k;
      inverse.twist[c] = T(1) / (inverse.twist[c] + k);
      inverse.flip[c] = T(1) / (inverse.flip[c] + k);
    }
    inverse.scaling = inverse_of_positive(inverse.scaling);
    Mat3<T> const away = Z - goal, slope = Material::stress(state) + k * away;
    Mat3<T> const step = T(-1) * inverse.apply(slope);
    T const descent = contract(slope, step), size = contract(step, step);
    T length(1);
    for (int h = 0; h < most_halvings; ++h) {
      Mat3<T> const taken = length * step, next = Z + taken;
      T const change = Material::change(material, Material::evaluate(material, next), taken) +
                       k * (contract(away, taken) + T(0.5) * contract(taken, taken));
      T shorter = select(change <= T(1e-4) * length * descent, T(0), T(1));
      shorter = select(size < little, T(0), shorter);  // round-off
      if constexpr (!Material::allows_inversion) {
        shorter = select(determinant(next) > T(0), shorter, T(1));
      }
      if (max_lanes(shorter) == 0) break;
      length = select(shorter > T(0), T(0.5) * length, length);
    }
    Z = Z + length * step;
    if (min_lanes(T(little - size)) >= 0) break;
  }
  return frame.U * Z * transpose(frame.V);
}

/// Updates Z and U at x, and turns the gradient of the energy there into that of what stands for it
/// in x: V (k (F - Z + U) - P(F)) b_i. `first`: Z = F, and U balances its stress.
template <class S, class Precision, class Material, Spline K, bool packed>
struct SplitParticles : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  Kokkos::View<double const*, typename S::memory> stiffness;  ///< k per material, Pa
  Real scale;                                                 ///< h^2
  Real relaxation;
  bool first;
  Kokkos::View<Real*, typename S::memory> state, partial;

  std::size_t scratch_bytes() const { return 2 * Base::row_bytes(3); }

  KOKKOS_FORCEINLINE_FUNCTION static Mat3<T> read(Real const* from) {
    Mat3<T> to;
    for (int c = 0; c < 9; ++c) to.a[c] = load<T>(from + c * Base::lanes);
    return to;
  }
  KOKKOS_FORCEINLINE_FUNCTION static void write(Mat3<T> const& from, Real* to) {
    for (int c = 0; c < 9; ++c) store(from.a[c], to + c * Base::lanes);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    Local const rows(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    this->clear(team, rows, 3);
    team.team_barrier();
    auto const of_patch = this->material(patch);
    T const k(static_cast<Real>(stiffness(this->blocks.material(patch))));
    auto const points = this->points(patch, this->data.data());
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      Real* const own = state.data() + SlotLayout<S, Real, split_numbers>::place(
                                           this->blocks.slot_begin(patch) + g * Base::width);
      std::uint16_t const* const corner = points.corners(g);
      Weights<K, T> const at = points.weights(g);
      Mat3<T> const before = points.deformation(g);
      Mat3<T> const F = before + this->change_of_F(at, corner, local_x.data(), before);
      auto const material = this->own(of_patch, patch, g);
      Mat3<T> const P = Material::stress(Material::evaluate(material, F));
      Mat3<T> Z = F, U = (T(1) / k) * P;
      if (!first) {
        Mat3<T> const target =
            T(relaxation) * F + T(1 - relaxation) * read(own) + read(own + 9 * Base::lanes);
        Z = proximal<Material>(material, k, target);
        U = target - Z;
      }
      if (active) {
        write(Z, own);
        write(U, own + 9 * Base::lanes);
      }
      Mat3<T> const f =
          (T(scale / this->dx) * points.weight(g)) * ((k * (F - Z + U) - P) * transpose(before));
      auto const received = [&](int a, int b, int c, T(&row)[3]) __attribute__((always_inline)) {
        Vec3<T> const fi = f * at.gradient(a, b, c);
        for (int i = 0; i < 3; ++i) row[i] = fi[i];
      };
      this->template give<3>(team, active, corner, rows.data(), received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<3>(team, patch, rows, partial);
  }
};

/// Writes the Hessian of V k/2 |F(x) - Z + U|^2 as the numbers of a ParticleOperator:
/// h^2 V k / dx^2 (F^n F^nT) (x) 1.
template <class S, class Precision, class Material, Spline K, bool packed,
          class To = typename Precision::real>
struct LineariseSplit : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;

  Kokkos::View<double const*, typename S::memory> stiffness;
  Real scale;
  OperatorNumbers<S, To> to;

  std::size_t scratch_bytes() const { return 0; }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Real const k = static_cast<Real>(stiffness(this->blocks.material(patch)));
    auto const points = this->points(patch, this->data.data());
    auto const body = [&](int g) __attribute__((always_inline)) {
      int const slot = this->blocks.slot_begin(patch) + g * Base::width;
      for (int c = 0; c < 3; ++c) to.set(slot, c, points.number(g, c));
      Mat3<T> const before = points.deformation(g);
      T const weight = T(k * scale / (this->dx * this->dx)) * points.weight(g);
      Mat3<T> const left = weight * (before * transpose(before));
      for (int r = 0; r < 9; ++r)
        for (int q = r; q < 9; ++q) {
          to.set(slot, operator_number(q, r), q % 3 == r % 3 ? left(q / 3, r / 3) : T(0));
        }
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), body);
  }
};

template <class S>
struct ScaleNorms {
  Kokkos::View<double const*, typename S::memory> from;
  Kokkos::View<double*, typename S::memory> to;
  double factor;
  KOKKOS_FUNCTION void operator()(int m) const { to(m) = factor * from(m); }
};

}  // namespace kernels

/// What particles keep between the iterations of a splitting.
template <class Real, class Space>
struct SplitParticleState {
  Kokkos::View<Real*, typename Space::memory> numbers;  ///< Z and U of each
  Kokkos::View<double*, typename Space::memory> stiffness;
};

}  // namespace taut
