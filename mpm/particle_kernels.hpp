// The sweeps over the particles of an elastic body. With x_i the displaced places of the nodes, X_i
// where they are at rest, and w_i the weights of the particle where it is as the step begins,
//
//   F(x) = (I + Sum_i (x_i - X_i) grad w_i^T) F^n,      dF = (Sum_i p_i grad w_i^T) F^n,
//
//   gradient   V P(F) b_i      with b_i = F^nT grad w_i      curvature   V b_i' (d2Psi/dF2) b_i
//   form       V dF : d2Psi/dF2 : dF                         product     V dP(F; dF) b_i
//
// (Jiang et al. 2016, section 6; Wang et al. 2020, section 3). What is computed of F and dF is the
// material's, as it is for tets.
#pragma once

#include <taut/core/fem/elastic_kernels.hpp>
#include <taut/mpm/block_sweep.hpp>
#include <taut/mpm/particle_memory.hpp>

namespace taut::kernels {

/// What all elastic sweeps over particles read.
template <class S, class Precision, class Material, Spline K, bool packed>
struct ParticleSweep : BlockSweep<S, typename Precision::real, K, packed> {
  using Real = typename Precision::real;
  using Base = BlockSweep<S, Real, K, packed>;
  using T = typename Base::Value;

  Kokkos::View<Real const*, typename S::memory> data;
  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  Displacement<S, typename Precision::position> displacement;
  Real dx;
  PointMemory<S, Real> memory;  ///< of a material that remembers

  KOKKOS_FORCEINLINE_FUNCTION auto material(int patch) const {
    return Material::template cast<T>(materials(this->blocks.material(patch)));
  }
  /// That of a group of particles: with what they remember.
  template <class Parameters>
  KOKKOS_FORCEINLINE_FUNCTION Parameters own(Parameters const& of_patch, int patch, int g) const {
    if constexpr (RememberingMaterial<Material>) {
      int const slot = this->blocks.slot_begin(patch) + g * Base::width;
      return Material::with(of_patch, memory.template at<T>(slot));
    } else {
      (void)patch, (void)g;
      return of_patch;
    }
  }
  /// How a field on the nodes changes F.
  KOKKOS_FORCEINLINE_FUNCTION Mat3<T> change_of_F(Weights<K, T> const& at,
                                                  std::uint16_t const* corner, Real const* field,
                                                  Mat3<T> const& before) const {
    return (T(1 / dx) * Base::gradient(at, corner, field)) * before;
  }
  /// Round-off as the certificate takes it (inversion_sweeps.hpp): there an entry of dF is off by 2
  /// eps m |B|, with m the largest of the field. Here sums over the nodes of a particle lose up to
  /// 16 eps, and Sum_i |grad w_i| <= 3.5 / dx, which is that with |B| = 28 |F^n| / dx. The I that
  /// is added to the gradient counts as a field of dx / 28.
  KOKKOS_FORCEINLINE_FUNCTION InversionCertificate<T> certificate(Real largest_x,
                                                                  Real largest_p) const {
    return InversionCertificate<T>(largest_x + dx / 28, largest_p);
  }
  KOKKOS_FORCEINLINE_FUNCTION Mat3<T> noise(Mat3<T> const& before) const {
    return T(28 / dx) * before;
  }
  /// The sum over the threads of a team.
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION static double add_up(Team const& team, double sum) {
    if (team.team_size() > 1) team.team_reduce(Kokkos::Sum<double>(sum));
    return sum;
  }
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION static double smallest(Team const& team, T const& squares) {
    Real result = min_lanes(squares);
    if (team.team_size() > 1) team.team_reduce(Kokkos::Min<Real>(result));
    return Kokkos::sqrt(double(result));
  }
};

/// Gradient, curvature if asked for, and if `after_step` the energy change of the step alpha p that
/// led to x; see GradientSweep.
template <class S, class Precision, class Material, Spline K, bool packed>
struct ParticleGradient : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  Curvature curvature;
  bool after_step;
  VectorField<Real, S> p;
  Real alpha;
  Real scale;  ///< h^2
  Kokkos::View<Real*, typename S::memory> partial;
  Kokkos::View<typename Precision::sum*, typename S::memory> change;

