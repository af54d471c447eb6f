// The sweeps over the patches of an elastic body (see patches.hpp). With F = Ds B and dF = (dp) B:
//
//   gradient   W P(F) b_a                       curvature   W b_a' (d2Psi/dF2) b_a
//   form       W dF : d2Psi/dF2 : dF            product     W dP(F; dF) b_a
//
// where b_1, b_2, b_3 are the rows of B and b_0 = -(b_1 + b_2 + b_3). On the host a thread computes
// a SIMD pack of elements at a time, on a device one element.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/fem/patches.hpp>
#include <taut/core/math/cubic.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/math/rows.hpp>

namespace taut::kernels {

/// Numbers per corner that a gradient sweep leaves: the gradient, then the requested curvature.
enum class Curvature : int { none = 0, diagonal = 3, blocks = 6 };

template <class S, class Real>
using ScratchField = Kokkos::View<Real*, typename S::execution::scratch_memory_space,
                                  Kokkos::MemoryTraits<Kokkos::Unmanaged>>;

/// A patch in the hands of a team: its vertex data in fast memory and its elements one pack at a
/// time.
template <class S, class Real>
struct PatchSweep {
  /// What one thread computes at a time.
  using Value = std::conditional_t<S::on_host, HostPack<Real>, Real>;
  static constexpr int width = ScalarTraits<Value>::lanes;
  static constexpr int lanes = PatchViews<S, Real>::lanes;
  static constexpr int per_pack = lanes / width;  ///< groups in a pack

  PatchViews<S, Real> patches;

  KOKKOS_FORCEINLINE_FUNCTION int locals(int patch) const {
    return patches.local_begin(patch + 1) - patches.local_begin(patch);
  }
  /// Groups of `width` elements.
  KOKKOS_FORCEINLINE_FUNCTION int groups(int patch) const {
    return (patches.pack_begin(patch + 1) - patches.pack_begin(patch)) * per_pack;
  }

