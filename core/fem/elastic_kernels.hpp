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
  /// of the field; [component][max_locals].
  template <class Team, class Field>
  KOKKOS_FORCEINLINE_FUNCTION void load_relative(Team const& team, int patch, Field const& field,
                                                 ScratchField<S, Real> const& to) const {
    int const first = patches.local_begin(patch);
    int const origin = patches.vertex(first);
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), [&](int l) {
      int const v = patches.vertex(first + l);
      for (int c = 0; c < 3; ++c) {
        to(c * patches.max_locals + l) = static_cast<Real>(field(v, c) - field(origin, c));
      }
    });
  }

  /// Edge matrix of group `g`: differences to its first corner.
  KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> edges(int patch, int g,
                                                ScratchField<S, Real> const& field) const {
    std::uint16_t const* corner = corners(patch, g);
    Mat3<Value> d;
    for (int c = 0; c < 3; ++c) {
      Real const* component = field.data() + c * patches.max_locals;
      Value const origin = gather<Value>(component, corner);
      for (int a = 1; a < 4; ++a) {
        d(c, a - 1) = gather<Value>(component, corner + a * lanes) - origin;
      }
    }
    return d;
  }

  KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> inverse_rest(int patch, int g) const {
    Real const* from = rest(patch, g);
    Mat3<Value> B;
    for (int k = 0; k < 9; ++k) B.a[k] = load<Value>(from + k * lanes);
    return B;
  }
  KOKKOS_FORCEINLINE_FUNCTION Value volume(int patch, int g) const {
    return load<Value>(rest(patch, g) + 9 * lanes);
  }

  /// Distance between two numbers of a slot: one slot per corner, and an odd number of cache lines
  /// so that the numbers of one slot do not fall into the same cache set.
  KOKKOS_FORCEINLINE_FUNCTION int stride() const { return patches.max_packs * 4 * lanes + 16; }
  /// Where corner `a` of group g leaves its number k: [number][pack][corner][lane].
  KOKKOS_FORCEINLINE_FUNCTION Real* slot(ScratchField<S, Real> const& slots, int g, int a,
                                         int k) const {
    return slots.data() + k * stride() + (g / per_pack * 4 + a) * lanes + g % per_pack * width;
  }

  /// Adds up the slots of each local vertex, in element order, into its row of `partial`.
  template <int numbers, class Team, class Partial>
  KOKKOS_FORCEINLINE_FUNCTION void gather_slots(Team const& team, int patch,
                                                ScratchField<S, Real> const& slots,
                                                Partial const& partial) const {
    int const first = patches.local_begin(patch), step = stride();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), [&](int l) {
      Real sum[numbers] = {};
      int const last = patches.incidence_begin(first + l + 1);
      for (int k = patches.incidence_begin(first + l); k < last; ++k) {
        Real const* from = slots.data() + patches.incidence(k);
        for (int c = 0; c < numbers; ++c) sum[c] += from[c * step];
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

  int numbers() const { return 3 + static_cast<int>(curvature); }

  std::size_t scratch_bytes() const {
    auto const& v = this->patches;
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(3) * v.max_locals) +
           ScratchField<S, Real>::shmem_size(std::size_t(numbers()) * this->stride()) +
           ScratchField<S, double>::shmem_size(std::size_t(v.max_packs) * Base::per_pack);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 3 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), after_step ? 3 * v.max_locals : 0);
    ScratchField<S, Real> const slots(team.team_scratch(0),
                                      (3 + static_cast<int>(curvature)) * this->stride());
    ScratchField<S, double> const energies(team.team_scratch(0), v.max_packs * Base::per_pack);
    this->load_relative(team, patch, x, local_x);
    if (after_step) this->load_relative(team, patch, p, local_p);
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
        for (int c = 0; c < 3; ++c) store(f[c], this->slot(slots, g, a, c));
        if (curvature == Curvature::diagonal) {
          Vec3<T> const d = weight * Material::diagonal(state, b);
          for (int c = 0; c < 3; ++c) store(d[c], this->slot(slots, g, a, 3 + c));
        } else if (curvature == Curvature::blocks) {
          Sym3<T> const h = Material::block(state, b);
          for (int c = 0; c < 6; ++c) store(T(weight * h.s[c]), this->slot(slots, g, a, 3 + c));
        }
      }
    });
    team.team_barrier();
    if (curvature == Curvature::none) {
      this->template gather_slots<3>(team, patch, slots, partial);
    } else if (curvature == Curvature::diagonal) {
      this->template gather_slots<6>(team, patch, slots, partial);
    } else {
      this->template gather_slots<9>(team, patch, slots, partial);
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
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(3) * this->patches.max_locals) +
           ScratchField<S, Real>::shmem_size(3 * std::size_t(this->stride()));
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 3 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 3 * v.max_locals);
    ScratchField<S, Real> const slots(team.team_scratch(0), 3 * this->stride());
    this->load_relative(team, patch, x, local_x);
    this->load_relative(team, patch, p, local_p);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), [&](int g) {
      Mat3<T> const B = this->inverse_rest(patch, g);
      auto const state = Material::evaluate(lame, this->edges(patch, g, local_x) * B);
      Mat3<T> const dP = (T(scale) * this->volume(patch, g)) *
                         Material::frame(state).apply(this->edges(patch, g, local_p) * B);
      for (int a = 0; a < 4; ++a) {
        Vec3<T> const f = dP * shape_gradient(B, a);
        for (int c = 0; c < 3; ++c) store(f[c], this->slot(slots, g, a, c));
      }
    });
    team.team_barrier();
    this->template gather_slots<3>(team, patch, slots, partial);
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
    return 2 * ScratchField<S, Real>::shmem_size(std::size_t(3) * v.max_locals) +
           ScratchField<S, double>::shmem_size(std::size_t(v.max_packs) * Base::per_pack);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    ScratchField<S, Real> const local_x(team.team_scratch(0), 3 * v.max_locals);
    ScratchField<S, Real> const local_p(team.team_scratch(0), 3 * v.max_locals);
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

/// Smallest step along p at which an element of the patch reaches J = 0, in fp64. An element that
/// is flat or inverted already allows no step if `strict`, and any step otherwise.
template <class S, class Precision>
struct InversionSweep {
  PatchViews<S, typename Precision::real> patches;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
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
    for (int a = 0; a < 4; ++a) v[a] = vertex[corner[a * lanes]];
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
      for (int a = 0; a < 4; ++a) v[a] = vertex[corner[a * lanes]];
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
