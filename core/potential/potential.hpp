// The incremental potential: a sum of terms over common unknowns, as one Objective for any
// minimiser.
//
//   using Scene = Potential<Inertia<>, BodyForce<>, ElasticTets<Elastic<StableNeoHookean>>>;
//
// A term that is not named does not exist in any loop. h^2 is applied here and nowhere else.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/local_terms.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/sparse/pattern.hpp>

#include <limits>
#include <tuple>

namespace taut {

namespace kernels {

/// The kernels of all local terms, one after the other.
template <class... Ks>
struct LocalKernels;

template <>
struct LocalKernels<> {
  KOKKOS_FUNCTION double value(int, Vec3<double> const&) const { return 0; }
  KOKKOS_FUNCTION double change(int, Vec3<double> const&, Vec3<double> const&) const { return 0; }
  KOKKOS_FUNCTION Vec3<double> gradient(int, Vec3<double> const&) const { return {}; }
  KOKKOS_FUNCTION Sym3<double> curvature(int, Vec3<double> const&) const { return {}; }
};

template <class K, class... Ks>
struct LocalKernels<K, Ks...> {
  K head;
  LocalKernels<Ks...> tail;

  KOKKOS_FUNCTION double value(int i, Vec3<double> const& x) const {
    return head.value(i, x) + tail.value(i, x);
  }
  KOKKOS_FUNCTION double change(int i, Vec3<double> const& x, Vec3<double> const& s) const {
    return head.change(i, x, s) + tail.change(i, x, s);
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int i, Vec3<double> const& x) const {
    return head.gradient(i, x) + tail.gradient(i, x);
  }
  KOKKOS_FUNCTION Sym3<double> curvature(int i, Vec3<double> const& x) const {
    Sym3<double> a = head.curvature(i, x), b = tail.curvature(i, x);
    for (int k = 0; k < 6; ++k) a.s[k] += b.s[k];
    return a;
  }
};

inline LocalKernels<> chain() { return {}; }
template <class K, class... Ks>
LocalKernels<K, Ks...> chain(K const& head, Ks const&... tail) {
  return {head, chain(tail...)};
}

template <class Field>
KOKKOS_FORCEINLINE_FUNCTION Vec3<double> row(Field const& f, int i) {
  return {double(f(i, 0)), double(f(i, 1)), double(f(i, 2))};
}

/// Writes gradient and curvature of the local terms; swept terms are added to them.
template <class S, class Precision, class Kernel, int curvature_numbers, class CurvatureField>
struct LocalGradient {
  using Real = typename Precision::real;
  Kernel kernel;
  FixedMask<S> fixed;
  Array<Real, S> mass;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> g;
  CurvatureField curvature;

  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<double> const xi = row(x, i);
    Vec3<double> const gi = fixed(i) ? Vec3<double>{} : kernel.gradient(i, xi);
    for (int c = 0; c < 3; ++c) g(i, c) = static_cast<Real>(gi[c]);
    if constexpr (curvature_numbers > 0) {
      double const m = double(mass(i));
      Sym3<double> const h = fixed(i) ? Sym3<double>{{m, m, m, 0, 0, 0}} : kernel.curvature(i, xi);
      for (int c = 0; c < curvature_numbers; ++c) curvature(i, c) = static_cast<Real>(h.s[c]);
    }
  }
};

template <class S, class Precision, class Kernel>
struct LocalValue {
  Kernel kernel;
  VectorField<typename Precision::position, S> x;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename Precision::sum, 1>& sum) const {
    sum[0] += static_cast<typename Precision::sum>(kernel.value(i, row(x, i)));
  }
};

/// E(x + alpha p) - E(x), or E(x) - E(x - alpha p) if `arrived`.
template <class S, class Precision, class Kernel>
struct LocalChange {
  Kernel kernel;
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  double alpha;
  bool arrived;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename Precision::sum, 1>& sum) const {
    if (fixed(i)) return;
    Vec3<double> const s = alpha * row(p, i);
    Vec3<double> const from = arrived ? row(x, i) - s : row(x, i);
    sum[0] += static_cast<typename Precision::sum>(kernel.change(i, from, s));
  }
};

/// The gradient where a step ends, and the change of energy that led there: one pass over what both
/// read.
template <class Gradient, class Change>
struct LocalArrival {
  Gradient gradient;
  Change change;
  template <class Sum>
  KOKKOS_FUNCTION void operator()(int i, Sum& sum) const {
    gradient(i);
    change(i, sum);
  }
};

