// Copies and fills of arrays.
//
// Kokkos::deep_copy is made for any pair of layouts, spaces and types, and instantiates loops for
// all of them at each pair of views that it meets: a tenth of what a source that uses kernels takes
// to compile. Between arrays of the host that lie alike a copy is one of bytes, compiled once; what
// lies otherwise is copied entry by entry. Where a device has a part in it, Kokkos does it.
#pragma once

#include <taut/core/exec/space.hpp>

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

namespace taut {
namespace kernels {

/// Copies `bytes` bytes; on several threads where that pays.
void copy_bytes(void* to, void const* from, std::size_t bytes);

/// Writes the `size` bytes of `value` `count` times. `size` is 1, 4 or 8.
void fill_bytes(void* to, void const* value, std::size_t size, std::size_t count);

/// Throws Error.
[[noreturn]] void refuse_extents(std::string const& to, std::size_t extent_of_to,
                                 std::string const& from, std::size_t extent_of_from);

template <class View>
inline constexpr bool lies_on_host = std::is_same_v<typename View::memory_space, Kokkos::HostSpace>;

/// Whether two views of one shape keep each entry at the same offset, and have no holes.
template <class To, class From>
bool lie_alike(To const& to, From const& from) {
  bool alike = to.span_is_contiguous() && from.span_is_contiguous();
  // An extent of one may have any stride.
  for (std::size_t k = 0; k < To::rank(); ++k)
    alike = alike && (to.extent(k) == 1 || to.stride(k) == from.stride(k));
  return alike;
}

/// Calls `body(i...)` for each index of a view of rank 0 to 3.
template <class View, class Body>
void for_each_entry(View const& view, Body const& body) {
  static_assert(View::rank() <= 3, "a copy entry by entry takes up to three indices");
  if constexpr (View::rank() == 0) {
    body();
  } else {
    for (std::size_t i = 0; i < view.extent(0); ++i) {
      if constexpr (View::rank() == 1) {
        body(i);
      } else {
        for (std::size_t j = 0; j < view.extent(1); ++j) {
          if constexpr (View::rank() == 2) {
            body(i, j);
          } else {
            for (std::size_t k = 0; k < view.extent(2); ++k) body(i, j, k);
          }
        }
      }
    }
  }
}

template <class To, class From>
void check_extents(To const& to, From const& from) {
  static_assert(To::rank() == From::rank(), "arrays of one rank are copied to each other");
  for (std::size_t k = 0; k < To::rank(); ++k) {
    if (to.extent(k) == from.extent(k)) continue;
    refuse_extents(to.label(), to.extent(k), from.label(), from.extent(k));
  }
}

template <class To, class From>
void copy_on_host(To const& to, From const& from) {
  check_extents(to, from);
  if constexpr (std::is_same_v<typename To::value_type, typename From::non_const_value_type>) {
    if (lie_alike(to, from)) {
      copy_bytes(to.data(), from.data(), to.size() * sizeof(typename To::value_type));
      return;
    }
  }
  for_each_entry(to, [&](auto... i) { to(i...) = from(i...); });
}

template <class View>
void fill_on_host(View const& view, typename View::value_type const& value) {
  using T = typename View::value_type;
  if constexpr (std::is_trivially_copyable_v<T> &&
                (sizeof(T) == 1 || sizeof(T) == 4 || sizeof(T) == 8)) {
    if (view.span_is_contiguous()) {
      fill_bytes(view.data(), &value, sizeof(T), view.size());
      return;
    }
  }
  for_each_entry(view, [&](auto... i) { view(i...) = value; });
}

}  // namespace kernels

/// `to` becomes a copy of `from`, a view of the same extents; done when this returns. Throws Error
/// where extents differ.
template <class To, class From>
requires(Kokkos::is_view_v<To>&& Kokkos::is_view_v<From>) void assign(To const& to,
                                                                      From const& from) {
  if constexpr (kernels::lies_on_host<To> && kernels::lies_on_host<From>) {
    kernels::copy_on_host(to, from);
  } else {
    Kokkos::deep_copy(to, from);
  }
}

/// Every entry of `to` becomes `value`; done when this returns.
template <class To, class Value>
requires(Kokkos::is_view_v<To> && !Kokkos::is_view_v<Value>) void assign(To const& to,
                                                                         Value const& value) {
  if constexpr (kernels::lies_on_host<To>) {
    kernels::fill_on_host(to, static_cast<typename To::value_type>(value));
  } else {
    Kokkos::deep_copy(to, static_cast<typename To::value_type>(value));
  }
}

/// The same in the order of what S::instance() does, which a device may do later.
template <class S, class To, class From>
void assign_on(To const& to, From const& from) {
  if constexpr (kernels::lies_on_host<To>) {
    if constexpr (!Kokkos::is_view_v<From>) {
      assign(to, from);
      return;
    } else if constexpr (kernels::lies_on_host<From>) {
      assign(to, from);
      return;
    }
  }
  if constexpr (!kernels::lies_on_host<To> || !S::on_host) {
    if constexpr (Kokkos::is_view_v<From>) {
      Kokkos::deep_copy(S::instance(), to, from);
    } else {
      Kokkos::deep_copy(S::instance(), to, static_cast<typename To::value_type>(from));
    }
  }
}

/// A copy of a host vector in a space.
template <class S, class T>
Kokkos::View<T*, typename S::memory> to_space(char const* name, std::vector<T> const& from) {
  Kokkos::View<T*, typename S::memory> to(
      Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string(name)), from.size());
  Kokkos::View<T const*, Kokkos::HostSpace, Kokkos::MemoryTraits<Kokkos::Unmanaged>> host(
      from.data(), from.size());
  assign(to, host);
  return to;
}

}  // namespace taut
