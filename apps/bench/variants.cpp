#include <taut/apps/bench/body.hpp>
#include <taut/apps/bench/variants.hpp>
#include <taut/core/fem/elastic_tets.hpp>
#include <taut/materials/elastic.hpp>

#include <cstdlib>

namespace taut {
namespace {

using S = DefaultSpace;
using Material = Elastic<StableNeoHookean>;

/// The scalar products of an iteration with DK.
template <class P>
struct FiveDots {
  VectorField<typename P::real, S> g, y, p;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 5>& sums) const {
    using Sum = typename P::sum;
    for (int c = 0; c < 3; ++c) {
      Sum const gi = g(i, c), yi = y(i, c), pi = p(i, c);
      sums[0] += gi * gi;
      sums[1] += gi * yi;
      sums[2] += yi * yi;
      sums[3] += gi * pi;
      sums[4] += yi * pi;
    }
  }
};

/// Gradient and diagonal of one pack of tets, added to the vertices by atomics.
template <class P>
struct AtomicGradient {
  using Real = typename P::real;
  using T = std::conditional_t<S::on_host, HostPack<Real>, Real>;
  static constexpr int lanes = ScalarTraits<T>::lanes;

  Kokkos::View<int const*, typename S::memory> corner;  ///< [pack][4][lane], vertices
  Kokkos::View<Real const*, typename S::memory> rest;   ///< [pack][10][lane], B by columns and W
  VectorField<typename P::position, S> x;
  VectorField<Real, S> g, diagonal;
  Lame<double> lame;
  Real scale;

  KOKKOS_FUNCTION void operator()(int pack) const {
    int const* v = corner.data() + std::size_t(pack) * 4 * lanes;
    Real const* r = rest.data() + std::size_t(pack) * 10 * lanes;
    Mat3<T> B, edges;
    for (int k = 0; k < 9; ++k) B.a[k] = load<T>(r + k * lanes);
    for (int c = 0; c < 3; ++c) {
      for (int a = 1; a < 4; ++a) {
        Real d[lanes];
        for (int l = 0; l < lanes; ++l)
          d[l] = static_cast<Real>(x(v[a * lanes + l], c) - x(v[l], c));
        edges(c, a - 1) = load<T>(d);
      }
    }
    T const weight = T(scale) * load<T>(r + 9 * lanes);
    auto state = Material::evaluate(Material::cast<T>(lame), edges * B);
    Material::weigh(state, weight);
    Mat3<T> const stress = Material::stress(state);
    for (int a = 0; a < 4; ++a) {
      Vec3<T> const b = kernels::shape_gradient(B, a);
      int const* const at = v + (a + 1) % 4 * lanes;
      add(stress * b, at, g);
      add(Material::diagonal(state, b), at, diagonal);
    }
  }
  KOKKOS_FUNCTION static void add(Vec3<T> const& what, int const* v,
                                  VectorField<Real, S> const& to) {
    for (int c = 0; c < 3; ++c)
      for (int l = 0; l < lanes; ++l) Kokkos::atomic_add(&to(v[l], c), lane(what[c], l));
  }
};

/// p'Hp of packs that stay in cache, many times over.
template <class Real, bool by_packs>
struct QuadraticForms {
  static constexpr int lanes = host_lanes<Real>, packs = 64, rounds = 64;
  Lame<double> lame;
  Kokkos::View<Real*, Kokkos::HostSpace> data;  ///< [pack][F by columns, dF by columns][lane]
  Kokkos::View<Real*, Kokkos::HostSpace> sums;  ///< [task][lane]

  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T form(Lame<double> const& lame, Real const* from) {
    Mat3<T> F, dF;
    for (int k = 0; k < 9; ++k) F.a[k] = load<T>(from + k * lanes);
    for (int k = 0; k < 9; ++k) dF.a[k] = load<T>(from + (9 + k) * lanes);
    return Material::quadratic(Material::evaluate(Material::cast<T>(lame), F), dF);
  }

  void operator()(int task) const {
    alignas(64) Real sum[lanes] = {};
    for (int round = 0; round < rounds; ++round) {
      for (int pack = 0; pack < packs; ++pack) {
        Real const* from = data.data() + pack * 18 * lanes;
        if constexpr (by_packs) {
          using T = HostPack<Real>;
          store(T(load<T>(sum) + form<T>(lame, from)), sum);
        } else {
#pragma omp simd
          for (int l = 0; l < lanes; ++l) sum[l] += form<Real>(lame, from + l);
        }
      }
    }
    for (int l = 0; l < lanes; ++l) sums(task * lanes + l) = sum[l];
  }
};

template <class P>
class VariantBench {
public:
  using Real = typename P::real;

  VariantBench(BenchBody const& body, MachineRates const& machine, double seconds)
      : body_(body), machine_(machine), seconds_(seconds) {}