template <class S, class Precision, class Kernel>
struct LocalForm {
  Kernel kernel;
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename Precision::sum, 1>& sum) const {
    if (fixed(i)) return;
    sum[0] +=
        static_cast<typename Precision::sum>(quadratic(kernel.curvature(i, row(x, i)), row(p, i)));
  }
};

template <class S, class Precision, class Kernel>
struct LocalProduct {
  Kernel kernel;
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p, hp;
  KOKKOS_FUNCTION void operator()(int i) const {
    Vec3<double> const y = fixed(i) ? Vec3<double>{} : kernel.curvature(i, row(x, i)) * row(p, i);
    for (int c = 0; c < 3; ++c) hp(i, c) = static_cast<typename Precision::real>(y[c]);
  }
};

/// What each unknown has of p'Hp of the local terms.
template <class S, class Precision, class Kernel>
struct LocalShares {
  LocalForm<S, Precision, Kernel> form;
  Array<double, S> shares;
  KOKKOS_FUNCTION void operator()(int i) const {
    Sums<typename Precision::sum, 1> sum;
    form(i, sum);
    shares(i) = double(sum[0]);
  }
};

/// Sets the diagonal blocks to the local curvature (to the mass where fixed), all others to zero.
template <class S, class Precision, class Kernel>
struct LocalAssemble {
  Kernel kernel;
  FixedMask<S> fixed;
  Array<typename Precision::real, S> mass;
  VectorField<typename Precision::position, S> x;
  BlockCsr<S, double> matrix;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int k = matrix.row_begin(i); k < matrix.row_begin(i + 1); ++k) {
      matrix.block(k) = 0.0 * identity3<double>();
    }
    double const m = double(mass(i));
    Sym3<double> const h =
        fixed(i) ? Sym3<double>{{m, m, m, 0, 0, 0}} : kernel.curvature(i, row(x, i));
    matrix.add(i, i, to_matrix(h));
  }
};

/// p = prescribed - x at fixed unknowns, zero elsewhere; raises the largest component.
template <class S, class Precision>
struct PrescribedDirection {
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x, prescribed;
  VectorField<typename Precision::real, S> p;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    for (int c = 0; c < 3; ++c) {
      double const d = fixed(i) ? double(prescribed(i, c)) - double(x(i, c)) : 0;
      p(i, c) = static_cast<typename Precision::real>(d);
      largest = Kokkos::max(largest, Kokkos::abs(d));
    }
  }
};

/// Goes along the p that the bound was of.
template <class S, class Precision>
struct MovePrescribed {
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x, prescribed;
  VectorField<typename Precision::real, S> p;
  double fraction;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!fixed(i)) return;
    for (int c = 0; c < 3; ++c) {
      // The last step lands exactly.
      x(i, c) = fraction >= 1 ? prescribed(i, c)
                              : static_cast<typename Precision::position>(
                                    double(x(i, c)) + fraction * double(p(i, c)));
    }
  }
};

/// Moves free unknowns to the minimum of the local terms, where these have one.
template <class S, class Precision, class Kernel>
struct Predict {
  Kernel kernel;
  FixedMask<S> fixed;
  VectorField<typename Precision::position, S> x;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (fixed(i)) return;
    Vec3<double> const xi = row(x, i);
    Mat3<double> const h = to_matrix(kernel.curvature(i, xi));
    double const det = determinant(h);
    if (!(det > 0)) return;
    Vec3<double> const step = (1 / det) * (cofactor(h) * kernel.gradient(i, xi));
    for (int c = 0; c < 3; ++c) {
      x(i, c) = static_cast<typename Precision::position>(xi[c] - step[c]);
    }
  }
};

/// A third of the trace of the curvature of each unknown, times `factor`.
template <class S, class Precision>
struct MeanCurvature {
  using Real = typename Precision::real;
  VectorField<Real, S> diagonal;
  double factor;
  Array<Real, S> mean;
  KOKKOS_FUNCTION void operator()(int i) const {
    double const trace = double(diagonal(i, 0)) + double(diagonal(i, 1)) + double(diagonal(i, 2));
    mean(i) = static_cast<Real>(factor * trace / 3);
  }
};

