// The contact terms that the program knows: the default policies in every precision, and others,
// one at a time and all of the PNCG paper together, in fp64.
#pragma once

#include <taut/apps/program/scene_options.hpp>
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

/// K by the rule of the scene. It is asked when pairs are found, not in inner loops, so the choice
/// is one of run time.
struct AnyStiffness {
  static constexpr char const* name = "any";
  static constexpr bool per_vertex = true;
  bool given = false;
  GivenStiffness by_pressure = {};
  ElasticInclusiveStiffness inclusive = {};

  explicit AnyStiffness(ContactOptions const& options)
      : given(options.text("stiffness") == "given"),
        by_pressure{options.number("pressure")},
        inclusive{options.number("stiffness_factor")} {}
  AnyStiffness() = default;

  bool valid() const { return given ? by_pressure.valid() : inclusive.valid(); }
  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const& fields, PairKind kind, int const (&v)[4]) const {
    return given ? by_pressure(fields, kind, v) : inclusive(fields, kind, v);
  }
  template <class Fields>
  KOKKOS_FUNCTION double vertex(Fields const& fields, int v) const {
    return given ? by_pressure.vertex(fields, v) : inclusive.vertex(fields, v);
  }
};

}  // namespace taut
