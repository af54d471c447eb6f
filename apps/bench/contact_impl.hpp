// The measurements of `taut bench contact` in one precision, for the source files that instantiate
// them.
#pragma once

#include <taut/apps/bench/body.hpp>
#include <taut/apps/bench/contact.hpp>
#include <taut/apps/bench/contact_counts.hpp>
#include <taut/apps/bench/contact_scene.hpp>
#include <taut/apps/bench/memory.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/contact/contact.hpp>
#include <taut/contact/spatial_hash.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/report/error.hpp>

namespace taut {

/// The rows of one scene in one precision.
template <class P>
void measure_contact_scene(ContactScene const& scene, ContactBenchOptions const& options,
                           MachineRates const& machine, std::vector<ContactRow>& rows);

namespace kernels {

/// The distance of pair k.
template <class P, class S, PairKind kind>
struct FeatureDistance {
  PairList<S> ids;
  VectorField<typename P::position, S> x;
  [[gnu::noinline]] KOKKOS_FUNCTION double distance(int k) const {
    using Real = typename P::real;
    int v[4];
    Vec3<double> wide[4];
    Vec3<Real> y[4];
    read_pair(ids, k, v);
    gather(v, x, wide);
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) y[a][c] = static_cast<Real>(wide[a][c] - wide[1][c]);
    return double(closest_points(kind, y).distance);
  }
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const { sum[0] += distance(k); }
};

}  // namespace kernels

template <class P>
class ContactBench {
public:
  using S = DefaultSpace;
  using Real = typename P::real;
  using Positions = VectorField<typename P::position, S>;
  using Vectors = VectorField<Real, S>;
  using Term = Contact<PairEnergy<>, Bvh<S>, AdditiveCcd, GivenStiffness, P>;

  ContactBench(ContactScene const& scene, ContactBenchOptions const& options,
               MachineRates const& machine)
      : scene_(scene),
        options_(options),
        machine_(machine),
        surface_(copy_surface<S>(scene.surface)),
        edge_(edge_lengths(scene.surface, scene.rest.points).mean),
        unknowns_(scene.mass, edge_),
        x_(field<typename P::position>(scene.rest.points)),
        p_(field<Real>(scene.direction)),
        g_("bench_gradient", x_.extent(0)),
        d_("bench_diagonal", x_.extent(0)),
        b_("bench_blocks", x_.extent(0)) {}

  void add_rows(std::vector<ContactRow>& rows) {
    MemoryWatch const memory;
    Term const contact(unknowns_, scene_.surface, scene_.rest.points,
                       {.dhat = scene_.dhat, .stiffness = {.pressure = pressure}});
    contact.add_gradient(x_, h2, unknowns_.fixed, g_, b_);
    contact.max_step(x_, p_, 1);
    double const held = memory.held_now(), peak = memory.held();
    ContactReport const report = contact.report(x_);
    sizes_ = {double(surface_.vertices()), double(surface_.edges()), double(surface_.triangles()),
              0, double(report.contacts)};
    all_.precision = P::name;
    all_.threads = machine_.threads;
    all_.contacts = report.contacts;
    all_.kept = report.candidates;
    all_.tets = static_cast<int>(scene_.rest.tets.size());
    searches(rows);
    features(rows);
    double const bound = term(rows, contact);
    bounds(rows);
    iteration(rows, contact, bound);
    rows.back().held = held;
    rows.back().peak = peak;
  }

private:
  static constexpr double h = 0.01, h2 = h * h, pressure = 1e4;

  template <class T>
  static VectorField<T, S> field(std::vector<Point> const& from) {
    VectorField<T, S> to("bench_field", from.size());
    auto const host = Kokkos::create_mirror_view(to);
    for (std::size_t i = 0; i < from.size(); ++i)
      for (int c = 0; c < 3; ++c) host(i, c) = static_cast<T>(from[i][c]);
    assign(to, host);
    return to;
  }

