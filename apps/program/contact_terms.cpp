#include <taut/apps/program/contact_terms_impl.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>

namespace taut {

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
    if (auto added = add_other_contact(terms, part, options)) return added;
    throw Error(
        "[contact]: {} are not compiled together: change one of them at a time, or curvature, "
        "mollifier and bound as in the PNCG paper (truncated, false, half_dhat)",
        fmt::join(others, " and "));
  } else {
    throw Error("[contact]: {} is compiled for fp64 alone: set solver.precision = \"fp64\"",
                fmt::join(others, " and "));
  }
}

template std::shared_ptr<ProgramContact<Fp64> const> add_contact_term(AnySteppedTerms<Fp64>&,
                                                                      ContactPart<Fp64> const&,
                                                                      ContactOptions const&);
template std::shared_ptr<ProgramContact<Mixed> const> add_contact_term(AnySteppedTerms<Mixed>&,
                                                                       ContactPart<Mixed> const&,
                                                                       ContactOptions const&);
template std::shared_ptr<ProgramContact<Fp32> const> add_contact_term(AnySteppedTerms<Fp32>&,
                                                                      ContactPart<Fp32> const&,
                                                                      ContactOptions const&);

}  // namespace taut
