#include <taut/apps/program/contact_terms_impl.hpp>
#include <taut/contact/bvh.hpp>

namespace taut {

namespace {

template <class Barrier, class Curvature = GaussNewtonCurvature, class Mollifier = EdgeMollifier>
using PairOf = PairEnergy<Normalised<Barrier>, Curvature, Mollifier>;
using Hash = SpatialHash<DefaultSpace>;

struct Choice {
  std::string barrier, curvature, search, bound;
  bool mollifier;
  bool operator==(Choice const&) const = default;
};

template <class Pair = PairEnergy<>, class Search = Hash, class Bound = AdditiveCcd>
constexpr auto policies = &add_contact_of<Fp64, Pair, Search, Bound>;

}  // namespace

std::shared_ptr<ProgramContact<Fp64> const> add_other_contact(AnySteppedTerms<Fp64>& terms,
                                                              ContactPart<Fp64> const& part,
                                                              ContactOptions const& options) {
  Choice const asked{options.text("barrier"), options.text("curvature"), options.text("search"),
                     options.text("bound"), options.flag("mollifier")};
  std::string const gn = "gauss_newton", hash = "spatial_hash", ccd = "additive_ccd";
  using Add = decltype(policies<>);
  std::vector<std::pair<Choice, Add>> const compiled{
      {{"ipc", gn, hash, ccd, true}, policies<PairOf<IpcBarrier>>},
      {{"log_squared", gn, hash, ccd, true}, policies<PairOf<LogSquaredBarrier>>},
      {{"cubic", gn, hash, ccd, true}, policies<PairOf<CubicBarrier>>},
      {{"log", "truncated", hash, ccd, true}, policies<PairOf<LogBarrier, TruncatedCurvature>>},
      {{"log", "exact", hash, ccd, true}, policies<PairOf<LogBarrier, ExactCurvature>>},
      {{"log", gn, hash, ccd, false},
       policies<PairOf<LogBarrier, GaussNewtonCurvature, NoMollifier>>},
      {{"log", gn, "bvh", ccd, true}, policies<PairEnergy<>, Bvh<DefaultSpace>>},
      {{"log", gn, "brute_force", ccd, true}, policies<PairEnergy<>, BruteForce<DefaultSpace>>},
      {{"log", gn, hash, "closing", true}, policies<PairEnergy<>, Hash, PairwiseClosing>},
      {{"log", gn, hash, "half_dhat", true}, policies<PairEnergy<>, Hash, HalfDhatClamp>},
      // The PNCG paper.
      {{"log", "truncated", hash, "half_dhat", false},
       policies<PairOf<LogBarrier, TruncatedCurvature, NoMollifier>, Hash, HalfDhatClamp>},
  };
  for (auto const& [choice, add] : compiled) {
    if (choice == asked) return add(terms, part, options);
  }
  return nullptr;
}

}  // namespace taut