/// Mass and number of what is free.
template <class S, class Precision>
struct FreeMass {
  FixedMask<S> fixed;
  Array<typename Precision::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sum) const {
    if (fixed(i)) return;
    sum[0] += double(mass(i));
    sum[1] += 1;
  }
};

template <class S>
struct DivideByMass {
  Array<double, S> force, mass;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (mass(i) > 0) force(i) /= mass(i);
  }
};

}  // namespace kernels

template <class... Terms>
class Potential {
  using First = std::tuple_element_t<0, std::tuple<Terms...>>;

public:
  using Space = typename First::Space;
  using Precision = typename First::Precision;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;

  static_assert((std::same_as<typename Terms::Space, Space> && ...),
                "taut: all terms of a Potential must live in the same Space");
  static_assert((std::same_as<typename Terms::Precision, Precision> && ...),
                "taut: all terms of a Potential must have the same Precision");
  static_assert(((LocalTerm<Terms> || SweptTerm<Terms>)&&...),
                "taut: each term of a Potential must satisfy LocalTerm or SweptTerm "
                "(core/potential/term.hpp)");

  explicit Potential(Unknowns<Precision, Space> const& unknowns, Terms... terms)
      : unknowns_(unknowns), terms_(std::move(terms)...) {
    make_room();
  }

  /// The unknowns have become others (a grid that is made anew each step), perhaps more or fewer.
  /// Terms that can follow are told; allocates only if there have never been as many.
  void resize(Unknowns<Precision, Space> const& unknowns) {
    unknowns_ = unknowns;
    bodies_ = {};
    asleep_.clear();
    make_room();
    for_each_term([&](auto& term) {
      if constexpr (requires { term.resize(unknowns); }) term.resize(unknowns);
    });
  }
  /// Calls visit(term) for each term.
  template <class Visit>
  void for_each_term(Visit const& visit) {
    std::apply([&](auto&... term) { (visit(term), ...); }, terms_);
  }

  /// The time integrator says what the step is: where it starts, the factor of all energies but the
  /// inertia (h^2 for implicit Euler), and the step that turns errors of position into errors of
  /// velocity. The target of the inertia is that of this step already.
  void begin_step(Positions const& x, double scale, double time_step, bool has_inertia) {
    scale_ = scale;
    kernels::FreeMass<Space, Precision> const free_mass{unknowns_.fixed, unknowns_.mass};
    auto const sums = mass_reducer_.template sum<2>("free_mass", size(), free_mass);
    double const mass = sums[0], mean_mass = sums[1] > 0 ? mass / sums[1] : 0;
    step_ = {mass, unknowns_.length, time_step, has_inertia};
    if constexpr ((SteppedTerm<Terms> || ...)) {
      bool anyone = false;
      for_each_of<is_stepped>([&](auto const& term) { anyone = anyone || !holds_nothing(term); });
      if (!anyone) return;
      auto const stiffness = stiffness_of_untold(x);  // and their gradient, in direction_
      StepStart<Precision, Space> const start{x,      time_step, stiffness,   direction_,
                                              scale_, mean_mass, has_inertia, mass};
      for_each_of<is_stepped>([&](auto const& term) { term.begin_step(start); });
    }
  }

  /// Takes anew, at x, what terms took where the step began; false if that changes nothing.
  bool relag(Positions const& x) const {
    bool changed = false;
    for_each_of<is_lagged>([&](auto const& term) { changed = term.relag(x) || changed; });
    return changed;
  }

  template <class Term>
  Term& term() {
    return std::get<Term>(terms_);
  }
  Unknowns<Precision, Space> const& unknowns() const { return unknowns_; }

  int size() const { return unknowns_.size(); }
  Scale scale() const { return step_; }
  Array<Real, Space> mass() const { return unknowns_.mass; }

  double value(Positions const& x) const {
    auto const local = locals();
    using Kernel = kernels::LocalValue<Space, Precision, std::decay_t<decltype(local)>>;
    double total = reducer_.template sum<1>("local_value", size(), Kernel{local, x})[0];
    for_each_swept([&](auto const& term) { total += term.value(x, scale_); });
    return total;
  }

  double difference(Positions const& x, Vectors const& p, double alpha) const {
    double total =
        reducer_.template sum<1>("local_change", size(), change_kernel(x, p, alpha, false))[0];
    for_each_swept([&](auto const& term) { total += term.change(x, p, alpha, scale_); });
    return total;
  }