  KOKKOS_FUNCTION int numbers() const { return 3 + static_cast<int>(curvature); }
  std::size_t scratch_bytes() const {
    return (after_step ? 2 : 1) * Base::row_bytes(3) + Base::row_bytes(numbers());
  }

  template <Curvature what, class Team>
  KOKKOS_FORCEINLINE_FUNCTION void scatter(Team const& team, bool active,
                                           std::uint16_t const* corner, Weights<K, T> const& at,
                                           Mat3<T> const& to_b,
                                           typename Material::template State<T> const& state,
                                           Real* rows) const {
    Mat3<T> const P = Material::stress(state);
    if constexpr (what == Curvature::none) {
      Mat3<T> const f = P * to_b;
      auto const received = [&](int a, int b, int c, T(&row)[3]) __attribute__((always_inline)) {
        Vec3<T> const fi = f * at.gradient(a, b, c);
        for (int k = 0; k < 3; ++k) row[k] = fi[k];
      };
      this->template give<3>(team, active, corner, rows, received);
    } else {
      auto const h = Material::curvature(state);
      constexpr int numbers_each = 3 + static_cast<int>(what);
      auto const received = [&](int a, int b, int c, T(&row)[numbers_each])
          __attribute__((always_inline)) {
        Vec3<T> const bi = to_b * at.gradient(a, b, c), fi = P * bi;
        for (int k = 0; k < 3; ++k) row[k] = fi[k];
        if constexpr (what == Curvature::diagonal) {
          Vec3<T> const d = h.diagonal(bi);
          for (int k = 0; k < 3; ++k) row[3 + k] = d[k];
        } else {
          Sym3<T> const block = h.block(bi);
          for (int k = 0; k < 6; ++k) row[3 + k] = block.s[k];
        }
      };
      this->template give<numbers_each>(team, active, corner, rows, received);
    }
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    Local const local_p(team.team_scratch(0), after_step ? 4 * Base::nodes : 0);
    Local const rows(team.team_scratch(0), Base::padded(numbers()) * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    if (after_step) this->load_relative(team, patch, p, local_p);
    this->clear(team, rows, numbers());
    team.team_barrier();
    auto const of_patch = this->material(patch);
    auto const points = this->points(patch, this->data.data());
    double energy = 0;
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      std::uint16_t const* const corner = points.corners(g);
      Weights<K, T> const at = points.weights(g);
      Mat3<T> const before = points.deformation(g);
      T const weight = T(scale) * points.weight(g);
      auto const own = this->own(of_patch, patch, g);
      auto state =
          Material::evaluate(own, before + this->change_of_F(at, corner, local_x.data(), before));
      if (after_step) {
        Mat3<T> const dF = T(alpha) * this->change_of_F(at, corner, local_p.data(), before);
        double const change_here = sum_lanes(T(weight * Material::change(own, state, dF)));
        if (active) energy += change_here;
      }
      Material::weigh(state, weight);
      Mat3<T> const to_b = T(1 / this->dx) * transpose(before);
      if (curvature == Curvature::none) {
        scatter<Curvature::none>(team, active, corner, at, to_b, state, rows.data());
      } else if (curvature == Curvature::diagonal) {
        scatter<Curvature::diagonal>(team, active, corner, at, to_b, state, rows.data());
      } else {
        scatter<Curvature::blocks>(team, active, corner, at, to_b, state, rows.data());
      }
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    if (curvature == Curvature::none) {
      this->template take<3>(team, patch, rows, partial);
    } else if (curvature == Curvature::diagonal) {
      this->template take<6>(team, patch, rows, partial);
    } else {
      this->template take<9>(team, patch, rows, partial);
    }
    if (after_step) {
      double const sum = this->add_up(team, energy);
      Kokkos::single(Kokkos::PerTeam(team),
                     [&]() { change(patch) = static_cast<typename Precision::sum>(sum); });
    }
  }
};

/// h^2 H p with the exactly projected second derivative.
template <class S, class Precision, class Material, Spline K, bool packed>
struct ParticleProduct : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  VectorField<Real, S> p;
  Real scale;
  Kokkos::View<Real*, typename S::memory> partial;