  /// Copies field values of the patch's vertices, less those of its first vertex, in the precision
  /// of the field, in rows of four.
  template <class Team, class Field>
  KOKKOS_FORCEINLINE_FUNCTION void load_relative(Team const& team, int patch, Field const& field,
                                                 ScratchField<S, Real> const& to) const {
    int const first = patches.local_begin(patch);
    int const origin = patches.vertex(first);
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), [&](int l) {
      int const v = patches.vertex(first + l);
      for (int c = 0; c < 3; ++c) {
        to(4 * l + c) = static_cast<Real>(field(v, c) - field(origin, c));
      }
      to(4 * l + 3) = 0;
    });
  }

  /// Edge matrix of group `g`: differences to its first corner.
  KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> edges(int patch, int g,
                                                ScratchField<S, Real> const& field) const {
    std::uint16_t const* corner = corners(patch, g);
    Mat3<Value> d;
    Value origin[3], end[3];
    load_rows(field.data(), corner, origin);
    for (int a = 1; a < 4; ++a) {
      load_rows(field.data(), corner + a * lanes, end);
      for (int c = 0; c < 3; ++c) d(c, a - 1) = end[c] - origin[c];
    }
    return d;
  }

  KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> inverse_rest(int patch, int g) const {
    Real const* from = rest(patch, g);
    auto const entry = [&](int k) { return load<Value>(from + k * lanes); };
    return {
        {entry(0), entry(1), entry(2), entry(3), entry(4), entry(5), entry(6), entry(7), entry(8)}};
  }
  KOKKOS_FORCEINLINE_FUNCTION Value volume(int patch, int g) const {
    return load<Value>(rest(patch, g) + 9 * lanes);
  }

  /// Whether one thread does the whole patch: then it adds to the vertices as it goes, which needs
  /// little memory. Several leave what each corner receives in slots, and add up those of a vertex
  /// when all are there. Both add in the order of the slots: corner by corner within a pack.
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION static bool alone(Team const& team) {
    return S::on_host && team.team_size() == 1;
  }
  /// Size of the field that `give` works on, for `numbers` per corner.
  KOKKOS_FORCEINLINE_FUNCTION std::size_t slot_numbers(int numbers) const {
    return Kokkos::max(numbers * stride(), patches.max_locals * padded(numbers));
  }
  template <int numbers, class Team>
  KOKKOS_FORCEINLINE_FUNCTION void clear(Team const& team, int patch,
                                         ScratchField<S, Real> const& slots) const {
    if (!alone(team)) return;
    for (int k = 0; k < padded(numbers) * locals(patch); ++k) slots(k) = 0;
  }
  /// Hands over what corner `a` of group g receives.
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void give(bool to_vertex, int patch, int g, int a,
                                        Value const (&received)[numbers],
                                        ScratchField<S, Real> const& slots) const {
    if (S::on_host && to_vertex) {
      constexpr int rows = padded(numbers) / 4;
      std::uint16_t const* corner = corners(patch, g) + a * lanes;
      add_rows<Kokkos::min(numbers, 4), rows>(received, slots.data(), corner);
      if constexpr (rows > 1)
        add_rows<Kokkos::min(numbers - 4, 4), rows>(received + 4, slots.data() + 4, corner);
      if constexpr (rows > 2) add_rows<numbers - 8, rows>(received + 8, slots.data() + 8, corner);
    } else {
      // [number][pack][corner][lane]
      Real* const slot = slots.data() + (g / per_pack * 4 + a) * lanes + g % per_pack * width;
      for (int c = 0; c < numbers; ++c) store(received[c], slot + c * stride());
    }
  }
  /// Writes the sum of each local vertex to its row of `partial`.
  template <int numbers, class Team, class Partial>
  KOKKOS_FORCEINLINE_FUNCTION void take(Team const& team, int patch,
                                        ScratchField<S, Real> const& slots,
                                        Partial const& partial) const {
    int const first = patches.local_begin(patch), step = stride();
    bool const added = alone(team);
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), [&](int l) {
      Real sum[numbers] = {};
      if (added) {
        for (int c = 0; c < numbers; ++c) sum[c] = slots(padded(numbers) * l + c);
      } else {
        int const last = patches.incidence_begin(first + l + 1);
        for (int k = patches.incidence_begin(first + l); k < last; ++k) {
          Real const* from = slots.data() + patches.incidence(k);
          for (int c = 0; c < numbers; ++c) sum[c] += from[c * step];
        }
      }
      for (int c = 0; c < numbers; ++c) partial(numbers * (first + l) + c) = sum[c];
    });
  }

  /// Adds up one number per group, in order, into the patch's entry of `total`.
  template <class Team, class Energies, class Total>
  KOKKOS_FORCEINLINE_FUNCTION void add_up(Team const& team, int patch, Energies const& per_group,
                                          Total const& total) const {
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      double sum = 0;
      for (int g = 0; g < groups(patch); ++g) sum += per_group(g);
      total(patch) = static_cast<typename Total::value_type>(sum);
    });
  }

private:
  /// Numbers in the rows of four that hold `numbers`.
  KOKKOS_FORCEINLINE_FUNCTION static constexpr int padded(int numbers) {
    return (numbers + 3) / 4 * 4;
  }
  /// Distance between two numbers of a slot: one slot per corner, and an odd number of cache lines
  /// so that the numbers of one slot do not fall into the same cache set.
  KOKKOS_FORCEINLINE_FUNCTION int stride() const { return patches.max_packs * 4 * lanes + 16; }
  KOKKOS_FORCEINLINE_FUNCTION std::uint16_t const* corners(int patch, int g) const {
    return patches.corner.data() +
           std::size_t(patches.pack_begin(patch) + g / per_pack) * 4 * lanes + g % per_pack * width;
  }
  KOKKOS_FORCEINLINE_FUNCTION Real const* rest(int patch, int g) const {
    return patches.rest.data() +
           std::size_t(patches.pack_begin(patch) + g / per_pack) * 10 * lanes +
           g % per_pack * width;
  }
};

/// Row a of B (a = 1, 2, 3) or minus their sum (a = 0): the gradient of shape function a.
template <class T>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> shape_gradient(Mat3<T> const& B, int a) {
  if (a > 0) return {B(a - 1, 0), B(a - 1, 1), B(a - 1, 2)};
  Vec3<T> b;
  for (int c = 0; c < 3; ++c) b[c] = -(B(0, c) + B(1, c) + B(2, c));
  return b;
}

