// How contact terms are made, for the source files that instantiate them.
#pragma once

#include <taut/apps/program/contact_terms.hpp>
#include <taut/apps/program/late_part.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>

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
    Array<double, DefaultSpace> activation() const override { return term.activation(); }
    void set_activation(Array<double, DefaultSpace> const& a) const override {
      term.set_activation(a);
    }
    void add_to(Friction<P>& friction, FrictionCoefficients const& mu) const override {
      friction.add(term, mu);
    }
  };
  typename Term::Params params;
  params.dhat = part.dhat;
  params.cap = options.number("cap");
  params.start_share = options.number("start_share");
  params.stiffness = AnyStiffness(options);
  if constexpr (std::same_as<Bound, HalfDhatClamp>) {
    params.bound.dhat = part.dhat;
  }
  Term const term(part.unknowns, part.surface, part.rest, params);
  terms.add(term);
  return std::make_shared<Handle>(term);
}

/// Policies that differ from the default. Its result is null where they are not compiled together.
inline constinit LatePart<std::shared_ptr<ProgramContact<Fp64> const>(
    AnySteppedTerms<Fp64>&, ContactPart<Fp64> const&, ContactOptions const&)>
    add_other_contact = {};

template <class P>
std::shared_ptr<ProgramContact<P> const> add_contact_term(AnySteppedTerms<P>& terms,
                                                          ContactPart<P> const& part,
                                                          ContactOptions const& options) {
  ContactOptions const defaults;
  std::vector<std::string> others;
  for (char const* key : {"barrier", "curvature", "search", "bound"}) {
    if (options.text(key) != defaults.text(key)) {
      others.push_back(fmt::format("{} = \"{}\"", key, options.text(key)));
    }
  }
  if (!options.flag("mollifier")) others.push_back("mollifier = false");
  if (others.empty()) return add_contact_of<P>(terms, part, options);
  if constexpr (std::same_as<P, Fp64>) {
    auto added = add_other_contact(fmt::format("[contact]: {}", fmt::join(others, " and ")), terms,
                                   part, options);
    if (added) return added;
    throw Error(
        "[contact]: {} are not compiled together: change one of them at a time, or curvature, "
        "mollifier and bound as in the PNCG paper (truncated, false, half_dhat)",
        fmt::join(others, " and "));
  } else {
    throw Error("[contact]: {} is compiled for fp64 alone: set solver.precision = \"fp64\"",
                fmt::join(others, " and "));
  }
}

}  // namespace taut