  void add_rows(std::vector<BenchRow>& rows) const {
    rows.push_back(dots<Reducer<S, typename P::sum>>("dots"));
    rows.push_back(dots<FreeReducer<S, typename P::sum>>("dots_free"));
    rows.push_back(atomic_gradient());
    if constexpr (S::on_host) {
      rows.push_back(quadratic<true>("quadratic_pack"));
      rows.push_back(quadratic<false>("quadratic_loop"));
    }
  }

private:
  template <class Run>
  BenchRow row(char const* kernel, char const* material, SweepCounts const& counts, double tets,
               Run const& run) const {
    run();
    BenchRow row{material, P::name, machine_.threads, int(body_.rest.tets.size()), kernel};
    row.ns_per_tet = 1e9 * best_seconds(seconds_, run) / tets;
    row.bytes = counts.bytes;
    row.flops = counts.flops;
    row.fraction = limit_ns(machine_, P::name, counts) / row.ns_per_tet;
    return row;
  }

  template <class Sum>
  BenchRow dots(char const* kernel) const {
    FiveDots<P> const terms{bench_field<Real>(body_, bench_position),
                            bench_field<Real>(body_, bench_direction),
                            bench_field<Real>(body_, bench_direction)};
    int const n = static_cast<int>(body_.rest.points.size());
    Sum const reducer(n, 5);
    double const v = body_.vertices_per_tet();
    return row(kernel, "-", {v * 9 * sizeof(Real), v * 30}, double(body_.rest.tets.size()),
               [&] { reducer.template sum<5>(kernel, n, terms); });
  }

  BenchRow atomic_gradient() const {
    using Kernel = AtomicGradient<P>;
    constexpr int lanes = Kernel::lanes;
    int const packs = static_cast<int>(body_.rest.tets.size()) / lanes;  // the rest is left out
    std::vector<int> corner(std::size_t(packs) * 4 * lanes);
    std::vector<Real> rest(std::size_t(packs) * 10 * lanes);
    for (int e = 0; e < packs * lanes; ++e) {
      Tet const& tet = body_.rest.tets[e];
      RestShape const shape = rest_shape(body_.rest.points, tet);
      std::size_t const pack = e / lanes, l = e % lanes;
      for (int a = 0; a < 4; ++a) corner[(pack * 4 + a) * lanes + l] = tet[a];
      for (int k = 0; k < 9; ++k)
        rest[(pack * 10 + k) * lanes + l] = static_cast<Real>(shape.B.a[k]);
      rest[(pack * 10 + 9) * lanes + l] = static_cast<Real>(shape.W);
    }
    auto const x = bench_field<typename P::position>(body_, bench_position);
    VectorField<Real, S> const g("g", x.extent(0)), d("d", x.extent(0));
    Kernel const gradient{to_space<S>("corner", corner),
                          to_space<S>("rest", rest),
                          x,
                          g,
                          d,
                          lame_parameters(1e5, 0.4),
                          Real(1e-4)};
    SweepCounts const counts =
        count_elastic(Material::name, P::name, body_.vertices_per_tet()).gradient;
    return row("gradient_atomic", Material::name, counts, double(packs) * lanes, [&] {
      for_each<S>("gradient_atomic", packs, gradient);
      Kokkos::fence("taut: bench");
    });
  }

  template <bool by_packs>
  BenchRow quadratic(char const* kernel) const {
    using Kernel = QuadraticForms<Real, by_packs>;
    int const tasks = 16 * machine_.threads;
    Kernel const forms{lame_parameters(1e5, 0.4),
                       {"bench_data", std::size_t(Kernel::packs) * 18 * Kernel::lanes},
                       {"bench_sums", std::size_t(tasks) * Kernel::lanes}};
    for (std::size_t k = 0; k < forms.data.extent(0); ++k) {
      bool const diagonal = k / Kernel::lanes % 18 % 4 == 0 && k / Kernel::lanes % 18 < 9;
      forms.data(k) = Real((diagonal ? 1 : 0) + 1e-3 * double(k % 97));
    }
    // F and dF are given, and nothing comes from memory.
    SweepCounts const whole = count_elastic(Material::name, P::name, 0).quadratic_form;
    SweepCounts const counts{0, whole.flops - 2 * 54};
    double const tets = double(tasks) * Kernel::rounds * Kernel::packs * Kernel::lanes;
    return row(kernel, Material::name, counts, tets, [&] {
      for_each<S>(kernel, tasks, forms);
      Kokkos::fence("taut: bench");
    });
  }

  BenchBody const& body_;
  MachineRates const& machine_;
  double seconds_;
};

}  // namespace

double limit_ns(MachineRates const& machine, std::string_view precision,
                SweepCounts const& counts) {
  double const rate = precision == "fp64" ? machine.fma64 : machine.fma32;
  return std::max(counts.bytes / machine.triad, counts.flops / rate);
}

void measure_variants(BenchOptions const& options, MachineRates const& machine,
                      std::vector<BenchRow>& rows) {
  int const tets = *std::min_element(options.tets.begin(), options.tets.end(), [](int a, int b) {
    return std::abs(a - 500'000) < std::abs(b - 500'000);
  });
  BenchBody const body(tets);
  for (std::string const& precision : options.precisions) {
    if (precision == "fp32") VariantBench<Fp32>(body, machine, options.seconds).add_rows(rows);
    if (precision == "mixed") VariantBench<Mixed>(body, machine, options.seconds).add_rows(rows);
    if (precision == "fp64") VariantBench<Fp64>(body, machine, options.seconds).add_rows(rows);
  }
}

}  // namespace taut
