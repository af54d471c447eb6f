// The sweeps over the patches of an elastic body (see patches.hpp). With F = Ds B and dF = (dp) B:
//
//   gradient   W P(F) b_a                       curvature   W b_a' (d2Psi/dF2) b_a
//   form       W dF : d2Psi/dF2 : dF            product     W dP(F; dF) b_a
//
// (see tet_state.hpp), where b_0, b_1, b_2 are the rows of B and b_3 = -(b_0 + b_1 + b_2): in a
// patch the corner that edges start from comes last. The loop bodies are inlined by force: called,
// they would fetch what they capture anew after every store.
#pragma once

#include <taut/core/fem/inversion_sweeps.hpp>
#include <taut/core/fem/tet_state.hpp>

namespace taut::kernels {

/// Numbers per corner that a gradient sweep leaves: the gradient, then the requested curvature.
enum class Curvature : int { none = 0, diagonal = 3, blocks = 6 };

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
  SweepOutput<S, Real> output;
  Kokkos::View<typename Precision::sum*, typename S::memory> change;

  KOKKOS_FUNCTION int numbers() const { return 3 + static_cast<int>(curvature); }

  /// Hands each corner its gradient and curvature.
  template <Curvature what>
  KOKKOS_FORCEINLINE_FUNCTION void scatter(bool to_vertex, typename Base::Elements const& elements,
                                           int g, TetState<Material, T> const& tet,
                                           Real* slots) const {
    Vec3<T> sum;
#if defined(__CUDA_ARCH__)
#pragma unroll
#elif !defined(__CUDACC__)
#pragma GCC unroll 4
#endif
    for (int a = 0; a < 4; ++a) {
      Vec3<T> const f = a < 3 ? tet.gradient(a) : -sum;
      sum = a == 0 ? f : sum + f;
      if constexpr (what == Curvature::none) {
        this->template give<3>(to_vertex, elements, g, a, {f[0], f[1], f[2]}, slots);
      } else if constexpr (what == Curvature::diagonal) {
        Vec3<T> const d = tet.diagonal(a);
        this->template give<6>(to_vertex, elements, g, a, {f[0], f[1], f[2], d[0], d[1], d[2]},
                               slots);
      } else {
        Sym3<T> const h = tet.block(a);
        this->template give<9>(to_vertex, elements, g, a,
                               {f[0], f[1], f[2], h.s[0], h.s[1], h.s[2], h.s[3], h.s[4], h.s[5]},
                               slots);
      }
    }
  }

  std::size_t scratch_bytes() const {
    return ScratchField<S, Real>::shmem_size(this->row_numbers()) +
           ScratchField<S, Real>::shmem_size(this->slot_numbers(numbers())) +
           ScratchField<S, Real>::shmem_size(this->element_numbers());
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    if (v.idle(patch)) {
      if (after_step) Kokkos::single(Kokkos::PerTeam(team), [&]() { change(patch) = 0; });
      return;
    }
    auto const local = this->room(team, this->row_numbers());
    auto const slots = this->room(team, this->slot_numbers(numbers()));
    auto const energies = this->room(team, this->element_numbers());
    this->load_relative(team, patch, x, 0, local);
    if (after_step) this->load_relative(team, patch, p, 1, local);
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
    auto const elements = this->elements(patch);
    auto const body = [&](int g) __attribute__((always_inline)) {
      elements.ask_ahead(g);
      Mat3<T> D, d;
      if (after_step) {
        elements.edges(g, local.data(), D, d);
      } else {
        D = elements.edges(g, local.data());
        d = {};
      }
      T const weight = T(scale) * elements.volume(g);
      TetState<Material, T> tet(lame, elements.inverse_rest(g), D);
      if (after_step) {
        store(T(weight * tet.change(T(alpha) * d)), energies.data() + g * Base::width);
      }
      tet.weigh(weight);
      if (curvature == Curvature::none) {
        scatter<Curvature::none>(to_vertex, elements.apart(), g, tet, slots.data());
      } else if (curvature == Curvature::diagonal) {
        scatter<Curvature::diagonal>(to_vertex, elements.apart(), g, tet, slots.data());
      } else {
        scatter<Curvature::blocks>(to_vertex, elements.apart(), g, tet, slots.data());
      }
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), body);
    team.team_barrier();
    if (curvature == Curvature::none) {
      this->template take<3>(team, patch, slots, output);
    } else if (curvature == Curvature::diagonal) {
      this->template take<6>(team, patch, slots, output);
    } else {
      this->template take<9>(team, patch, slots, output);
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
  SweepOutput<S, Real> output;

  std::size_t scratch_bytes() const {
    return ScratchField<S, Real>::shmem_size(this->row_numbers()) +
           ScratchField<S, Real>::shmem_size(this->slot_numbers(3));
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    auto const local = this->room(team, this->row_numbers());
    auto const slots = this->room(team, this->slot_numbers(3));
    this->load_relative(team, patch, x, 0, local);
    this->load_relative(team, patch, p, 1, local);
    this->template clear<3>(team, patch, slots);
    bool const to_vertex = this->alone(team);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    auto const elements = this->elements(patch);
    auto const body = [&](int g) __attribute__((always_inline)) {
      elements.ask_ahead(g);
      Mat3<T> const B = elements.inverse_rest(g);
      Mat3<T> D, d;
      elements.edges(g, local.data(), D, d);
      auto state = Material::evaluate(lame, D * B);
      Material::weigh(state, T(scale) * elements.volume(g));
      Mat3<T> const dP = Material::frame(state).apply(d * B);
      Vec3<T> rest{T(0), T(0), T(0)};
      for (int a = 0; a < 4; ++a) {
        Vec3<T> const f = a < 3 ? dP * shape_gradient(B, a) : -rest;
        rest = rest + f;
        this->template give<3>(to_vertex, elements, g, a, {f[0], f[1], f[2]}, slots.data());
      }
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), body);
    team.team_barrier();
    this->template take<3>(team, patch, slots, output);
  }
};

