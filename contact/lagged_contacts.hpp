// Contacts as friction sees them: where two sides touched when they were last looked at, along
// which normal, and how hard. They stay as they are while a minimiser runs, so that friction is a
// function of the positions alone.
//
// A contact is a stencil of up to four vertices with coefficients c, of which
//
//   w = Sum_a c_a (x_a - x_a^t) - motion
//
// is the motion of one side against the other within the step, m. Between vertices of meshes the
// coefficients add up to zero and `motion` is nil; of a vertex against an obstacle that is no mesh
// there is one vertex, c = 1, and `motion` is what the obstacle's surface point moves in the step.
//
// Where contacts come from is open (FrictionSource, friction.hpp): whoever knows some writes a
// kernel
//
//   bool operator()(int i, LaggedContact<Real>& to) const
//
// that says whether its item i is a contact with friction, and which, and hands it to `append`.
// Contacts are kept in the order of sources and items. Memory grows and is kept.
#pragma once

#include <taut/contact/vertex_slots.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/sort.hpp>

#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace taut {

template <class T>
struct LaggedContact {
  int vertex[4] = {0, 0, 0, 0};  ///< any where the coefficient is zero
  T c[4] = {};                   ///< zero: the vertex takes no part
  Vec3<T> normal{};              ///< unit length, of either sign
  T limit = T(0);                ///< mu times the normal force: the most that friction exerts, N
  Vec3<T> motion{};              ///< of the other side within the step, m
};

namespace kernels {

/// Contact k by its parts.
template <class Precision, class S>
struct LaggedTable {
  using Real = typename Precision::real;
  Kokkos::View<int* [4], typename S::layout, typename S::memory> vertex;
  Kokkos::View<Real* [4], typename S::layout, typename S::memory> c;
  VectorField<Real, S> normal, motion;
  Array<Real, S> limit;

  KOKKOS_FUNCTION Vec3<Real> normal_of(int k) const {
    return {normal(k, 0), normal(k, 1), normal(k, 2)};
  }
  KOKKOS_FUNCTION void write(int k, LaggedContact<Real> const& from) const {
    for (int a = 0; a < 4; ++a) {
      vertex(k, a) = from.vertex[a];
      c(k, a) = from.c[a];
    }
    for (int i = 0; i < 3; ++i) {
      normal(k, i) = from.normal[i];
      motion(k, i) = from.motion[i];
    }
    limit(k) = from.limit;
  }
};

/// Whether item i is a contact, as 1 or 0.
template <class Precision, class S, class Kernel>
struct JudgeContact {
  Kernel kernel;
  Kokkos::View<int*, typename S::memory> found;
  KOKKOS_FUNCTION void operator()(int i) const {
    LaggedContact<typename Precision::real> contact;
    found(i) = kernel(i, contact) ? 1 : 0;
  }
};

/// Writes item i to place(i) after `first`, if it is a contact: then the next has another place.
template <class Precision, class S, class Kernel>
struct KeepContact {
  Kernel kernel;
  Kokkos::View<int const*, typename S::memory> place;
  LaggedTable<Precision, S> to;
  int first, items, found;
  KOKKOS_FUNCTION void operator()(int i) const {
    int const next = i + 1 < items ? place(i + 1) : found;
    if (next == place(i)) return;
    LaggedContact<typename Precision::real> contact;
    kernel(i, contact);
    to.write(first + place(i), contact);
  }
};

/// The vertex of each slot; `vertices` where there is none.
template <class Precision, class S>
struct VertexOfSlot {
  LaggedTable<Precision, S> contacts;
  int vertices;
  Kokkos::View<int*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const {
    for (int a = 0; a < 4; ++a) {
      to(4 * k + a) = contacts.c(k, a) != 0 ? contacts.vertex(k, a) : vertices;
    }
  }
};

template <class S>
struct TakesPart {
  Kokkos::View<int const*, typename S::memory> begin;
  KOKKOS_FUNCTION int operator()(int v) const { return begin(v + 1) > begin(v) ? 1 : 0; }
};
template <class S>
struct KeepVertex {
  TakesPart<S> takes_part;
  Kokkos::View<int const*, typename S::memory> place;
  Kokkos::View<int*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int v) const {
    if (takes_part(v)) to(place(v)) = v;
  }
};

}  // namespace kernels

template <class Precision, class S>
class LaggedContacts {
public:
  using Real = typename Precision::real;
  using Table = kernels::LaggedTable<Precision, S>;
  using Indices = Kokkos::View<int*, typename S::memory>;

  LaggedContacts() = default;
  /// Between up to `vertices` vertices.
  explicit LaggedContacts(int vertices)
      : vertices_(vertices),
        begin_("lagged_begin", std::size_t(vertices) + 2),
        place_of_vertex_("lagged_place", vertices),
        active_("lagged_active", vertices) {}