  template <class Run>
  double time(Run const& run) const {
    auto const fenced = [&] {
      run();
      Kokkos::fence("taut: bench");
    };
    fenced();
    return best_seconds(options_.seconds, fenced);
  }
  void add(std::vector<ContactRow>& rows, char const* kernel, double seconds) const {
    ContactRow row = all_;
    row.kernel = kernel;
    row.seconds = seconds;
    SweepCounts const counts = count_contact(kernel, P::name, sizes_);
    row.bytes = counts.bytes;
    row.flops = counts.flops;
    row.fraction = 1e-9 * limit_ns(machine_, P::name, counts) / seconds;
    rows.push_back(row);
  }

  /// As far as a contact term's cache with its default slack does.
  template <class Policy>
  int search(std::vector<ContactRow>& rows, char const* kernel, int candidates) {
    PairSearch<Policy> search(surface_, edge_);
    Candidates<S> found;
    double const radius = scene_.dhat * (1 + 2 * typename Term::Cache::Params{}.slack);
    auto const run = [&] { search.find(Motion<P, S>{x_}, radius, found); };
    run();
    int const count = found.point_triangle.count() + found.edge_edge.count();
    if (candidates > 0 && count != candidates) {
      throw Error("bench: {} finds {} candidates instead of {}: a search misses some", kernel,
                  count, candidates);
    }
    all_.candidates = count;
    sizes_.candidates = count;
    add(rows, kernel, time(run));
    return count;
  }
  void searches(std::vector<ContactRow>& rows) {
    int const count = search<SpatialHash<S>>(rows, "search_hash", 0);
    search<Bvh<S>>(rows, "search_bvh", count);
  }

  typename Term::Cache cache() const {
    return {surface_, edge_,
            Activation<S>{.dhat = scene_.dhat,
                          .rest = copy_points<S>("bench_rest", scene_.rest.points),
                          .object = surface_.object}};
  }

  void features(std::vector<ContactRow>& rows) const {
    auto near = cache();
    near.update({x_, {}, 0, unknowns_.fixed});
    auto const& found = near.candidates();
    int const triangles = found.point_triangle.count(), edges = found.edge_edge.count();
    Reducer<S> const sum(std::max(triangles, edges), 1);
    add(rows, "features", time([&] {
          using Triangles = kernels::FeatureDistance<P, S, PairKind::point_triangle>;
          using Edges = kernels::FeatureDistance<P, S, PairKind::edge_edge>;
          sum.template sum<1>("bench_triangles", triangles,
                              Triangles{found.point_triangle.ids(), x_});
          sum.template sum<1>("bench_edges", edges, Edges{found.edge_edge.ids(), x_});
        }));
  }

  /// Returns the time of a step bound.
  double term(std::vector<ContactRow>& rows, Term const& contact) {
    auto const& fixed = unknowns_.fixed;
    auto const form = [&] { contact.quadratic_form(x_, p_, h2); };
    auto const bound = [&] { contact.max_step(x_, p_, 1); };
    add(rows, "gradient", time([&] { contact.add_gradient(x_, h2, fixed, g_); }));
    add(rows, "gradient_diagonal", time([&] { contact.add_gradient(x_, h2, fixed, g_, d_); }));
    add(rows, "gradient_blocks", time([&] { contact.add_gradient(x_, h2, fixed, g_, b_); }));
    double const form_seconds = time(form), bound_seconds = time(bound);
    add(rows, "quadratic_form", form_seconds);
    add(rows, "max_step", bound_seconds);
    auto const anew = [&](auto const& what) {
      return time([&] {
        contact.begin_step({x_, h, {}});
        what();
      });
    };
    add(rows, "renewal",
        std::max(0.0, anew(form) - form_seconds) + std::max(0.0, anew(bound) - bound_seconds));
    return bound_seconds;
  }

