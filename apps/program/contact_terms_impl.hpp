// How contact terms are made, for the source files that instantiate them.
#pragma once

#include <taut/apps/program/contact_terms.hpp>

namespace taut {

/// Adds Contact<Pair, Search, Bound> in precision P.
template <class P, class Pair = PairEnergy<>, class Search = Bvh<DefaultSpace>,
          class Bound = AdditiveCcd>
std::shared_ptr<ProgramContact<P> const> add_contact_of(AnySteppedTerms<P>& terms,
                                                        ContactPart<P> const& part,
                                                        ContactOptions const& options) {
  using Term = Contact<Pair, Search, Bound, AnyStiffness, P, DefaultSpace>;
  struct Handle final : ProgramContact<P> {
    Term term;
    explicit Handle(Term const& t) : term(t) {}
    ContactReport report(typename Term::Positions const& x) const override {
      return term.report(x);
    }
    double dhat() const override { return term.dhat(); }
    void add_to(Friction<P>& friction, FrictionCoefficients const& mu) const override {
      friction.add(term, mu);
    }
  };
  typename Term::Params params;
  params.dhat = part.dhat;
  params.cap = options.number("cap");
  params.stiffness = AnyStiffness(options);
  if constexpr (std::same_as<Bound, HalfDhatClamp>) {
    params.bound.dhat = part.dhat;
  }
  Term const term(part.unknowns, part.surface, part.rest, params);
  terms.add(term);
  return std::make_shared<Handle>(term);
}

/// In fp64: the policies that differ from the default. Null if they are not compiled together.
std::shared_ptr<ProgramContact<Fp64> const> add_other_contact(AnySteppedTerms<Fp64>& terms,
                                                              ContactPart<Fp64> const& part,
                                                              ContactOptions const& options);

}  // namespace taut
