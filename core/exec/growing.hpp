// Arrays that make room as needed: they never shrink, so that what is rebuilt often and seldom
// grows seldom allocates.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/space.hpp>

#include <cstddef>
#include <string>

namespace taut {

/// Gives `view` room for `count` entries along its first extent, and half as many more if it must
/// allocate, in which case what was in it is lost.
template <class View>
void grow(View& view, char const* name, std::size_t count) {
  if (view.extent(0) >= count) return;
  view = View();  // the old memory first
  view =
      View(Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string(name)), count + count / 2);
}

/// Memory for a view whose first extent changes from step to step.
template <class View>
class Resizable {
public:
  /// A view of n entries, by `others` where other extents are not fixed either. Takes new memory,
  /// which is zero, only if there is less than that; otherwise what is in it has no meaning. Valid
  /// until the next call, and while this lives.
  template <class... Others>
  View resize(char const* name, std::size_t n, Others... others) {
    std::size_t const needed = View::required_allocation_size(n, std::size_t(others)...);
    if (needed > capacity_ || memory_.data() == nullptr) {
      bool const first = capacity_ == 0;
      memory_ = View();  // the old memory first
      std::size_t const room = first ? n : n + n / 2;
      memory_ = View(std::string(name), room, std::size_t(others)...);
      capacity_ = View::required_allocation_size(room, std::size_t(others)...);
    }
    return View(memory_.data(), n, std::size_t(others)...);
  }

private:
  View memory_;
  std::size_t capacity_ = 0;
};

/// `host` becomes what `view` is copied from and to: `view` itself where the host can reach it.
template <class View>
void grow(View& view, typename View::HostMirror& host, char const* name, std::size_t count) {
  if (view.extent(0) >= count) return;
  grow(view, name, count);
  host = Kokkos::create_mirror_view(view);
}

/// The first `count` entries of `from` to `to`, of two arrays that are contiguous.
template <class S, class From, class To>
void copy_front(From const& from, To const& to, std::size_t count) {
  static_assert(From::rank() == To::rank());
  if (count == 0 || static_cast<void const*>(from.data()) == static_cast<void const*>(to.data())) {
    return;
  }
  auto const range = Kokkos::make_pair(std::size_t(0), count);
  if constexpr (From::rank() == 1) {
    assign_on<S>(Kokkos::subview(to, range), Kokkos::subview(from, range));
  } else {
    assign_on<S>(Kokkos::subview(to, range, Kokkos::ALL),
                 Kokkos::subview(from, range, Kokkos::ALL));
  }
  S::instance().fence("taut: copy");
}

}  // namespace taut