  void gradient(Positions const& x, Vectors const& g) const {
    local_gradient<0>(x, g, g);
    for_each_swept([&](auto const& term) { term.add_gradient(x, scale_, unknowns_.fixed, g); });
  }
  void gradient(Positions const& x, Vectors const& g, Vectors const& diagonal) const {
    gradient_with<3>(x, g, diagonal);
  }
  void gradient(Positions const& x, Vectors const& g, Blocks const& blocks) const {
    gradient_with<6>(x, g, blocks);
  }

  double gradient_after(Positions const& x, Vectors const& p, double alpha,
                        Vectors const& g) const {
    double total = local_arrival<0>(x, p, alpha, g, g);
    for_each_swept([&](auto const& term) {
      total += term.add_gradient_after(x, p, alpha, scale_, unknowns_.fixed, g);
    });
    return total;
  }
  double gradient_after(Positions const& x, Vectors const& p, double alpha, Vectors const& g,
                        Vectors const& diagonal) const {
    return gradient_after_with<3>(x, p, alpha, g, diagonal);
  }
  double gradient_after(Positions const& x, Vectors const& p, double alpha, Vectors const& g,
                        Blocks const& blocks) const {
    return gradient_after_with<6>(x, p, alpha, g, blocks);
  }

  double quadratic_form(Positions const& x, Vectors const& p) const {
    double unused;
    return quadratic_form(x, p, unused);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double& certified) const {
    certified = std::numeric_limits<double>::infinity();
    auto const local = locals();
    using Kernel = kernels::LocalForm<Space, Precision, std::decay_t<decltype(local)>>;
    double total =
        reducer_.template sum<1>("local_form", size(), Kernel{local, unknowns_.fixed, x, p})[0];
    for_each_swept(
        [&](auto const& term) { total += taut::quadratic_form(term, x, p, scale_, certified); });
    return total;
  }

  void product(Positions const& x, Vectors const& p, Vectors const& hp) const {
    auto const local = locals();
    using Kernel = kernels::LocalProduct<Space, Precision, std::decay_t<decltype(local)>>;
    for_each<Space>("local_product", size(), Kernel{local, unknowns_.fixed, x, p, hp});
    for_each_swept([&](auto const& term) { term.add_product(x, p, scale_, unknowns_.fixed, hp); });
  }

  /// Changes where pattern(x) does.
  std::int64_t pattern_version(Positions const& x) const {
    std::int64_t version = 0;
    for_each_of<is_changing>([&](auto const& term) { version += term.pattern_version(x); });
    return version;
  }
  Matrix pattern(Positions const& x) const {
    pattern_version(x);
    std::vector<Connectivity> kinds;
    for_each_swept([&](auto const& term) { term.elements(kinds); });
    return Matrix(pattern_from_elements(size(), kinds));
  }