/// Gradient, curvature if asked for, and if `after_step` the energy change of the step alpha p that
/// led to x. What is asked for is a run-time choice, the same for all elements: one kernel per
/// material.
template <class S, class Precision, class Material>
struct GradientSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  Curvature curvature;
  bool after_step;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  Real alpha;
  Real scale;  ///< h^2
  Kokkos::View<Real*, typename S::memory> partial;
  Kokkos::View<typename Precision::sum*, typename S::memory> change;

  KOKKOS_FUNCTION int numbers() const { return 3 + static_cast<int>(curvature); }

  std::size_t scratch_bytes() const {
    auto const& v = this->patches;
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(4) * v.max_locals) +
           ScratchField<S, Real>::shmem_size(this->slot_numbers(numbers())) +
           ScratchField<S, double>::shmem_size(std::size_t(v.max_packs) * Base::per_pack);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), after_step ? 4 * v.max_locals : 0);
    ScratchField<S, Real> const slots(team.team_scratch(0), this->slot_numbers(numbers()));
    ScratchField<S, double> const energies(team.team_scratch(0), v.max_packs * Base::per_pack);
    this->load_relative(team, patch, x, local_x);
    if (after_step) this->load_relative(team, patch, p, local_p);
    if (curvature == Curvature::none) {
      this->template clear<3>(team, patch, slots);
    } else if (curvature == Curvature::diagonal) {
      this->template clear<6>(team, patch, slots);
    } else {
      this->template clear<9>(team, patch, slots);
    }
    bool const to_vertex = this->alone(team);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), [&](int g) {
      Mat3<T> const B = this->inverse_rest(patch, g);
      T const weight = T(scale) * this->volume(patch, g);
      auto const state = Material::evaluate(lame, this->edges(patch, g, local_x) * B);
      if (after_step) {
        Mat3<T> const dF = T(alpha) * (this->edges(patch, g, local_p) * B);
        energies(g) = sum_lanes(T(weight * Material::change(lame, state, dF)));
      }
      Mat3<T> const P = weight * Material::stress(state);
      for (int a = 0; a < 4; ++a) {
        Vec3<T> const b = shape_gradient(B, a);
        Vec3<T> const f = P * b;
        if (curvature == Curvature::none) {
          this->template give<3>(to_vertex, patch, g, a, {f[0], f[1], f[2]}, slots);
        } else if (curvature == Curvature::diagonal) {
          Vec3<T> const d = weight * Material::diagonal(state, b);
          this->template give<6>(to_vertex, patch, g, a, {f[0], f[1], f[2], d[0], d[1], d[2]},
                                 slots);
        } else {
          Sym3<T> h = Material::block(state, b);
          for (T& entry : h.s) entry = weight * entry;
          this->template give<9>(to_vertex, patch, g, a,
                                 {f[0], f[1], f[2], h.s[0], h.s[1], h.s[2], h.s[3], h.s[4], h.s[5]},
                                 slots);
        }
      }
    });
    team.team_barrier();
    if (curvature == Curvature::none) {
      this->template take<3>(team, patch, slots, partial);
    } else if (curvature == Curvature::diagonal) {
      this->template take<6>(team, patch, slots, partial);
    } else {
      this->template take<9>(team, patch, slots, partial);
    }
    if (after_step) this->add_up(team, patch, energies, change);
  }
};

/// hp += h^2 H p with the exactly projected second derivative.
template <class S, class Precision, class Material>
struct ProductSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  Real scale;
  Kokkos::View<Real*, typename S::memory> partial;

  std::size_t scratch_bytes() const {
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(4) * this->patches.max_locals) +
           ScratchField<S, Real>::shmem_size(this->slot_numbers(3));
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const slots(team.team_scratch(0), this->slot_numbers(3));
    this->load_relative(team, patch, x, local_x);
    this->load_relative(team, patch, p, local_p);
    this->template clear<3>(team, patch, slots);
    bool const to_vertex = this->alone(team);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), [&](int g) {
      Mat3<T> const B = this->inverse_rest(patch, g);
      auto const state = Material::evaluate(lame, this->edges(patch, g, local_x) * B);
      Mat3<T> const dP = (T(scale) * this->volume(patch, g)) *
                         Material::frame(state).apply(this->edges(patch, g, local_p) * B);
      for (int a = 0; a < 4; ++a) {
        Vec3<T> const f = dP * shape_gradient(B, a);
        this->template give<3>(to_vertex, patch, g, a, {f[0], f[1], f[2]}, slots);
      }
    });
    team.team_barrier();
    this->template take<3>(team, patch, slots, partial);
  }
};

/// What a sweep that ends in one number per patch computes.
enum class Measure { energy, change, form };

