// The terms of an incremental potential E(x) = 1/2 |x - x~|^2_M + h^2 (V_1(x) + V_2(x) + ...).
//
// A term is of one of two kinds:
//   - a *local* term is a function of one unknown at a time (inertia, body forces, springs to a
//   place).
//     It says what it is for one unknown; all local terms are evaluated together in one loop;
//   - a *swept* term couples unknowns (elements, contacts). It runs sweeps of its own.
// Each reports physical energies (J); the factor h^2 is handed in by the potential and applied
// once.
#pragma once

#include <taut/core/exec/space.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/potential/bodies.hpp>
#include <taut/core/potential/obstruction.hpp>
#include <taut/core/sparse/block_csr.hpp>

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace taut {

/// Which unknowns are fixed: not 0 at those. Terms leave their rows alone. What moves as one rigid
/// thing may have a mark of its own; unknowns of one mark never get in each other's way.
template <class S>
using FixedMask = Kokkos::View<std::uint8_t*, typename S::memory>;

/// A local term hands out a kernel for a given scale h^2. The kernel is copied to the device; for
/// unknown i at x it gives (in fp64: positions are differences of large numbers)
///   change(i, x, s)   E_i(x + s) - E_i(x), without cancellation
///   value(i, x)       E_i(x)
///   gradient(i, x)    3-vector
///   curvature(i, x)   symmetric 3x3, positive semi-definite
template <class Term>
concept LocalTerm = requires(Term const& term, double scale, Vec3<double> const& x) {
  typename Term::Space;
  typename Term::Precision;
  { term.kernel(scale).value(0, x) } -> std::convertible_to<double>;
  { term.kernel(scale).change(0, x, x) } -> std::convertible_to<double>;
  { term.kernel(scale).gradient(0, x) } -> std::same_as<Vec3<double>>;
  { term.kernel(scale).curvature(0, x) } -> std::same_as<Sym3<double>>;
};

/// A swept term adds itself, times `scale` = h^2, to fields of the whole potential.
template <class Term>
concept SweptTerm = requires(
    Term const& term, VectorField<typename Term::Precision::position, typename Term::Space> x,
    VectorField<typename Term::Precision::real, typename Term::Space> p,
    BlockField<typename Term::Precision::real, typename Term::Space> blocks,
    BlockCsr<typename Term::Space, double> matrix, FixedMask<typename Term::Space> fixed,
    double alpha, double scale, double at_most, std::vector<Connectivity>& kinds) {
  { term.value(x, scale) } -> std::convertible_to<double>;
  /// E(x + alpha p) - E(x)
  { term.change(x, p, alpha, scale) } -> std::convertible_to<double>;
  {term.add_gradient(x, scale, fixed, p)};
  {term.add_gradient(x, scale, fixed, p, p)};
  {term.add_gradient(x, scale, fixed, p, blocks)};
  /// The same after a step of alpha p that led to x; returns E(x) - E(x - alpha p).
  { term.add_gradient_after(x, p, alpha, scale, fixed, p) } -> std::convertible_to<double>;
  { term.add_gradient_after(x, p, alpha, scale, fixed, p, p) } -> std::convertible_to<double>;
  { term.add_gradient_after(x, p, alpha, scale, fixed, p, blocks) } -> std::convertible_to<double>;
  { term.quadratic_form(x, p, scale) } -> std::convertible_to<double>;
  {term.add_product(x, p, scale, fixed, p)};
  {term.add_to(matrix, x, scale, fixed)};
  /// How far one may go along p, up to `at_most`, which may be infinity: all of the way is valid,
  /// and the term keeps what margin it needs.
  { term.max_step(x, p, at_most) } -> std::convertible_to<double>;
  /// The same as seen by prescribed motion, which may never fold the mesh (whatever the material).
  { term.max_prescribed_step(x, p, at_most) } -> std::convertible_to<double>;
  /// For the sparsity pattern: appends the term's elements, one entry for each number of unknowns
  /// that they couple. The entries refer to memory of the term.
  {term.elements(kinds)};
};

// What a swept term may have besides. Copies of a term that has state share it.

/// What a step begins with.
template <class Precision, class S>
struct StepStart {
  VectorField<typename Precision::position, S> x;  ///< where it starts, m
  /// s: h for implicit Euler, h sqrt(c) for a rule whose energies have the factor c h^2 (BDF2 with
  /// steps alike: 2/3 h).
  double time_step = 0;
  /// What resists a motion of each unknown, N/m: a third of the trace of its block in the Hessian
  /// of all terms that are not told (with inertia, m / h^2 and what is elastic), at x.
  Array<typename Precision::real, S> stiffness;
  /// The gradient, at x, of all terms that are not told, times `scale`: of the energy in J as
  /// gradients of a potential are of theirs. Zero where fixed. Lasts while the step begins.
  VectorField<typename Precision::real, S> gradient = {};
  double scale = 0;      ///< the square of time_step, or 1 where there is no inertia
  double mean_mass = 0;  ///< of an unknown that is free, kg
  bool has_inertia = true;
  double free_mass = 0;  ///< of all that is free, kg
};

/// A term that is told when a step begins. It may then become another function of x, and must not
/// within the step, unless `advance` says so, or `relag` as of any term (below).
template <class Term>
concept SteppedTerm = SweptTerm<Term> &&
    requires(Term const& term, StepStart<typename Term::Precision, typename Term::Space> start) {
  {term.begin_step(start)};
};

/// A term whose elements change with x. The version grows with each change; asking for it brings
/// the elements up to x.
template <class Term>
concept ChangingTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x) {
  { term.pattern_version(x) } -> std::convertible_to<std::int64_t>;
};