  void assemble(Positions const& x, Matrix const& matrix) const {
    auto const local = locals();
    using Kernel = kernels::LocalAssemble<Space, Precision, std::decay_t<decltype(local)>>;
    for_each<Space>("local_assemble", size(),
                    Kernel{local, unknowns_.fixed, unknowns_.mass, x, matrix});
    for_each_swept([&](auto const& term) { term.add_to(matrix, x, scale_, unknowns_.fixed); });
  }

  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    return max_step(x, p, at_most, 0);
  }
  double max_step(Positions const& x, Vectors const& p, double at_most, double certified) const {
    for_each_swept(
        [&](auto const& term) { at_most = taut::max_step(term, x, p, at_most, certified); });
    return at_most;
  }

  /// As `max_step`, for motion that is prescribed: no element may fold, whatever its material, and
  /// what moves by itself goes its share of the way as well.
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    for_each_swept([&](auto const& term) { at_most = term.max_prescribed_step(x, p, at_most); });
    return at_most;
  }

  /// Moves free unknowns by one Newton step on the local terms alone: from x + h v to the predictor
  /// x + h v + h^2 (g + f / m). Without inertia nothing moves.
  void predict(Positions const& x) const {
    auto const local = locals();
    using Kernel = kernels::Predict<Space, Precision, std::decay_t<decltype(local)>>;
    for_each<Space>("predict", size(), Kernel{local, unknowns_.fixed, x});
  }

  /// Fixed unknowns, and what else moves, go a fifth of the way to where the first element would
  /// fold or the first pair touch, then the free ones follow (minimiser iterations), and so on
  /// until all have arrived. In greater strides the gaps would close faster than an iteration can
  /// open them. Throws HeldUp where there is no way left.
  bool advance_prescribed(Positions const& x) const {
    using Direction = kernels::PrescribedDirection<Space, Precision>;
    double const pins =
        maximum<Space>("prescribed_direction", size(), 0.0,
                       Direction{unknowns_.fixed, x, unknowns_.prescribed, direction_});
    double const distance = Kokkos::max(pins, motion_left(x));
    if (distance == 0) return false;
    // Materials that tolerate inversion may have to fold (a push faster than sound): there the
    // motion is not held up for ever.
    constexpr double stride = 0.4;
    double const allowed = stride * max_advance(x, direction_, max_step(x, direction_, 1 / stride));
    double const patience = distance < 1e-3 * unknowns_.length ? 1.0 : 0.125;
    double const unfolded = stride * max_prescribed_step(x, direction_, 1 / stride);
    double const fraction = Kokkos::min(1.0, Kokkos::max(unfolded, Kokkos::min(patience, allowed)));
    if (!(fraction * distance > 1e-12 * unknowns_.length) && fraction < 1) {
      throw HeldUp(what_obstructs(x, direction_));
    }
    for_each<Space>("move_prescribed", size(),
                    kernels::MovePrescribed<Space, Precision>{
                        unknowns_.fixed, x, unknowns_.prescribed, direction_, fraction});
    advance(fraction);
    return true;
  }

  /// The Hessian at x in two parts: that of a term which couples unknowns as an operator of its own
  /// kind, and blocks of what acts on single unknowns (the mass, where these are fixed).
  template <class Operator>
  void linearise(Positions const& x, Operator& to, Blocks const& local) {
    local_gradient<6>(x, direction_, local);
    for_each_swept([&](auto const& term) {
      using Term = std::decay_t<decltype(term)>;
      if constexpr (requires { term.linearise(x, scale_, to); }) {
        term.linearise(x, scale_, to);
      } else {
        static_assert(UncoupledTerm<Term>,
                      "taut: a term that couples unknowns has no part in this operator; take a "
                      "preconditioner that assembles the Hessian");
        term.add_gradient(x, scale_, unknowns_.fixed, direction_, local);
      }
    });
  }

  /// What residuals of unknowns are measured by, N: the mean over the terms that can tell.
  void characteristic_force(Array<double, Space> const& force) const
      requires(CharacteristicTerm<Terms> || ...) {
    Array<double, Space> const mass("characteristic_mass", size());
    assign_on<Space>(force, 0.0);
    for_each_of<is_characteristic>(
        [&](auto const& term) { term.add_characteristic_force(force, mass); });
    for_each<Space>("characteristic_force", size(), kernels::DivideByMass<Space>{force, mass});
  }

  // For minimisers that go by bodies and islands (DivisibleObjective).
  bool divisible() const {
    bool all = true;
    for_each_swept([&](auto const& term) { all = all && divides(term); });
    return all;
  }
  Bodies<Space> const& bodies() {
    if (bodies_.of.extent_int(0) != size()) {
      std::vector<Connectivity> kinds;
      for_each_swept([&](auto const& term) { lasting_elements(term, kinds); });
      bodies_ = make_bodies<Space>(size(), kinds);
    }
    return bodies_;
  }
  FixedMask<Space> const& fixed() const { return unknowns_.fixed; }
  void link(typename Bodies<Space>::Indices const& label) {
    int changed = 1;
    while (changed != 0) {
      changed = 0;
      for_each_of<is_linking>([&](auto const& term) {
        if (term.link(unknowns_.fixed, bodies().of, label)) changed = 1;
      });
      changed = maximum<Space>("follow_labels", bodies().count, changed,
                               kernels::FollowLabels<Space>{label});
    }
  }
  void form_shares(Positions const& x, Vectors const& p, Array<double, Space> const& shares) const {
    auto const local = locals();
    using Form = kernels::LocalForm<Space, Precision, std::decay_t<decltype(local)>>;
    using Kernel = kernels::LocalShares<Space, Precision, std::decay_t<decltype(local)>>;
    for_each<Space>("local_shares", size(), Kernel{Form{local, unknowns_.fixed, x, p}, shares});
    for_each_of<is_divisible>(
        [&](auto const& term) { term.add_form_shares(x, p, scale_, unknowns_.fixed, shares); });
  }
  void set_idle(IdleMask<Space> const& idle) const {
    for_each_of<is_idling>([&](auto const& term) { term.set_idle(idle); });
  }
  /// For minimisers that go by regions (RegionalObjective).
  void mark_acting(Positions const& x, Array<int, Space> const& marks) const {
    assign_on<Space>(marks, 0);
    for_each_of<is_marking>([&](auto const& term) { term.mark_acting(x, unknowns_.fixed, marks); });
  }
  /// Bodies that are to stay where they are, at rest, unless something comes to act on them; empty:
  /// none. Minimisers that go by islands heed it, and say who has been woken.
  void set_asleep(std::vector<char> asleep) { asleep_ = std::move(asleep); }
  std::vector<char> const& asleep() const { return asleep_; }
  /// Bounds are looked for one term after the other, none longer than the one before: the last
  /// that was cut counts.
  std::optional<Obstruction> obstruction() const {
    std::optional<Obstruction> last;
    for_each_of<is_obstructed>([&](auto const& term) {
      if (auto found = term.obstruction()) last = std::move(found);
    });
    return last;
  }

  /// How far what moves by itself has still to go, m.
  double motion_left(Positions const& x) const {
    double left = 0;
    for_each_of<is_moving>(
        [&](auto const& term) { left = Kokkos::max(left, term.motion_left(x)); });
    return left;
  }
  /// It goes by this fraction of that; by 1 it arrives.
  void advance(double fraction) const {
    for_each_of<is_moving>([&](auto const& term) { term.advance(fraction); });
  }