/// Energy at x, energy change E(x + alpha p) - E(x), or p' H p; one number per patch.
template <class S, class Precision, class Material, Measure measure>
struct MeasureSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  Real alpha;
  Kokkos::View<typename Precision::sum*, typename S::memory> total;

  std::size_t scratch_bytes() const {
    auto const& v = this->patches;
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(4) * v.max_locals) +
           ScratchField<S, double>::shmem_size(std::size_t(v.max_packs) * Base::per_pack);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, double> const energies(team.team_scratch(0), v.max_packs * Base::per_pack);
    this->load_relative(team, patch, x, local_x);
    if constexpr (measure != Measure::energy) this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), [&](int g) {
      Mat3<T> const B = this->inverse_rest(patch, g);
      Mat3<T> F = this->edges(patch, g, local_x) * B;
      T density;
      if constexpr (measure == Measure::energy) {
        density = Material::energy(lame, F);
      } else {
        Mat3<T> dF = this->edges(patch, g, local_p) * B;
        if constexpr (measure == Measure::change) {
          dF = T(alpha) * dF;
          F = F + dF;
          density = Material::change(lame, Material::evaluate(lame, F), dF);
        } else {
          density = Material::quadratic(Material::evaluate(lame, F), dF);
        }
      }
      energies(g) = sum_lanes(T(this->volume(patch, g) * density));
    });
    team.team_barrier();
    this->add_up(team, patch, energies, total);
  }
};

/// A step along p that certainly inverts no element of the patch, found without roots: det (F + t
/// dF) > 0 while t |F^-1 dF| < 1, and F^-1 dF = cof(F)' dF / J. Zero where an element is so flat
/// that round-off counts.
template <class S, class Precision>
struct CertificateSweep : PatchSweep<S, typename Precision::real> {
  using Real = typename Precision::real;
  using Base = PatchSweep<S, Real>;
  using T = typename Base::Value;

  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  Kokkos::View<Real*, typename S::memory> certified;

  std::size_t scratch_bytes() const {
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(4) * this->patches.max_locals);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double& smallest) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 4 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 4 * v.max_locals);
    this->load_relative(team, patch, x, local_x);
    this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    Real best = Kokkos::Experimental::finite_max_v<Real>;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, this->groups(patch)),
        [&](int g, Real& least) {
          Mat3<T> const B = this->inverse_rest(patch, g);
          Mat3<T> const F = this->edges(patch, g, local_x) * B;
          Mat3<T> const C = cofactor(F), G = transpose_times(C, this->edges(patch, g, local_p) * B);
          T const J = dot(F.column(0), C.column(0)), I2 = contract(F, F);
          T const length = T(Real(0.9)) * J / (sqrt(contract(G, G)) + T(Real(1e-30)));
          least = Kokkos::min(least,
                              min_lanes(select(J > T(Real(1e-4)) * I2 * sqrt(I2), length, T(0))));
        },
        Kokkos::Min<Real>(best));
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      certified(patch) = best;
      smallest = Kokkos::min(smallest, double(best));
    });
  }
};

/// Smallest step along p up to `at_most` at which an element of the patch reaches J = 0, in fp64.
/// An element that is flat or inverted already allows no step if `strict`, and any otherwise.
template <class S, class Precision>
struct InversionSweep {
  PatchViews<S, typename Precision::real> patches;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  Kokkos::View<typename Precision::real*, typename S::memory> certified;
  double at_most;
  bool strict;

  template <class Field>
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> edge(Field const& field, int from, int to) const {
    Vec3<double> d;
    for (int c = 0; c < 3; ++c) d[c] = double(field(to, c)) - double(field(from, c));
    return d;
  }

