// The pairs of a contact term with all that is known of them while they are candidates: stiffness,
// activation distance, mollifier scale, and which of the four vertices of which pairs meet in a
// vertex. Made anew when a search has found others; until then sweeps only read. Memory grows and
// is kept.
#pragma once

#include <taut/contact/contact_kernels.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/sort.hpp>

#include <cmath>
#include <span>

namespace taut {

/// The area that each vertex stands for, a third of the triangles around it; m^2.
inline std::vector<double> vertex_areas(Surface const& surface, std::span<Point const> points) {
  std::vector<double> area(points.size());
  for (Triangle const& t : surface.triangles) {
    Point const &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
    Vec3<double> const u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    Vec3<double> const v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    for (int corner : t) area[corner] += norm(cross(u, v)) / 6;
  }
  return area;
}

/// Points as a field, m.
template <class S>
VectorField<double, S> copy_points(char const* name, std::vector<Point> const& points) {
  VectorField<double, S> const to(name, points.size());
  auto const host = Kokkos::create_mirror_view(to);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int c = 0; c < 3; ++c) host(i, c) = points[i][c];
  assign(to, host);
  return to;
}

template <class Pair, class Rule, class Precision, class S>
class ContactPairs {
public:
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, S>;
  using Vectors = VectorField<Real, S>;
  using Slots = kernels::ContactSlots<Precision, S>;

  ContactPairs() = default;
  /// `area`: m^2, per vertex of the mesh. Throws Error for a rule without a stiffness, or a surface
  /// vertex without an area.
  ContactPairs(SurfaceViews<S> const& surface, Activation<S> const& activation, Rule const& rule,
               double mollifier_threshold, std::vector<double> const& area,
               FixedMask<S> const& fixed)
      : surface_(surface),
        activation_(activation),
        rule_(rule),
        mollifier_threshold_(mollifier_threshold),
        begin_("contact_begin", area.size() + 1) {
    if (!rule.valid()) {
      throw Error("contact: the stiffness rule '{}' needs a positive stiffness (stiffness.hpp)",
                  Rule::name);
    }
    if (!(mollifier_threshold > 0)) {
      throw Error("contact: a mollifier threshold of {}: give the square of a sine, about 0.01",
                  mollifier_threshold);
    }
    fields_ = {Array<Real, S>("contact_area", area.size()), {}, fixed, activation.dhat};
    auto const host = Kokkos::create_mirror_view(fields_.area);
    for (std::size_t i = 0; i < area.size(); ++i) host(i) = static_cast<Real>(area[i]);
    assign(fields_.area, host);
  }

  kernels::PairTable<Precision, S> const& pairs() const { return pairs_; }

  /// Leaves out pairs of idle vertices; nothing if the mask is empty.
  void set_idle(IdleMask<S> const& idle) {
    pairs_.resting = idle;
    filled_ = false;
  }
  /// Adds p'Hp of each pair to one of its vertices (contact_islands.hpp).
  template <class Shares>
  void add_form_shares(Positions const& x, Vectors const& p, double scale,
                       FixedMask<S> const& fixed, Array<double, S> const& shares) const {
    for_each<S>(
        "contact_shares", surface_.vertices(),
        Shares{surface_.vertex, {begin_, slot_}, {pairs_, x, p, known(x)}, fixed, scale, shares});
  }

  void set_vertex_stiffness(Array<Real, S> const& stiffness) {
    if (stiffness.extent(0) != fields_.area.extent(0)) {
      throw Error("contact: a stiffness for {} vertices, but there are {}", stiffness.extent(0),
                  fields_.area.extent(0));
    }
    if (fields_.stiffness.extent(0) == 0) {
      fields_.stiffness = Array<Real, S>("contact_vertex_stiffness", stiffness.extent(0));
    }
    assign_on<S>(fields_.stiffness, stiffness);
    taken_ = 0;
  }

