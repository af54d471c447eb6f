// The frame of a sweep over patches (see patches.hpp): what a team does with a patch, whatever it
// computes for the elements. On the host a thread computes a SIMD pack of elements at a time, on a
// device one element.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/fem/patches.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/math/row_pairs.hpp>

namespace taut::kernels {

template <class S, class Real>
using ScratchField = Kokkos::View<Real*, typename S::execution::scratch_memory_space,
                                  Kokkos::MemoryTraits<Kokkos::Unmanaged>>;

/// Numbers in the rows of four that hold `numbers`.
KOKKOS_FORCEINLINE_FUNCTION constexpr int padded(int numbers) { return (numbers + 3) / 4 * 4; }

/// Distance between two numbers of a slot: one slot per corner, and an odd number of cache lines so
/// that the numbers of one slot do not fall into the same cache set.
KOKKOS_FORCEINLINE_FUNCTION constexpr int slot_stride(int packs, int lanes) {
  return packs * 4 * lanes + 16;
}

/// Numbers that a sweep over patches of up to so many packs and local vertices keeps at hand: two
/// vectors of each vertex,
KOKKOS_FORCEINLINE_FUNCTION constexpr std::size_t row_numbers(int locals) {
  return std::size_t(8) * locals;
}
/// what corners receive, `numbers` each,
KOKKOS_FORCEINLINE_FUNCTION constexpr std::size_t slot_numbers(int packs, int lanes, int locals,
                                                               int numbers) {
  std::size_t const slots = std::size_t(numbers) * slot_stride(packs, lanes),
                    rows = std::size_t(locals) * padded(numbers);
  return slots > rows ? slots : rows;
}
/// and one number of each element.
KOKKOS_FORCEINLINE_FUNCTION constexpr std::size_t element_numbers(int packs, int lanes) {
  return std::size_t(packs) * lanes;
}

/// Bytes that a gradient sweep, which needs the most of all, asks for.
constexpr std::size_t gradient_sweep_bytes(int packs, int lanes, int locals, int numbers,
                                           std::size_t number_bytes) {
  constexpr std::size_t alignment = 3 * sizeof(double);
  return number_bytes * (row_numbers(locals) + slot_numbers(packs, lanes, locals, numbers) +
                         element_numbers(packs, lanes)) +
         alignment;
}

/// What Kokkos leaves a team of the 48 KiB that a block of threads has on any NVIDIA GPU, rounded
/// down.
inline constexpr std::size_t device_scratch = 39 * 1024;

/// Tets per patch with which a gradient sweep of `numbers` per corner fits into `bytes`. Patches
/// have half as many vertices as tets, or fewer, unless they are tiny or branch out.
constexpr int patch_size_within(std::size_t bytes, int lanes, int numbers,
                                std::size_t number_bytes) {
  int size = lanes;  // full packs
  auto const needed = [&](int tets) {
    return gradient_sweep_bytes(tets / lanes, lanes, tets / 2, numbers, number_bytes);
  };
  while (needed(size + lanes) <= bytes) size += lanes;
  return size;
}

/// The same for a device: with blocks in single precision, with a diagonal in double precision, of
/// which blocks would leave too few tets to keep a team busy.
constexpr int device_patch_size(int lanes, std::size_t number_bytes) {
  return patch_size_within(device_scratch, lanes, number_bytes < sizeof(double) ? 9 : 6,
                           number_bytes);
}

/// Where a sweep leaves what vertices receive: with the vertices that belong to one patch alone,
/// and in a row of `partial`, of padded(numbers), for each patch that shares a vertex.
template <class S, class Real>
struct SweepOutput {
  Kokkos::View<Real*, typename S::memory> partial;
  Kokkos::View<std::uint8_t*, typename S::memory> fixed;
  VectorField<Real, S> gradient;
  VectorField<Real, S> diagonal;  ///< if there are 6 numbers
  BlockField<Real, S> blocks;     ///< if there are 9

  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int v, Real const* sum) const {
    if (fixed(v)) return;
    for (int c = 0; c < 3; ++c) gradient(v, c) += sum[c];
    if constexpr (numbers == 6) {
      for (int c = 0; c < 3; ++c) diagonal(v, c) += sum[3 + c];
    } else if constexpr (numbers == 9) {
      for (int c = 0; c < 6; ++c) blocks(v, c) += sum[3 + c];
    }
  }
};

