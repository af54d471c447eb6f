// Where data live and kernels run. A Space names an execution space of Kokkos and a memory layout;
// every container and kernel of the library takes one, so that the same code runs with OpenMP, in
// serial and with CUDA, and so that the tests can run a device's layout on the host.
#pragma once

#include <Kokkos_Core.hpp>

#include <cstdint>

namespace taut {

template <class Execution, class Layout = typename Execution::array_layout>
struct Space {
  using execution = Execution;
  using memory = typename Execution::memory_space;
  using layout = Layout;
  using team_policy = Kokkos::TeamPolicy<Execution>;
  using team_member = typename team_policy::member_type;
  static constexpr bool on_host = Kokkos::SpaceAccessibility<Kokkos::HostSpace, memory>::accessible;

  /// The instance of the execution space that everything runs on: the default one, made once, for
  /// each `execution()` allocates.
  static execution const& instance() {
    static execution const space;
    return space;
  }
};

using DefaultSpace = Space<Kokkos::DefaultExecutionSpace>;
using SerialSpace = Space<Kokkos::Serial>;

/// A run of `T`.
template <class T, class S>
using Array = Kokkos::View<T*, typename S::layout, typename S::memory>;

/// One 3-vector per unknown (mesh vertex or grid node): `field(i, c)`.
template <class T, class S>
using VectorField = Kokkos::View<T* [3], typename S::layout, typename S::memory>;

/// One symmetric 3x3 block per unknown, stored as xx, yy, zz, xy, yz, xz: `field(i, k)`.
template <class T, class S>
using BlockField = Kokkos::View<T* [6], typename S::layout, typename S::memory>;

/// Scalar types of a computation. `position` holds the unknowns, `real` everything that kernels
/// load and store otherwise (gradients, directions, element data) and compute with, `sum`
/// accumulates.
struct Fp64 {
  using position = double;
  using real = double;
  using sum = double;
  static constexpr char const* name = "fp64";
};
struct Mixed {
  using position = double;
  using real = float;
  using sum = double;
  static constexpr char const* name = "mixed";
};
struct Fp32 {
  using position = float;
  using real = float;
  using sum = float;
  static constexpr char const* name = "fp32";
};

}  // namespace taut