/// What a sweep that ends in one number per patch computes.
enum class Measure { energy, change, form };

/// Energy at x, energy change E(x + alpha p) - E(x), or p' H p; one number per patch. Where the
/// material forbids inversion, p' H p comes with a certificate of how far x + t p has none: both
/// need F and dF.
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
  Kokkos::View<double*, typename S::memory> certified;  ///< per patch, if `certifies`

  static constexpr bool certifies = measure == Measure::form && !Material::allows_inversion;

  std::size_t scratch_bytes() const {
    return ScratchField<S, Real>::shmem_size(this->row_numbers()) +
           ScratchField<S, Real>::shmem_size(this->element_numbers());
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    auto const& v = this->patches;
    if (v.idle(patch)) {
      Kokkos::single(Kokkos::PerTeam(team), [&]() {
        total(patch) = 0;
        if constexpr (certifies) certified(patch) = Kokkos::Experimental::infinity_v<double>;
      });
      return;
    }
    auto const local = this->room(team, this->row_numbers());
    auto const energies = this->room(team, this->element_numbers());
    [[maybe_unused]] Real largest_x = 0, largest_p = 0;
    largest_x = this->template load_relative<certifies>(team, patch, x, 0, local);
    if constexpr (measure != Measure::energy)
      largest_p = this->template load_relative<certifies>(team, patch, p, 1, local);
    team.team_barrier();
    auto const lame = Material::template cast<T>(materials(v.material(patch)));
    auto const elements = this->elements(patch);
    [[maybe_unused]] InversionCertificate<T> const certificate(largest_x, largest_p);
    [[maybe_unused]] T square_length(Kokkos::Experimental::finite_max_v<Real>);
    auto const body = [&](int g) __attribute__((always_inline)) {
      elements.ask_ahead(g);
      Mat3<T> const B = elements.inverse_rest(g);
      T density;
      if constexpr (measure == Measure::energy) {
        density = Material::energy(lame, elements.edges(g, local.data()) * B);
      } else {
        Mat3<T> D, d;
        elements.edges(g, local.data(), D, d);
        if constexpr (measure == Measure::change) {
          d = T(alpha) * d;
          density = TetState<Material, T>(lame, B, D + d).change(d);
        } else {
          density = TetState<Material, T>(lame, B, D).quadratic(d);
          if constexpr (certifies) {
            square_length = min(square_length, certificate.square_length(B, D, d));
          }
        }
      }
      store(T(elements.volume(g) * density), energies.data() + g * Base::width);
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, this->groups(patch)), body);
    team.team_barrier();
    this->add_up(team, patch, energies, total);
    if constexpr (certifies) {
      double const length = this->smallest(team, square_length);
      Kokkos::single(Kokkos::PerTeam(team), [&]() { certified(patch) = length; });
    }
  }
};