  std::size_t scratch_bytes() const { return 3 * Base::row_bytes(3); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    Local const local_p(team.team_scratch(0), 4 * Base::nodes);
    Local const rows(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    this->load_relative(team, patch, p, local_p);
    this->clear(team, rows, 3);
    team.team_barrier();
    auto const of_patch = this->material(patch);
    auto const points = this->points(patch, this->data.data());
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      std::uint16_t const* const corner = points.corners(g);
      Weights<K, T> const at = points.weights(g);
      Mat3<T> const before = points.deformation(g);
      auto state =
          Material::evaluate(this->own(of_patch, patch, g),
                             before + this->change_of_F(at, corner, local_x.data(), before));
      Material::weigh(state, T(scale) * points.weight(g));
      Mat3<T> const dP =
          Material::frame(state).apply(this->change_of_F(at, corner, local_p.data(), before));
      Mat3<T> const f = T(1 / this->dx) * (dP * transpose(before));
      auto const received = [&](int a, int b, int c, T(&row)[3]) __attribute__((always_inline)) {
        Vec3<T> const fi = f * at.gradient(a, b, c);
        for (int k = 0; k < 3; ++k) row[k] = fi[k];
      };
      this->template give<3>(team, active, corner, rows.data(), received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<3>(team, patch, rows, partial);
  }
};

/// Energy, change of energy or p' H p, with a certificate; see MeasureSweep.
template <class S, class Precision, class Material, Spline K, bool packed, Measure measure>
struct ParticleMeasure : ParticleSweep<S, Precision, Material, K, packed> {
  using Base = ParticleSweep<S, Precision, Material, K, packed>;
  using Real = typename Base::Real;
  using T = typename Base::T;
  using Local = typename Base::Local;

  VectorField<Real, S> p;
  Real alpha;
  Kokkos::View<typename Precision::sum*, typename S::memory> total;
  Kokkos::View<double*, typename S::memory> certified;  ///< per patch, if `certifies`

  static constexpr bool certifies = measure == Measure::form && !Material::allows_inversion;

  std::size_t scratch_bytes() const { return 2 * Base::row_bytes(3); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const local_x(team.team_scratch(0), 4 * Base::nodes);
    Local const local_p(team.team_scratch(0), 4 * Base::nodes);
    this->load_relative(team, patch, this->displacement, local_x);
    if constexpr (measure != Measure::energy) this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    auto const of_patch = this->material(patch);
    auto const points = this->points(patch, this->data.data());
    [[maybe_unused]] InversionCertificate<T> const certificate =
        this->certificate(certifies ? this->largest(team, local_x) : Real(0),
                          certifies ? this->largest(team, local_p) : Real(0));
    [[maybe_unused]] T square_length(Kokkos::Experimental::finite_max_v<Real>);
    double energy = 0;
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      std::uint16_t const* const corner = points.corners(g);
      Weights<K, T> const at = points.weights(g);
      Mat3<T> const before = points.deformation(g);
      Mat3<T> F = before + this->change_of_F(at, corner, local_x.data(), before);
      auto const own = this->own(of_patch, patch, g);
      T density;
      if constexpr (measure == Measure::energy) {
        density = Material::energy(own, F);
      } else {
        Mat3<T> dF = this->change_of_F(at, corner, local_p.data(), before);
        if constexpr (measure == Measure::change) {
          dF = T(alpha) * dF;
          F = F + dF;
          density = Material::change(own, Material::evaluate(own, F), dF);
        } else {
          density = Material::quadratic(Material::evaluate(own, F), dF);
          if constexpr (certifies) {
            square_length =
                min(square_length, certificate.square_length(this->noise(before), F, dF));
          }
        }
      }
      double const here = sum_lanes(T(points.weight(g) * density));
      if (active) energy += here;
    };
    this->in_rounds(team, patch, body);
    double const sum = this->add_up(team, energy);
    [[maybe_unused]] double length = 0;
    if constexpr (certifies) length = this->smallest(team, square_length);
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      total(patch) = static_cast<typename Precision::sum>(sum);
      if constexpr (certifies) certified(patch) = length;
    });
  }
};

}  // namespace taut::kernels
