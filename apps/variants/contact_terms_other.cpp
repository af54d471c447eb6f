#include <taut/apps/program/contact_terms_impl.hpp>
#include <taut/contact/spatial_hash.hpp>

namespace taut {

namespace {

template <class Barrier, class Curvature = GaussNewtonCurvature, class Mollifier = EdgeMollifier>
using PairOf = PairEnergy<Normalised<Barrier>, Curvature, Mollifier>;
using Tree = Bvh<DefaultSpace>;

struct Choice {
  std::string barrier, curvature, search, bound;
  bool mollifier;
  bool operator==(Choice const&) const = default;
};

template <class Pair = PairEnergy<>, class Search = Tree, class Bound = AdditiveCcd>
constexpr auto policies = &add_contact_of<Fp64, Pair, Search, Bound>;

std::shared_ptr<ProgramContact<Fp64> const> add_compiled(AnySteppedTerms<Fp64>& terms,
                                                         ContactPart<Fp64> const& part,
                                                         ContactOptions const& options) {
  Choice const asked{options.text("barrier"), options.text("curvature"), options.text("search"),
                     options.text("bound"), options.flag("mollifier")};
  std::string const gn = "gauss_newton", bvh = "bvh", ccd = "additive_ccd";
  using Add = decltype(policies<>);
  std::vector<std::pair<Choice, Add>> const compiled{
      {{"ipc", gn, bvh, ccd, true}, policies<PairOf<IpcBarrier>>},
      {{"log_squared", gn, bvh, ccd, true}, policies<PairOf<LogSquaredBarrier>>},
      {{"cubic", gn, bvh, ccd, true}, policies<PairOf<CubicBarrier>>},
      {{"log", "truncated", bvh, ccd, true}, policies<PairOf<LogBarrier, TruncatedCurvature>>},
      {{"log", "exact", bvh, ccd, true}, policies<PairOf<LogBarrier, ExactCurvature>>},
      {{"log", gn, bvh, ccd, false},
       policies<PairOf<LogBarrier, GaussNewtonCurvature, NoMollifier>>},
      {{"log", gn, "spatial_hash", ccd, true}, policies<PairEnergy<>, SpatialHash<DefaultSpace>>},
      {{"log", gn, "brute_force", ccd, true}, policies<PairEnergy<>, BruteForce<DefaultSpace>>},
      {{"log", gn, bvh, "closing", true}, policies<PairEnergy<>, Tree, PairwiseClosing>},
      {{"log", gn, bvh, "half_dhat", true}, policies<PairEnergy<>, Tree, HalfDhatClamp>},
      // The PNCG paper.
      {{"log", "truncated", bvh, "half_dhat", false},
       policies<PairOf<LogBarrier, TruncatedCurvature, NoMollifier>, Tree, HalfDhatClamp>},
  };
  for (auto const& [choice, add] : compiled) {
    if (choice == asked) return add(terms, part, options);
  }
  return nullptr;
}

bool const filled = add_other_contact.fill(add_compiled);

}  // namespace

}  // namespace taut