  int count() const { return count_; }
  Table const& table() const { return table_; }
  /// The vertices that take part, ascending, and their slots; of the last `finish`.
  typename SurfaceViews<S>::Indices active_vertices() const {
    return Indices(active_, Kokkos::make_pair(0, active_count_));
  }
  kernels::SlotsOfVertices<S> slots() const { return {begin_, slot_}; }

  void clear() { count_ = active_count_ = 0; }

  /// Adds the items of 0, ..., items - 1 that `kernel` says are contacts; it is called twice for
  /// these. Throws Error if there are more contacts than can be numbered.
  template <class Kernel>
  void append(char const* name, int items, Kernel const& kernel) {
    static_assert(std::is_invocable_r_v<bool, Kernel const&, int, LaggedContact<Real>&>,
                  "taut: a kernel of lagged contacts has bool operator()(int, LaggedContact&) "
                  "const (contact/lagged_contacts.hpp)");
    if (items == 0) return;
    if (place_.extent_int(0) < items) {
      place_ = {};
      place_ = Indices(unset("lagged_place"), std::size_t(items) + items / 2);
    }
    Indices const place(place_, Kokkos::make_pair(0, items));
    for_each<S>(name, items, kernels::JudgeContact<Precision, S, Kernel>{kernel, place});
    int const found = exclusive_scan<S, int>(name, place);
    reserve(std::int64_t(count_) + found);
    for_each<S>(
        name, items,
        kernels::KeepContact<Precision, S, Kernel>{kernel, place, table_, count_, items, found});
    count_ += found;
  }

  /// After the last `append`: which slots meet in which vertex.
  void finish() {
    active_count_ = 0;
    if (count_ == 0) return;
    if (slot_.extent_int(0) < 4 * count_) {
      std::size_t const n = 4 * table_.limit.extent(0);
      slot_ = {}, vertex_of_slot_ = {}, sort_ = {};
      slot_ = Indices(unset("lagged_slot"), n);
      vertex_of_slot_ = Indices(unset("lagged_slot_vertex"), n);
      sort_ = BucketSort<S>(static_cast<int>(n));
    }
    for_each<S>("lagged_slot_vertex", count_,
                kernels::VertexOfSlot<Precision, S>{table_, vertices_, vertex_of_slot_});
    sort_.sort(4 * count_, vertex_of_slot_, vertices_ + 1, begin_, slot_);
    kernels::TakesPart<S> const takes_part{begin_};
    active_count_ =
        exclusive_scan<S, int>("lagged_active", vertices_, takes_part, place_of_vertex_);
    for_each<S>("lagged_active", vertices_,
                kernels::KeepVertex<S>{takes_part, place_of_vertex_, active_});
  }

  /// Four vertices per contact, in memory that lasts until they are asked for again.
  std::span<int const> elements() {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), table_.vertex);
    elements_.resize(4 * std::size_t(count_));
    for (int k = 0; k < count_; ++k)
      for (int a = 0; a < 4; ++a) elements_[4 * std::size_t(k) + a] = host(k, a);
    return elements_;
  }

private:
  static auto unset(char const* name) {
    return Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string(name));
  }

  /// Keeps what is there. Half as much again as asked for, so that it is seldom moved.
  void reserve(std::int64_t count) {
    if (std::int64_t(table_.limit.extent(0)) >= count) return;
    if (count > std::numeric_limits<int>::max() / 8) {
      throw Error("friction: {} contacts are more than can be numbered: reduce dhat", count);
    }
    auto const n = static_cast<std::size_t>(count + count / 2);
    move(table_.vertex, "lagged_vertex", n);
    move(table_.c, "lagged_coefficient", n);
    move(table_.normal, "lagged_normal", n);
    move(table_.motion, "lagged_motion", n);
    move(table_.limit, "lagged_limit", n);
  }
  template <class View>
  void move(View& view, char const* name, std::size_t n) const {
    View const to(unset(name), n);
    auto const used = Kokkos::make_pair(0, count_);
    if (count_ == 0) {
    } else if constexpr (View::rank() == 1) {
      assign_on<S>(Kokkos::subview(to, used), Kokkos::subview(view, used));
    } else {
      assign_on<S>(Kokkos::subview(to, used, Kokkos::ALL),
                   Kokkos::subview(view, used, Kokkos::ALL));
    }
    view = to;
  }

  int vertices_ = 0, count_ = 0, active_count_ = 0;
  Table table_;
  Indices begin_, slot_, vertex_of_slot_, place_, place_of_vertex_, active_;
  BucketSort<S> sort_;
  std::vector<int> elements_;
};

}  // namespace taut