/// A term in which something moves by itself (an obstacle), to where it is to be at the end of the
/// step, in portions, as prescribed unknowns do.
template <class Term>
concept MovingTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x,
             VectorField<typename Term::Precision::real, typename Term::Space> p, double at_most) {
  /// How far it has still to go, m; 0 once it has arrived.
  { term.motion_left(x) } -> std::convertible_to<double>;
  /// The largest valid fraction, up to `at_most`, of what it has still to go while unknowns move by
  /// the same fraction of p. Its max_prescribed_step is that as well.
  { term.max_advance(x, p, at_most) } -> std::convertible_to<double>;
  /// Goes by this fraction; by 1 it arrives.
  {term.advance(at_most)};
};

/// A term of which something was taken where the step began and stays so (the normal forces of
/// friction, the pressure by which sand yields). `relag` takes it at x instead; false if that
/// changes nothing.
template <class Term>
concept LaggedTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x) {
  { term.relag(x) } -> std::convertible_to<bool>;
};

/// A term that can say what its last max_step or max_prescribed_step was cut by.
template <class Term>
concept ObstructedTerm = SweptTerm<Term> && requires(Term const& term) {
  { term.obstruction() } -> std::same_as<std::optional<Obstruction>>;
};

/// A swept term that finds on the way to p'Hp how far a step along p is certainly valid.
///
/// `certified` belongs to the x and p of the call that said it: whoever hands it on vouches that
/// neither has changed. Terms keep nothing of it.
template <class Term>
concept CertifyingTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x,
             VectorField<typename Term::Precision::real, typename Term::Space> p, double scale,
             double at_most, double& certified) {
  /// p'Hp; lowers `certified` to a length up to which x + t p is valid, for t of either sign.
  { term.quadratic_form(x, p, scale, certified) } -> std::convertible_to<double>;
  /// max_step at the x and p for which quadratic_form has said `certified`.
  { term.max_step(x, p, at_most, certified) } -> std::convertible_to<double>;
};

/// A term that can say what force, N, a deformation of the size of an element meets at each
/// unknown: what residuals are measured by (Zhu et al. 2018; Wang et al. 2020, section 6). A mean
/// over mass: adds force times mass, N kg, and the mass, kg.
template <class Term>
concept CharacteristicTerm = SweptTerm<Term> &&
    requires(Term const& term, Array<double, typename Term::Space> const& force,
             Array<double, typename Term::Space> const& mass) {
  {term.add_characteristic_force(force, mass)};
};