private:
  void make_room() {
    direction_ = direction_memory_.resize("prescribed_direction", size());
    reducer_.provide(size(), 1);
    mass_reducer_.provide(size(), 2);
  }
  /// The chained kernels of all local terms.
  auto locals() const {
    return std::apply(
        [&](auto const&... term) {
          return std::apply([](auto const&... kernel) { return kernels::chain(kernel...); },
                            std::tuple_cat(local_kernel(term)...));
        },
        terms_);
  }
  template <class Term>
  auto local_kernel(Term const& term) const {
    if constexpr (LocalTerm<Term>) {
      return std::make_tuple(term.kernel(scale_));
    } else {
      return std::tuple<>();
    }
  }

  // Kinds of terms, as types: a lambda cannot take a concept.
  template <class Term>
  using is_swept = std::bool_constant<SweptTerm<Term>>;
  template <class Term>
  using is_stepped = std::bool_constant<SteppedTerm<Term>>;
  template <class Term>
  using is_untold = std::bool_constant<SweptTerm<Term> && !SteppedTerm<Term>>;
  template <class Term>
  using is_changing = std::bool_constant<ChangingTerm<Term>>;
  template <class Term>
  using is_lagged = std::bool_constant<LaggedTerm<Term>>;
  template <class Term>
  using is_moving = std::bool_constant<MovingTerm<Term>>;
  template <class Term>
  using is_characteristic = std::bool_constant<CharacteristicTerm<Term>>;
  template <class Term>
  using is_divisible = std::bool_constant<DivisibleTerm<Term>>;
  template <class Term>
  using is_linking = std::bool_constant<LinkingTerm<Term>>;
  template <class Term>
  using is_idling = std::bool_constant<IdlingTerm<Term>>;
  template <class Term>
  using is_marking = std::bool_constant<MarkingTerm<Term>>;
  template <class Term>
  using is_obstructed = std::bool_constant<ObstructedTerm<Term>>;

  template <template <class> class Kind, class Visit>
  void for_each_of(Visit const& visit) const {
    std::apply([&](auto const&... term) { (visit_if<Kind>(term, visit), ...); }, terms_);
  }
  template <template <class> class Kind, class Term, class Visit>
  static void visit_if(Term const& term, Visit const& visit) {
    if constexpr (Kind<Term>::value) visit(term);
  }
  template <class Visit>
  void for_each_swept(Visit const& visit) const {
    for_each_of<is_swept>(visit);
  }

  /// Of a list of terms that is chosen at run time.
  template <class Term>
  static bool holds_nothing(Term const& term) {
    if constexpr (requires { term.empty(); }) return term.empty();
    return false;
  }

  double max_advance(Positions const& x, Vectors const& p, double at_most) const {
    for_each_of<is_moving>([&](auto const& term) { at_most = term.max_advance(x, p, at_most); });
    return at_most;
  }

  Array<Real, Space> stiffness_of_untold(Positions const& x) {
    if (stiffness_.extent_int(0) != size()) {
      stiffness_ = stiffness_memory_.resize("stiffness", size());
      diagonal_ = diagonal_memory_.resize("stiffness_diagonal", size());
    }
    local_gradient<3>(x, direction_, diagonal_);
    for_each_of<is_untold>([&](auto const& term) {
      term.add_gradient(x, scale_, unknowns_.fixed, direction_, diagonal_);
    });
    for_each<Space>("stiffness", size(),
                    kernels::MeanCurvature<Space, Precision>{diagonal_, 1 / scale_, stiffness_});
    return stiffness_;
  }

  /// What cuts a step along p the shortest.
  Obstruction what_obstructs(Positions const& x, Vectors const& p) const {
    double shortest = std::numeric_limits<double>::infinity();
    Obstruction by{"an element that is already flat", {}};
    for_each_swept([&](auto const& term) {
      double const reach = term.max_prescribed_step(x, p, 1.0);
      if (!(reach < shortest)) return;
      shortest = reach;
      if constexpr (ObstructedTerm<std::decay_t<decltype(term)>>) {
        if (auto found = term.obstruction()) by = *found;
      }
    });
    return by;
  }

  template <int numbers, class CurvatureField>
  auto gradient_kernel(Positions const& x, Vectors const& g, CurvatureField const& c) const {
    auto const local = locals();
    return kernels::LocalGradient<Space, Precision, std::decay_t<decltype(local)>, numbers,
                                  CurvatureField>{local, unknowns_.fixed, unknowns_.mass, x, g, c};
  }
  auto change_kernel(Positions const& x, Vectors const& p, double alpha, bool arrived) const {
    auto const local = locals();
    return kernels::LocalChange<Space, Precision, std::decay_t<decltype(local)>>{
        local, unknowns_.fixed, x, p, alpha, arrived};
  }
  template <int numbers, class CurvatureField>
  void local_gradient(Positions const& x, Vectors const& g, CurvatureField const& c) const {
    for_each<Space>("local_gradient", size(), gradient_kernel<numbers>(x, g, c));
  }
  template <int numbers, class CurvatureField>
  double local_arrival(Positions const& x, Vectors const& p, double alpha, Vectors const& g,
                       CurvatureField const& c) const {
    auto const gradient = gradient_kernel<numbers>(x, g, c);
    auto const change = change_kernel(x, p, alpha, true);
    using Kernel =
        kernels::LocalArrival<std::decay_t<decltype(gradient)>, std::decay_t<decltype(change)>>;
    return reducer_.template sum<1>("local_arrival", size(), Kernel{gradient, change})[0];
  }
  template <int numbers, class CurvatureField>
  void gradient_with(Positions const& x, Vectors const& g, CurvatureField const& c) const {
    local_gradient<numbers>(x, g, c);
    for_each_swept([&](auto const& term) { term.add_gradient(x, scale_, unknowns_.fixed, g, c); });
  }
  template <int numbers, class CurvatureField>
  double gradient_after_with(Positions const& x, Vectors const& p, double alpha, Vectors const& g,
                             CurvatureField const& c) const {
    double total = local_arrival<numbers>(x, p, alpha, g, c);
    for_each_swept([&](auto const& term) {
      total += term.add_gradient_after(x, p, alpha, scale_, unknowns_.fixed, g, c);
    });
    return total;
  }
  Unknowns<Precision, Space> unknowns_;
  std::tuple<Terms...> terms_;
  Bodies<Space> bodies_;
  std::vector<char> asleep_;
  Vectors direction_;
  Array<Real, Space> stiffness_;  ///< where terms are told of it
  Vectors diagonal_;
  Resizable<Vectors> direction_memory_, diagonal_memory_;
  Resizable<Array<Real, Space>> stiffness_memory_;
  Reducer<Space, typename Precision::sum> reducer_;
  Reducer<Space, double> mass_reducer_;
  double scale_ = 1;
  Scale step_;
};

template <class Precision, class Space, class... Terms>
Potential(Unknowns<Precision, Space> const&, Terms...) -> Potential<Terms...>;

}  // namespace taut