  /// Changes the rule; the K of pairs that are known are found anew.
  template <class Change>
  void change_rule(Change const& change) {
    change(rule_);
    taken_ = 0;
  }
  Rule const& rule() const { return rule_; }

  /// Takes over what a cache found, unless it has already, and how far that has moved since.
  template <class Cache>
  void take(Cache const& cache) {
    pairs_.moved = cache.moved();
    std::int64_t const search = cache.counters().searches;
    if (taken_ == search) return;
    Candidates<S> const& candidates = cache.candidates();
    if (Rule::per_vertex && fields_.stiffness.extent(0) == 0) {
      throw Error(
          "contact: the stiffness rule '{}' needs to be told when a step begins: call begin_step "
          "first, of the potential or of the term",
          Rule::name);
    }
    taken_ = 0;  // should it throw
    filled_ = false;
    std::int64_t const count =
        std::int64_t(candidates.point_triangle.count()) + candidates.edge_edge.count();
    if (count > std::numeric_limits<int>::max() / 8) {
      throw Error(
          "contact: {} pairs are candidates: reduce dhat or look for a vertex that has "
          "flown off",
          count);
    }
    resize(static_cast<int>(count), candidates.point_triangle.count());
    take_kind(0, candidates.point_triangle);
    take_kind(pairs_.point_triangles, candidates.edge_edge);
    sort_.sort(4 * pairs_.count, vertex_of_slot_, static_cast<int>(fields_.area.extent(0)), begin_,
               slot_);
    taken_ = search;
  }

  /// Over all pairs, or over n packs of them.
  template <class Kernel>
  double sum(char const* name, Kernel const& kernel) const {
    return sum(name, pairs_.count, kernel);
  }
  template <class Kernel>
  double sum(char const* name, int n, Kernel const& kernel) const {
    return reducer_.template sum<1>(name, n, kernel)[0];
  }

  /// For gradients with `numbers` of curvature per vertex. What was in them is lost.
  Slots slots(int numbers) {
    filled_ = false;
    if (numbers > 0 && slots_.curvature.extent(0) < slots_.vector.extent(0)) {
      slots_.curvature = {};
      slots_.curvature = BlockField<Real, S>(unset("contact_curvature"), slots_.vector.extent(0));
    }
    return slots_;
  }
  /// Says that the slots hold the gradient at x.
  void filled_at(Positions const& x) {
    if (at_.extent(0) != x.extent(0)) at_ = Positions("contact_at", x.extent(0));
    assign_on<S>(at_, x);
    filled_ = true;
  }
  /// The slots, if they hold the gradient at x; else none.
  Slots known(Positions const& x) const {
    int const n = surface_.vertices();
    using Find = kernels::FindOtherPlace<Precision, S>;
    bool const same =
        filled_ && minimum<S>("contact_same", n, n, Find{surface_.vertex, x, at_}) == n;
    return same ? slots_ : Slots();
  }
  /// Adds up the slots of each vertex.
  template <int numbers, class CurvatureField>
  void gather(Slots const& slots, double scale, FixedMask<S> const& fixed, Vectors const& g,
              CurvatureField const& curvature) const {
    using Gather = kernels::GatherSlots<Precision, S, Slots, CurvatureField, numbers>;
    for_each<S>("contact_gather", surface_.vertices(),
                Gather{surface_.vertex, {begin_, slot_}, slots, fixed, scale, g, curvature});
  }