  template <class Run>
  void bound(std::vector<ContactRow>& rows, char const* kernel, Candidates<S> const& found,
             Run const& run) const {
    add(rows, kernel, time([&] {
          run(found.point_triangle);
          run(found.edge_edge);
        }));
  }
  void bounds(std::vector<ContactRow>& rows) const {
    auto swept = cache();
    swept.update({x_, p_, 1, unknowns_.fixed});
    auto const& found = swept.candidates();
    Clearance clearance = typename Term::Params{}.clearance;
    clearance.ample = scene_.dhat;
    auto const step = [&](auto const& policy) {
      return [&, policy]<PairKind kind>(CandidateList<kind, S> const& list) {
        bound_step<P, S, kind>(policy, clearance, PairList<S>(list.ids()), list.count(), x_, p_,
                               1.0);
      };
    };
    bound(rows, "additive_ccd", found, step(AdditiveCcd{}));
    bound(rows, "pairwise", found, step(PairwiseClosing{}));
    bound(rows, "half_dhat", found, step(HalfDhatClamp{scene_.dhat}));
    Array<typename P::position, S> const alpha("bench_alpha", x_.extent(0));
    auto const vertices = [&](auto const& policy) {
      return [&, policy]<PairKind kind>(CandidateList<kind, S> const& list) {
        bound_vertices<P, S, kind>(policy, clearance, PairList<S>(list.ids()), list.count(), x_, p_,
                                   1.0, alpha);
      };
    };
    assign(alpha, 1);
    bound(rows, "planar", found, vertices(PlanarScaling{}));
    bound(rows, "isotropic", found, vertices(IsotropicPerVertex{}));
  }

  void iteration(std::vector<ContactRow>& rows, Term const& contact, double bound) const {
    ElasticPart part;
    part.rest = scene_.rest;
    part.materials = {lame_parameters(1e5, 0.4)};
    part.material_of_tet.assign(scene_.rest.tets.size(), 0);
    ProgramTerms<P> terms;
    add_elastic_term<StableNeoHookean, P>(terms, part, "clamp");
    add(rows, "elastic", time([&] {
          terms.add_gradient(x_, h2, unknowns_.fixed, g_, d_);
          terms.quadratic_form(x_, p_, h2);
        }));

    AnySteppedTerms<P, S> contacts;
    contacts.add(contact);
    ProgramPotential<P> potential(unknowns_, Inertia<P>(unknowns_),
                                  BodyForce<P>(unknowns_, {0, -9.81, 0}), terms, contacts);
    potential.begin_step(x_, h2, h, true);
    // Thrown at each other by twice dhat in this step.
    std::vector<Point> target = scene_.rest.points;
    for (std::size_t v = 0; v < target.size(); ++v)
      for (int c = 0; c < 3; ++c) target[v][c] += 100 * scene_.direction[v][c];
    assign(potential.template term<Inertia<P>>().target(), field<typename P::position>(target));
    Positions const x("bench_x", x_.extent(0));
    AnyMinimiser<P> minimiser(bench_pncg(options_.iterations));
    int taken = 0;
    auto const run = [&] {
      contact.begin_step({x_, h, {}});
      assign(x, x_);
      taken = minimiser.minimise(potential, x, {}).iterations;
      if (taken < 2) throw Error("bench: the step with contact stops after {} iterations", taken);
    };
    run();
    long const allocations = MemoryWatch::allocations();
    auto const searching = [&] {
      return contact.energy_counters().seconds + contact.bound_counters().seconds;
    };
    std::int64_t const full = contact.neighbour_counters().full;
    double const searched = searching();
    Kokkos::Timer const timer;
    run();
    double const search_share = (searching() - searched) / timer.seconds();
    double const searches = double(contact.neighbour_counters().full - full) / taken;
    long const after = MemoryWatch::allocations();
    add(rows, "iteration", best_seconds(options_.seconds, run) / taken);
    ContactRow& row = rows.back();
    row.allocations = static_cast<int>(after - allocations);
    row.searches = searches;
    row.search_share = search_share;
    row.bound_share = bound / row.seconds;
  }

  ContactScene const& scene_;
  ContactBenchOptions const& options_;
  MachineRates const& machine_;
  SurfaceViews<S> surface_;
  double edge_;
  Unknowns<P> unknowns_;
  Positions x_;
  Vectors p_, g_, d_;
  BlockField<Real, S> b_;
  ContactRow all_;
  ContactSizes sizes_{};
};

template <class P>
void measure_contact_scene(ContactScene const& scene, ContactBenchOptions const& options,
                           MachineRates const& machine, std::vector<ContactRow>& rows) {
  std::size_t const first = rows.size();
  ContactBench<P>(scene, options, machine).add_rows(rows);
  // What a search finds was not known to the first of them.
  for (std::size_t k = first; k < rows.size(); ++k) rows[k].candidates = rows.back().candidates;
}

}  // namespace taut