  KOKKOS_FORCEINLINE_FUNCTION double bound(int e, int const* vertex) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    std::uint16_t const* corner =
        patches.corner.data() + std::size_t(e / lanes) * 4 * lanes + e % lanes;
    int v[4];
    for (int a = 0; a < 4; ++a) v[a] = vertex[corner[a * lanes] / 4];
    Mat3<double> D, d;
    double motion = 0;
    for (int a = 0; a < 3; ++a) {
      D.set_column(a, edge(x, v[0], v[a + 1]));
      d.set_column(a, edge(p, v[0], v[a + 1]));
      motion += dot(d.column(a), d.column(a));
    }
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    if (motion == 0) return infinity;
    // J has the sign of det(D) det(B): a rest tet may be numbered either way round.
    Mat3<double> B;
    auto const* rest = patches.rest.data() + std::size_t(e / lanes) * 10 * lanes + e % lanes;
    for (int k = 0; k < 9; ++k) B.a[k] = double(rest[k * lanes]);
    double const sign = determinant(B) < 0 ? -1 : 1;
    Mat3<double> const C = cofactor(D), c = cofactor(d);
    double const det = sign * dot(D.column(0), C.column(0));
    if (!(det > 0)) return strict ? 0 : infinity;
    return smallest_positive_root(det, sign * contract(C, d), sign * contract(D, c),
                                  sign * determinant(d));
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double& smallest) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    int const patch = team.league_rank();
    if (double(certified(patch)) >= at_most) return;
    int const* vertex = patches.vertex.data() + patches.local_begin(patch);
    double best = smallest;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, patches.pack_begin(patch) * lanes,
                                patches.pack_begin(patch + 1) * lanes),
        [&](int e, double& least) { least = Kokkos::min(least, bound(e, vertex)); },
        Kokkos::Min<double>(best));
    Kokkos::single(Kokkos::PerTeam(team), [&]() { smallest = Kokkos::min(smallest, best); });
  }
};

/// Adds what the patches left for vertex i to the gradient and the curvature.
template <class S, class Real, int curvature_numbers, class CurvatureField>
struct GatherVertices {
  PatchViews<S, Real> patches;
  Kokkos::View<Real*, typename S::memory> partial;
  Kokkos::View<std::uint8_t*, typename S::memory> fixed;
  VectorField<Real, S> gradient;
  CurvatureField curvature;

  KOKKOS_FUNCTION void operator()(int i) const {
    constexpr int numbers = 3 + curvature_numbers;
    if (fixed(i)) return;
    Real sum[numbers] = {};
    for (int k = patches.occurrence_begin(i); k < patches.occurrence_begin(i + 1); ++k) {
      Real const* from = partial.data() + std::size_t(numbers) * patches.occurrence(k);
      for (int c = 0; c < numbers; ++c) sum[c] += from[c];
    }
    for (int c = 0; c < 3; ++c) gradient(i, c) += sum[c];
    for (int c = 0; c < curvature_numbers; ++c) curvature(i, c) += sum[3 + c];
  }
};

/// Adds the projected Hessian of the elements of one colour of patches to a block matrix.
template <class S, class Precision, class Material, class Matrix>
struct AssembleColour {
  PatchViews<S, typename Precision::real> patches;
  Kokkos::View<typename Material::template Parameters<double> const*, typename S::memory> materials;
  Kokkos::View<int const*, typename S::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>> colour;
  VectorField<typename Precision::position, S> x;
  Kokkos::View<std::uint8_t*, typename S::memory> fixed;
  Matrix matrix;
  double scale;

  KOKKOS_FUNCTION void operator()(int n) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    int const patch = colour(n);
    int const* vertex = patches.vertex.data() + patches.local_begin(patch);
    auto const lame = materials(patches.material(patch));
    for (int e = patches.pack_begin(patch) * lanes; e < patches.pack_begin(patch + 1) * lanes;
         ++e) {
      auto const* rest = patches.rest.data() + std::size_t(e / lanes) * 10 * lanes + e % lanes;
      auto const* corner = patches.corner.data() + std::size_t(e / lanes) * 4 * lanes + e % lanes;
      double const weight = scale * double(rest[9 * lanes]);
      if (weight == 0) continue;  // padding
      int v[4];
      for (int a = 0; a < 4; ++a) v[a] = vertex[corner[a * lanes] / 4];
      Mat3<double> B, D;
      for (int k = 0; k < 9; ++k) B.a[k] = double(rest[k * lanes]);
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) D(i, j) = double(x(v[j + 1], i)) - double(x(v[0], i));
      auto const frame = Material::frame(Material::evaluate(lame, D * B));
      Vec3<double> beta[4];
      for (int a = 0; a < 4; ++a) beta[a] = transpose_times(frame.V, shape_gradient(B, a));
      for (int a = 0; a < 4; ++a) {
        if (fixed(v[a])) continue;
        for (int b = a; b < 4; ++b) {
          if (fixed(v[b])) continue;
          Mat3<double> const h = weight * frame.vertex_pair(beta[a], beta[b]);
          matrix.add(v[a], v[b], h);
          if (a != b) matrix.add(v[b], v[a], transpose(h));
        }
      }
    }
  }
};

}  // namespace taut::kernels