/// Adds up what the patches left for a vertex that they share.
template <class S, class Real, int numbers>
struct GatherShared {
  PatchViews<S, Real> patches;
  SweepOutput<S, Real> output;

  KOKKOS_FUNCTION void operator()(int i) const {
    Real sum[padded(numbers)] = {};
    for (int row = patches.shared_begin(i); row < patches.shared_begin(i + 1); ++row) {
      Real const* from = output.partial.data() + std::size_t(padded(numbers)) * row;
      for (int c = 0; c < padded(numbers); ++c) sum[c] += from[c];
    }
    output.template add<numbers>(patches.shared(i), sum);
  }
};

/// What the patches of a body left, times `scale`, goes to one vertex of it.
template <class S, class Sum>
struct ShareByBody {
  Kokkos::View<int const*, typename S::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>> begin,
      patch, vertex;  ///< per body, +1: its patches; and a vertex of it
  Kokkos::View<Sum*, typename S::memory> total;
  double scale;
  Array<double, S> shares;
  KOKKOS_FUNCTION void operator()(int b) const {
    double sum = 0;
    for (int k = begin(b); k < begin(b + 1); ++k) sum += double(total(patch(k)));
    shares(vertex(b)) += scale * sum;
  }
};

/// Marks the patches of idle vertices.
template <class S, class Real>
struct MarkPatches {
  PatchViews<S, Real> patches;
  Kokkos::View<std::uint8_t*, typename S::memory> idle;  ///< per vertex; or empty
  KOKKOS_FUNCTION void operator()(int p) const {
    patches.idle(p) = idle.extent(0) > 0 ? idle(patches.vertex(patches.local_begin(p))) : 0;
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

  /// Elements side by side: in fp64 whatever the precision, a register of them on the host.
  static constexpr int width = S::on_host ? host_lanes<double> : 1;
  using T = typename PackOf<double, width>::type;

  KOKKOS_FUNCTION void operator()(int n) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    int const patch = colour(n);
    auto const lame = Material::template cast<T>(materials(patches.material(patch)));
    for (int e = patches.pack_begin(patch) * lanes; e < patches.pack_begin(patch + 1) * lanes;
         e += width) {
      add(patch, lame, e / lanes, e % lanes);
    }
  }

private:
  /// The elements of a pack from `lane` on.
  KOKKOS_FUNCTION void add(int patch, typename Material::template Parameters<T> const& lame,
                           int pack, int lane) const {
    constexpr int lanes = PatchViews<S, typename Precision::real>::lanes;
    int const* const vertex = patches.vertex.data() + patches.local_begin(patch);
    auto const* const rest = patches.rest.data() + std::size_t(pack) * 10 * lanes + lane;
    auto const* const corner = patches.corner.data() + std::size_t(pack) * 4 * lanes + lane;
    int v[4][width];
    double number[9][width], edge[9][width], weight[width];
    for (int l = 0; l < width; ++l) {
      weight[l] = scale * double(rest[9 * lanes + l]);
      for (int a = 0; a < 4; ++a) v[a][l] = vertex[corner[a * lanes + l] / 4];
      for (int k = 0; k < 9; ++k) {
        number[k][l] = double(rest[k * lanes + l]);
        edge[k][l] = double(x(v[k / 3][l], k % 3)) - double(x(v[3][l], k % 3));
      }
    }
    Mat3<T> B, D;
    for (int k = 0; k < 9; ++k) {
      B.a[k] = load<T>(number[k]);
      D.a[k] = load<T>(edge[k]);
    }
    auto const frame = Material::frame(Material::evaluate(lame, D * B));
    Vec3<T> beta[4];
    for (int a = 0; a < 4; ++a) beta[a] = transpose_times(frame.V, shape_gradient(B, a));
    for (int a = 0; a < 4; ++a)
      for (int b = a; b < 4; ++b) {
        Mat3<T> const pair = load<T>(weight) * frame.vertex_pair(beta[a], beta[b]);
        for (int k = 0; k < 9; ++k) store(pair.a[k], number[k]);
        for (int l = 0; l < width; ++l) {
          if (weight[l] == 0 || fixed(v[a][l]) || fixed(v[b][l])) continue;  // or padding
          Mat3<double> h;
          for (int k = 0; k < 9; ++k) h.a[k] = number[k][l];
          matrix.add(v[a][l], v[b][l], h);
          if (a != b) matrix.add(v[b][l], v[a][l], transpose(h));
        }
      }
  }
};

}  // namespace taut::kernels