/// A swept term that does not couple unknowns either: its Hessian is what `add_gradient` adds to
/// blocks.
template <class Term>
concept UncoupledTerm = SweptTerm<Term> && !Term::couples;

/// Marks of unknowns that a minimiser has left where they are for now (not 0), or nothing.
template <class S>
using IdleMask = Kokkos::View<std::uint8_t*, typename S::memory>;

/// A term that can say where p'Hp comes from: adds it, times `scale`, in shares to unknowns. The
/// share of an element is at an unknown of a body whose free unknowns it couples, so that the sum
/// over an island is p'Hp of p restricted to it.
template <class Term>
concept DivisibleTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x,
             VectorField<typename Term::Precision::real, typename Term::Space> p, double scale,
             FixedMask<typename Term::Space> fixed, Array<double, typename Term::Space> shares) {
  {term.add_form_shares(x, p, scale, fixed, shares)};
};

/// A term whose elements do not last. It says instead which bodies they may join until
/// `pattern_version` grows, by giving them the smaller of their labels (kernels::join_labels); true
/// if that changed a label.
template <class Term>
concept LinkingTerm = ChangingTerm<Term> &&
    requires(Term const& term, FixedMask<typename Term::Space> fixed,
             typename Bodies<typename Term::Space>::Indices body) {
  { term.link(fixed, body, body) } -> std::convertible_to<bool>;
};

/// A term whose sweeps leave out what is idle altogether: no energy, no gradient (what stands there
/// is not touched). All elements that it shares with others are idle at all their unknowns or none.
template <class Term>
concept IdlingTerm = SweptTerm<Term> &&
    requires(Term const& term, IdleMask<typename Term::Space> idle) {
  {term.set_idle(idle)};
};

/// A term that does not act everywhere and always, and says where it does: gives 1 to the marks of
/// the free unknowns on which it acts at x, and leaves the others as they are.
template <class Term>
concept MarkingTerm = SweptTerm<Term> &&
    requires(Term const& term,
             VectorField<typename Term::Precision::position, typename Term::Space> x,
             FixedMask<typename Term::Space> fixed, Array<int, typename Term::Space> marks) {
  {term.mark_acting(x, fixed, marks)};
};

/// Whether minimisers may go by bodies and islands where this term is.
template <SweptTerm Term>
bool divides(Term const& term) {
  if constexpr (requires {
                  { term.divisible() } -> std::convertible_to<bool>;
                }) {
    return term.divisible();
  } else {
    return DivisibleTerm<Term> && (LinkingTerm<Term> || !ChangingTerm<Term>);
  }
}
/// The elements of a term that last.
template <SweptTerm Term>
void lasting_elements(Term const& term, std::vector<Connectivity>& kinds) {
  if constexpr (requires { term.lasting_elements(kinds); }) {
    term.lasting_elements(kinds);
  } else if constexpr (!ChangingTerm<Term>) {
    term.elements(kinds);
  }
}

/// The same of any swept term: one that does not certify leaves `certified` alone, and looks for
/// its largest step in any case.
template <SweptTerm Term, class Positions, class Vectors>
double quadratic_form(Term const& term, Positions const& x, Vectors const& p, double scale,
                      double& certified) {
  if constexpr (CertifyingTerm<Term>) {
    return term.quadratic_form(x, p, scale, certified);
  } else {
    return term.quadratic_form(x, p, scale);
  }
}
template <SweptTerm Term, class Positions, class Vectors>
double max_step(Term const& term, Positions const& x, Vectors const& p, double at_most,
                double certified) {
  if constexpr (CertifyingTerm<Term>) {
    return term.max_step(x, p, at_most, certified);
  } else {
    return term.max_step(x, p, at_most);
  }
}

}  // namespace taut
