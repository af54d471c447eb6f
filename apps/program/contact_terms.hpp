// The contact terms that the program knows: the default policies in every precision, and others,
// one at a time and all of the PNCG paper together, in fp64.
#pragma once

#include <taut/apps/program/scene_options.hpp>
#include <taut/contact/adaptive_stiffness.hpp>
#include <taut/contact/contact.hpp>
#include <taut/contact/friction.hpp>
#include <taut/core/potential/any_terms.hpp>

#include <memory>

namespace taut {

/// A contact term as the program looks at it, whatever its policies.
template <class P>
class ProgramContact {
public:
  virtual ~ProgramContact() = default;
  virtual ContactReport report(VectorField<typename P::position, DefaultSpace> const& x) const = 0;
  virtual double dhat() const = 0;  ///< m
  /// Below what two bodies act, per vertex, m: part of a checkpoint.
  virtual Array<double, DefaultSpace> activation() const = 0;
  virtual void set_activation(Array<double, DefaultSpace> const& activation) const = 0;
  /// Its pairs have friction; the coefficients are by the objects of the surface.
  virtual void add_to(Friction<P>& friction, FrictionCoefficients const& mu) const = 0;
};

/// What touches: everything in the solver's order.
template <class P>
struct ContactPart {
  Unknowns<P> unknowns;
  Surface surface;
  std::vector<Point> rest;  ///< m
  double dhat;              ///< m
};

/// Adds the term that the options ask for. Throws Error for policies that are not compiled together
/// or in this precision.
template <class P>
std::shared_ptr<ProgramContact<P> const> add_contact_term(AnySteppedTerms<P>& terms,
                                                          ContactPart<P> const& part,
                                                          ContactOptions const& options);

/// The barrier of the scene, for terms that ask it little: a choice of run time.
struct AnyBarrier {
  static constexpr char const* name = "any";
  static constexpr double curvature_at_half = 1;
  enum class Kind { log, ipc, log_squared, cubic };
  Kind kind = Kind::log;

  explicit AnyBarrier(ContactOptions const& options) {
    std::string const barrier = options.text("barrier");
    if (barrier == IpcBarrier::name) kind = Kind::ipc;
    if (barrier == LogSquaredBarrier::name) kind = Kind::log_squared;
    if (barrier == CubicBarrier::name) kind = Kind::cubic;
  }
  AnyBarrier() = default;

  template <class T>
  KOKKOS_FUNCTION T value(RelativeDistance<T> const& s) const {
    return ask([&](auto const& barrier) { return barrier.value(s); });
  }
  template <class T>
  KOKKOS_FUNCTION T slope(RelativeDistance<T> const& s) const {
    return ask([&](auto const& barrier) { return barrier.slope(s); });
  }
  template <class T>
  KOKKOS_FUNCTION T curvature(RelativeDistance<T> const& s) const {
    return ask([&](auto const& barrier) { return barrier.curvature(s); });
  }
  template <class T>
  KOKKOS_FUNCTION T change(RelativeDistance<T> const& before, RelativeDistance<T> const& after,
                           RelativeStep<T> const& step) const {
    return ask([&](auto const& barrier) { return barrier.change(before, after, step); });
  }

private:
  template <class Question>
  KOKKOS_FUNCTION auto ask(Question const& question) const {
    switch (kind) {
      case Kind::ipc:
        return question(Normalised<IpcBarrier>());
      case Kind::log_squared:
        return question(Normalised<LogSquaredBarrier>());
      case Kind::cubic:
        return question(Normalised<CubicBarrier>());
      case Kind::log:
        break;
    }
    return question(Normalised<LogBarrier>());
  }
};

/// K by the rule of the scene. It is asked when pairs are found, not in inner loops, so the choice
/// is one of run time.
struct AnyStiffness {
  static constexpr char const* name = "any";
  static constexpr bool per_vertex = true;
  enum class Kind { inclusive, given, adaptive };
  Kind kind = Kind::inclusive;
  ElasticInclusiveStiffness inclusive = {};
  GivenStiffness by_pressure = {};
  IpcAdaptiveStiffness adaptive = {};

  explicit AnyStiffness(ContactOptions const& options)
      : inclusive{options.number("stiffness_factor")}, by_pressure{options.number("pressure")} {
    std::string const rule = options.text("stiffness");
    if (rule == GivenStiffness::name) kind = Kind::given;
    if (rule == IpcAdaptiveStiffness::name) kind = Kind::adaptive;
  }
  AnyStiffness() = default;

  bool valid() const {
    return kind == Kind::given      ? by_pressure.valid()
           : kind == Kind::adaptive ? adaptive.valid()
                                    : inclusive.valid();
  }
  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const& fields, PairKind pair, int const (&v)[4]) const {
    return kind == Kind::given      ? by_pressure(fields, pair, v)
           : kind == Kind::adaptive ? adaptive(fields, pair, v)
                                    : inclusive(fields, pair, v);
  }
  template <class Fields>
  KOKKOS_FUNCTION double vertex(Fields const& fields, int v) const {
    return kind == Kind::given      ? by_pressure.vertex(fields, v)
           : kind == Kind::adaptive ? adaptive.vertex(fields, v)
                                    : inclusive.vertex(fields, v);
  }

  bool adapts() const { return kind == Kind::adaptive; }
  void reset() { adaptive.reset(); }
  void adapt(StiffnessBalance const& balance) { adaptive.adapt(balance); }
};

}  // namespace taut