  void check_pattern(BlockCsr<S, double> const& matrix, Positions const& x,
                     FixedMask<S> const& fixed) const {
    int const missing =
        minimum<S>("contact_pattern", pairs_.count, pairs_.count,
                   kernels::FindMissingBlock<Precision, S>{{pairs_, x}, fixed, matrix});
    if (missing >= pairs_.count) return;
    auto const v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), pairs_.vertex);
    throw Error(
        "contact: the matrix has no block for the pair of vertices {}, {}, {}, {}: they were no "
        "candidates when its pattern was made; make the pattern anew",
        v(missing, 0), v(missing, 1), v(missing, 2), v(missing, 3));
  }
  void assemble(BlockCsr<S, double> const& matrix, Positions const& x, double scale,
                FixedMask<S> const& fixed) const {
    using Assemble = kernels::AssembleRows<Pair, Precision, S>;
    for_each<S>("contact_assemble", surface_.vertices(),
                Assemble{surface_.vertex, {begin_, slot_}, pairs_, x, fixed, matrix, scale});
  }
  /// Four vertices per pair.
  std::span<int const> elements() {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), pairs_.vertex);
    elements_.resize(4 * std::size_t(pairs_.count));
    for (int k = 0; k < pairs_.count; ++k)
      for (int a = 0; a < 4; ++a) elements_[4 * std::size_t(k) + a] = host(k, a);
    return elements_;
  }

  int contacts(Positions const& x) const {
    return static_cast<int>(
        sum("contact_count", kernels::CountContacts<Precision, S>{{pairs_, x}}));
  }
  double smallest_gap(Positions const& x) const {
    return minimum<S>("contact_gap", pairs_.count, 1.0,
                      kernels::LeastGap<Precision, S>{{pairs_, x}});
  }

private:
  static auto unset(char const* name) {
    return Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string(name));
  }
  void resize(int count, int point_triangles) {
    pairs_.count = count;
    pairs_.point_triangles = point_triangles;
    if (pairs_.vertex.extent_int(0) >= count) return;
    std::size_t const n = std::size_t(count) + count / 2;
    pairs_.vertex = {}, pairs_.stiffness = {}, pairs_.activation = {}, pairs_.mollifier = {};
    pairs_.clearance = {};
    slots_ = {}, slot_ = {}, vertex_of_slot_ = {}, sort_ = {};  // the old memory first
    pairs_.vertex = PairIds<S>(unset("contact_pairs"), n);
    pairs_.stiffness = Array<Real, S>(unset("contact_stiffness"), n);
    pairs_.activation = Array<Real, S>(unset("contact_activation"), n);
    pairs_.mollifier = Array<Real, S>(unset("contact_mollifier"), n);
    pairs_.clearance = Array<float, S>(unset("contact_clearance"), n);
    slots_.acts = Flags(unset("contact_acts"), n);
    slots_.over_gradient = Array<Real, S>(unset("contact_over_gradient"), n);
    slots_.vector = Vectors(unset("contact_slots"), 4 * n);
    slot_ = Indices(unset("contact_slot"), 4 * n);
    vertex_of_slot_ = Indices(unset("contact_slot_vertex"), 4 * n);
    sort_ = BucketSort<S>(static_cast<int>(4 * n));
    reducer_ = Reducer<S, double>(static_cast<int>(n), 1);
  }
  template <PairKind kind>
  void take_kind(int first, CandidateList<kind, S> const& list) const {
    using Take = kernels::TakeCandidates<Pair, Rule, Precision, S>;
    for_each<S>("contact_take", list.count(),
                Take{kind, first, list.ids(), list.distance(), list.activation(), activation_.rest,
                     rule_, fields_, mollifier_threshold_, pairs_, vertex_of_slot_});
  }

  using Indices = Kokkos::View<int*, typename S::memory>;
  using Flags = Kokkos::View<std::uint8_t*, typename S::memory>;

  SurfaceViews<S> surface_;
  Activation<S> activation_;
  Rule rule_;
  StiffnessFields<Precision, S> fields_;
  double mollifier_threshold_ = 0;
  kernels::PairTable<Precision, S> pairs_;
  Slots slots_;
  Indices begin_, slot_, vertex_of_slot_;
  BucketSort<S> sort_;
  Reducer<S, double> reducer_;
  std::vector<int> elements_;
  std::int64_t taken_ = 0;  ///< the search; 0: none
  bool filled_ = false;     ///< the slots hold the gradient at at_
  Positions at_;
};

}  // namespace taut