/// Asks for `count` numbers that the host will read soon.
template <int count, class T>
KOKKOS_FORCEINLINE_FUNCTION void prefetch([[maybe_unused]] T const* from) {
#if defined(__GNUC__) && !defined(__CUDACC__)
  constexpr int per_line = 64 / sizeof(T);
  for (int k = 0; k < count; k += per_line) __builtin_prefetch(from + k);
#endif
}

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
  int scratch_level = 0;  ///< of what `room` gives; see for_each_team

  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION ScratchField<S, Real> room(Team const& team,
                                                         std::size_t numbers) const {
    return ScratchField<S, Real>(team.team_scratch(S::on_host ? 0 : scratch_level), numbers);
  }

  KOKKOS_FORCEINLINE_FUNCTION int locals(int patch) const {
    return patches.local_begin(patch + 1) - patches.local_begin(patch);
  }
  /// Groups of `width` elements.
  KOKKOS_FORCEINLINE_FUNCTION int groups(int patch) const {
    return (patches.pack_begin(patch + 1) - patches.pack_begin(patch)) * per_pack;
  }

  /// What the patch's vertices have of a field, less what its first vertex has, in the precision of
  /// the field: in places 4 `which` and on of a row of eight each. Returns the largest of these
  /// numbers, without sign, if `measured`; what is not a number is passed over.
  template <bool measured = false, class Team, class Field>
  KOKKOS_FORCEINLINE_FUNCTION Real load_relative(Team const& team, int patch, Field const& field,
                                                 int which, ScratchField<S, Real> const& to) const {
    int const* const vertex = patches.vertex.data() + patches.local_begin(patch);
    Real* const rows = to.data() + 4 * which;
    typename Field::non_const_value_type origin[3];
    for (int c = 0; c < 3; ++c) origin[c] = field(*vertex, c);
    LargestOfRows<Real> largest;
    auto const body = [&](int l) __attribute__((always_inline)) {
      store_relative(field, vertex[l], origin, rows + 8 * l);
      if constexpr (measured) largest.add(rows + 8 * l);
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), body);
    if constexpr (!measured) return 0;
    Real most = largest.get();
    team.team_reduce(Kokkos::Max<Real>(most));
    return most;
  }
  /// Numbers in those rows.
  KOKKOS_FORCEINLINE_FUNCTION std::size_t row_numbers() const {
    return kernels::row_numbers(patches.max_locals);
  }

  /// The elements of one patch behind plain pointers, which stay in registers through the stores of
  /// a sweep.
  struct Elements {
    std::uint16_t const* corner;
    Real const* rest;

    /// The same elements, unrelated for the compiler: it would rather keep the addresses of 32 rows
    /// on the stack than compute them anew for the next field.
    KOKKOS_FORCEINLINE_FUNCTION Elements apart() const {
      Elements other = *this;
#if !defined(__CUDA_ARCH__)
      asm("" : "+r"(other.corner));
#endif
      return other;
    }
    KOKKOS_FORCEINLINE_FUNCTION std::uint16_t const* corners(int g) const {
      return corner + g / per_pack * 4 * lanes + g % per_pack * width;
    }
    /// Edge matrix of group `g`, of the first vectors of `rows`: differences to the corner in the
    /// last place.
    KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> edges(int g, Real const* rows) const {
      Mat3<Value> d;
      Value origin[3], end[3];
      load_rows<2>(rows, corners(g) + 3 * lanes, origin);
      for (int a = 0; a < 3; ++a) {
        load_rows<2>(rows, corners(g) + a * lanes, end);
        for (int c = 0; c < 3; ++c) d(c, a) = end[c] - origin[c];
      }
      return d;
    }
    /// The same of both vectors. No loop: compilers leave one as large as this rolled up.
    KOKKOS_FORCEINLINE_FUNCTION void edges(int g, Real const* rows, Mat3<Value>& first,
                                           Mat3<Value>& second) const {
      Value origin[2][3];
      load_row_pairs(rows, corners(g) + 3 * lanes, origin[0], origin[1]);
      set_edges<0>(g, rows, origin, first, second);
      set_edges<1>(g, rows, origin, first, second);
      set_edges<2>(g, rows, origin, first, second);
    }
    template <int a>
    KOKKOS_FORCEINLINE_FUNCTION void set_edges(int g, Real const* rows, Value const (&origin)[2][3],
                                               Mat3<Value>& first, Mat3<Value>& second) const {
      Value end[2][3];
      load_row_pairs(rows, corners(g) + a * lanes, end[0], end[1]);
      for (int c = 0; c < 3; ++c) first(c, a) = end[0][c] - origin[0][c];
      for (int c = 0; c < 3; ++c) second(c, a) = end[1][c] - origin[1][c];
    }
    KOKKOS_FORCEINLINE_FUNCTION Value shape(int g, int k) const {
      return load<Value>(rest + (g / per_pack * 10 + k) * lanes + g % per_pack * width);
    }
    KOKKOS_FORCEINLINE_FUNCTION Mat3<Value> inverse_rest(int g) const {
      return {{shape(g, 0), shape(g, 1), shape(g, 2), shape(g, 3), shape(g, 4), shape(g, 5),
               shape(g, 6), shape(g, 7), shape(g, 8)}};
    }
    KOKKOS_FORCEINLINE_FUNCTION Value volume(int g) const { return shape(g, 9); }
    /// Asks for what is read next, a line of the cache (64 bytes) of each number: hardware that
    /// follows a stream of reads stops where a page ends, which these reach every few packs. After
    /// the last pack it asks in vain. Farther ahead was slower.
    KOKKOS_FORCEINLINE_FUNCTION void ask_ahead(int g) const {
      constexpr int line = 64, pack = lanes * sizeof(Real), ahead = pack < line ? line / pack : 1;
      std::size_t const next = g / per_pack + ahead;
      prefetch<10 * lanes>(rest + next * 10 * lanes);
      prefetch<4 * lanes>(corner + next * 4 * lanes);
    }
  };
  KOKKOS_FORCEINLINE_FUNCTION Elements elements(int patch) const {
    std::size_t const pack = patches.pack_begin(patch);
    return {patches.corner.data() + pack * 4 * lanes, patches.rest.data() + pack * 10 * lanes};
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
    return kernels::slot_numbers(patches.max_packs, lanes, patches.max_locals, numbers);
  }
  template <int numbers, class Team>
  KOKKOS_FORCEINLINE_FUNCTION void clear(Team const& team, int patch,
                                         ScratchField<S, Real> const& slots) const {
    if (!alone(team)) return;
    for (int k = 0; k < padded(numbers) * locals(patch); ++k) slots(k) = 0;
  }
  /// Hands over what the corner in place `a` of group g receives.
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void give(bool to_vertex, Elements const& elements, int g, int a,
                                        Value const (&received)[numbers], Real* slots) const {
    if (S::on_host && to_vertex) {
      add_rows<numbers, padded(numbers) / 4>(received, slots, elements.corners(g) + a * lanes);
    } else {
      // [number][pack][corner][lane]
      Real* const slot = slots + (g / per_pack * 4 + a) * lanes + g % per_pack * width;
      for (int c = 0; c < numbers; ++c) store(received[c], slot + c * stride());
    }
  }
  /// Hands over the sum of each local vertex.
  template <int numbers, class Team>
  KOKKOS_FORCEINLINE_FUNCTION void take(Team const& team, int patch,
                                        ScratchField<S, Real> const& slots,
                                        SweepOutput<S, Real> const& output) const {
    int const first = patches.local_begin(patch), step = stride();
    int const* const vertex = patches.vertex.data() + first;
    int const* const row = patches.row.data() + first;
    int const* const begin = patches.incidence_begin.data() + first;
    std::uint16_t const* const incidence = patches.incidence.data();
    Real const* const slot = slots.data();
    Real* const partial = output.partial.data();
    bool const added = alone(team);
    auto const body = [&](int l) __attribute__((always_inline)) {
      Real sum[padded(numbers)] = {};
      if (added) {
        for (int c = 0; c < padded(numbers); ++c) sum[c] = slot[padded(numbers) * l + c];
      } else {
        for (int k = begin[l]; k < begin[l + 1]; ++k) {
          for (int c = 0; c < numbers; ++c) sum[c] += slot[incidence[k] + c * step];
        }
      }
      if (row[l] >= 0) {
        Real* const to = partial + std::size_t(padded(numbers)) * row[l];
        for (int c = 0; c < padded(numbers); ++c) to[c] = sum[c];
      } else {
        output.template add<numbers>(vertex[l], sum);
      }
    };
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, locals(patch)), body);
  }

  /// Room for a number of each element of the largest patch.
  KOKKOS_FORCEINLINE_FUNCTION std::size_t element_numbers() const {
    return kernels::element_numbers(patches.max_packs, lanes);
  }
  /// Adds up what `store` has left of each group, lane by lane and then the lanes, into the patch's
  /// entry of `total`.
  template <class Team, class Total>
  KOKKOS_FORCEINLINE_FUNCTION void add_up(Team const& team, int patch,
                                          ScratchField<S, Real> const& per_element,
                                          Total const& total) const {
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      Real const* const from = per_element.data();
      double sum[lanes] = {};
      int const count = groups(patch) * width;
      for (int k = 0; k < count; k += lanes)
        for (int i = 0; i < lanes; ++i) sum[i] += double(from[k + i]);
      for (int i = 1; i < lanes; ++i) sum[0] += sum[i];
      total(patch) = static_cast<typename Total::value_type>(sum[0]);
    });
  }

  /// The root of the smallest square that the threads of a team have found.
  template <class Team>
  KOKKOS_FORCEINLINE_FUNCTION static double smallest(Team const& team, Value const& squares) {
    Real result = min_lanes(squares);
    team.team_reduce(Kokkos::Min<Real>(result));
    return Kokkos::sqrt(double(result));
  }

private:
  KOKKOS_FORCEINLINE_FUNCTION int stride() const { return slot_stride(patches.max_packs, lanes); }
};

}  // namespace taut::kernels
