// What a minimiser sees: a function of one 3-vector per unknown, its derivatives, and how far a
// step may go. Mesh vertices and grid nodes look the same from here; no minimiser knows more than
// this.
//
// The function is the incremental potential E(x) = 1/2 |x - x~|^2_M + h^2 (elastic + ...), in kg
// m^2 (see docs/design.md, section 4).
#pragma once

#include <taut/core/exec/space.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/sparse/block_csr.hpp>

#include <concepts>
#include <cstdint>

namespace taut {

/// The quantities of the problem in which stopping rules measure (SI units).
struct Scale {
  double mass = 1;          ///< total mass of the free unknowns, kg
  double length = 1;        ///< a length of the scene (mean rest edge length), m
  double time_step = 1;     ///< h, s: turns an error of position into one of velocity
  bool has_inertia = true;  ///< false in a quasi-static solve: H >= M does not hold then
};

/// Fields with one entry per unknown. Unknowns that are fixed (pinned) have zero gradient, zero
/// rows and columns in products, and the identity times their mass in `assemble` and in curvature
/// fields. All "curvature" is the filtered one (positive semi-definite per element, by the filter
/// policy of each term); `value`, `difference` and `gradient` are exact.
template <class E>
concept Objective =
    requires(E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
             VectorField<typename E::Precision::real, typename E::Space> const& p,
             BlockField<typename E::Precision::real, typename E::Space> const& blocks,
             BlockCsr<typename E::Space, double>& matrix, double alpha, double at_most) {
  typename E::Space;
  typename E::Precision;
  { e.size() } -> std::convertible_to<int>;
  { e.scale() } -> std::convertible_to<Scale>;
  /// Lumped mass per unknown, kg; the metric of the stopping rules.
  { e.mass() } -> std::convertible_to<Array<typename E::Precision::real, typename E::Space>>;

  /// E(x), summed in Precision::sum.
  { e.value(x) } -> std::convertible_to<double>;
  /// E(x + alpha p) - E(x), from differences per element: no cancellation of large sums.
  { e.difference(x, p, alpha) } -> std::convertible_to<double>;
  /// Gradient at x into the second argument; optionally with the diagonal (3 numbers per unknown)
  /// or the diagonal 3x3 blocks (6 numbers per unknown) of the curvature.
  {e.gradient(x, p)};
  {e.gradient(x, p, p)};
  {e.gradient(x, p, blocks)};
  /// The same at x, after a step of alpha p that led to x; returns E(x) - E(x - alpha p) from the
  /// same sweep, which is what a sufficient-decrease check needs.
  { e.gradient_after(x, p, alpha, p) } -> std::convertible_to<double>;
  { e.gradient_after(x, p, alpha, p, p) } -> std::convertible_to<double>;
  { e.gradient_after(x, p, alpha, p, blocks) } -> std::convertible_to<double>;
  /// p' H(x) p >= 0.
  { e.quadratic_form(x, p) } -> std::convertible_to<double>;
  /// hp = H(x) p, with the curvature projected exactly.
  {e.product(x, p, p)};
  /// H(x), with the curvature projected exactly, into a matrix made by `pattern(x)`, be it long ago
  /// and at another x, as long as `pattern_version(x)` is what it was then.
  { e.pattern(x) } -> std::same_as<BlockCsr<typename E::Space, double>>;
  { e.pattern_version(x) } -> std::convertible_to<std::int64_t>;
  {e.assemble(x, matrix)};
  /// A step length in (0, at_most] that may be gone in full: x + a p is valid for all a up to it,
  /// and every term has kept the margin that it needs to go on from there (half of the way to J = 0
  /// where that is forbidden, half of a gap). at_most itself, if that is such a length. Proving a
  /// step as long as one wants valid is much cheaper than finding the longest one (at_most =
  /// infinity).
  { e.max_step(x, p, at_most) } -> std::convertible_to<double>;
  /// Moves fixed unknowns on towards where they are prescribed to be, as far as is valid; true if x
  /// changed, after which gradient and energy must be evaluated anew. False once all have arrived.
  { e.advance_prescribed(x) } -> std::convertible_to<bool>;
};

/// An Objective that finds on the way to p'Hp how far a step along p is certainly valid, which
/// saves a sweep of its own in most iterations.
///
/// `certified` belongs to the x and p of the call that said it: whoever hands it on vouches that
/// neither has changed (a Line does, until it moves x).
template <class E>
concept CertifyingObjective = Objective<E> &&
    requires(E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
             VectorField<typename E::Precision::real, typename E::Space> const& p, double at_most,
             double& certified) {
  /// p'Hp, and a length up to which the terms that can tell are valid at x + t p, for t of either
  /// sign; infinity if there are none.
  { e.quadratic_form(x, p, certified) } -> std::convertible_to<double>;
  /// max_step at the x and p for which quadratic_form has said `certified`, which spares the terms
  /// that can tell a search where it is enough.
  { e.max_step(x, p, at_most, certified) } -> std::convertible_to<double>;
};

/// An Objective that says where something acts on it that does not act always, such as contact.
template <class E>
concept RegionalObjective = Objective<E> &&
    requires(E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
             Array<int, typename E::Space> const& marks) {
  /// 1 for unknowns on which it acts at x, 0 for the others.
  {e.mark_acting(x, marks)};
};

/// An Objective that knows of bodies and islands (bodies.hpp), and can leave some out.
template <class E>
concept DivisibleObjective = Objective<E> &&
    requires(E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
             VectorField<typename E::Precision::real, typename E::Space> const& p,
             Array<double, typename E::Space> const& shares,
             IdleMask<typename E::Space> const& idle,
             typename Bodies<typename E::Space>::Indices const& label) {
  /// False if a term does not tell.
  { e.divisible() } -> std::convertible_to<bool>;
  { e.bodies() } -> std::convertible_to<Bodies<typename E::Space>>;
  { e.fixed() } -> std::convertible_to<FixedMask<typename E::Space>>;
  /// Gives bodies that may act on each other until `pattern_version` changes a common label.
  {e.link(label)};
  /// Makes `shares` of p'Hp per unknown, which sum up to that of p restricted to each island.
  {e.form_shares(x, p, shares)};
  /// From now on no term looks at elements of what is idle; what is handed out for these unknowns
  /// means nothing.
  {e.set_idle(idle)};
  /// Per body: not 0 while it is to stay where it is unless something comes to act on it; empty:
  /// none.
  { e.asleep() } -> std::convertible_to<std::vector<char>>;
  {e.set_asleep(std::vector<char>())};
  /// What the last max_step was cut by, if that is known.
  { e.obstruction() } -> std::same_as<std::optional<Obstruction>>;
};

}  // namespace taut
