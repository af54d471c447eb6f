// The patch sweeps against the serial oracle: every kernel, every precision, both layouts, any team
// and patch size; and the guarantee that the number of threads does not change a bit.
#include "elastic_oracle.hpp"

#include <taut/core/fem/elastic_tets.hpp>
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/materials/models.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <omp.h>

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Body {
  TetMesh rest;
  std::vector<Point> x;
  std::vector<Point> p;
  std::vector<int> material_of_tet;

  explicit Body(int resolution = 6, double jitter = 0.02) {
    TetMesh const mesh = make_shape(BoxShape{{1, 1.2, 0.9}}, resolution);
    Ordering const order = locality_order(mesh);
    for (int v : order.vertices) rest.points.push_back(mesh.points[v]);
    for (int t : order.tets) {
      Tet tet;
      for (int a = 0; a < 4; ++a) tet[a] = order.new_vertex[mesh.tets[t][a]];
      rest.tets.push_back(tet);
      material_of_tet.push_back(rest.points[tet[0]][1] > 0 ? 1 : 0);
    }
    std::vector<Point> const noise = test::random_points(rest.points.size(), jitter, 3);
    p = test::random_points(rest.points.size(), 1, 4);
    for (std::size_t i = 0; i < rest.points.size(); ++i) {
      Point const& X = rest.points[i];
      // A twist and a stretch, far from the origin.
      double const angle = 0.8 * X[1], c = std::cos(angle), s = std::sin(angle);
      x.push_back({3 + 1.1 * (c * X[0] - s * X[2]) + noise[i][0], -7 + 0.9 * X[1] + noise[i][1],
                   1.1 * (s * X[0] + c * X[2]) + noise[i][2]});
    }
    // Tets come in groups of one material.
    std::stable_sort(rest.tets.begin(), rest.tets.end(), [&](Tet const& a, Tet const& b) {
      return (rest.points[a[0]][1] > 0) < (rest.points[b[0]][1] > 0);
    });
    std::sort(material_of_tet.begin(), material_of_tet.end());
  }
};

std::vector<Lame<double>> const two_materials = {lame_parameters(1e4, 0.3),
                                                 lame_parameters(1e5, 0.45)};

double largest(std::vector<Point> const& field) {
  double m = 0;
  for (Point const& p : field)
    for (double c : p) m = std::max(m, std::abs(c));
  return m;
}

template <class View>
auto host(View const& v) {
  return Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), v);
}

/// Compares every sweep with the oracle, to `tolerance` relative to the largest entry.
template <class Material, class Precision, class S>
void compare(Body const& body, SweepParams const& params, double tolerance) {
  using Term = ElasticTets<Material, Precision, S>;
  Term const term(body.rest, two_materials, body.material_of_tet, params);
  test::ElasticOracle<typename Material::Model, typename Material::Filter> const oracle{
      body.rest, two_materials, body.material_of_tet};
  std::size_t const n = body.rest.points.size();
  double const scale = 0.25, alpha = 1e-3;
  auto const x = test::to_field(body.x, typename Term::Positions());
  auto const p = test::to_field(body.p, typename Term::Vectors());
  FixedMask<S> const fixed("fixed", n);
  typename Term::Vectors const g("g", n), d("d", n), hp("hp", n);
  typename Term::Blocks const h("h", n);

  CHECK_THAT(term.value(x, scale), WithinRel(scale * oracle.value(body.x), tolerance));
  CHECK_THAT(term.quadratic_form(x, p, scale),
             WithinRel(scale * oracle.quadratic_form(body.x, body.p), tolerance));
  std::vector<Point> moved = body.x;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) moved[i][c] += alpha * body.p[i][c];
  double const change = scale * (oracle.value(moved) - oracle.value(body.x));
  CHECK_THAT(term.change(x, p, alpha, scale), WithinRel(change, std::max(100 * tolerance, 1e-9)));

  auto const close = [&](auto const& field, std::vector<Point> const& expected) {
    auto const f = host(field);
    double const unit = scale * largest(expected);
    double worst = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(double(f(i, c)) - scale * expected[i][c]) / unit);
      }
    CHECK(worst < tolerance);
  };
  auto const clear = [&] {
    Kokkos::deep_copy(g, 0);
    Kokkos::deep_copy(d, 0);
    Kokkos::deep_copy(h, 0);
  };
  clear();
  term.add_gradient(x, scale, fixed, g);
  close(g, oracle.gradient(body.x));
  clear();
  term.add_gradient(x, scale, fixed, g, d);
  close(g, oracle.gradient(body.x));
  close(d, oracle.diagonal(body.x));
  clear();
  auto const arrived = test::to_field(moved, typename Term::Positions());
  CHECK_THAT(term.add_gradient_after(arrived, p, alpha, scale, fixed, g, h),
             WithinRel(change, std::max(100 * tolerance, 1e-9)));
  close(g, oracle.gradient(moved));
  auto const blocks = oracle.blocks(moved);
  auto const hh = host(h);
  double unit = 0, worst = 0;
  for (auto const& b : blocks)
    for (double e : b.s) unit = std::max(unit, std::abs(e));
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 6; ++k) {
      worst = std::max(worst, std::abs(double(hh(i, k)) / scale - blocks[i].s[k]) / unit);
    }
  CHECK(worst < tolerance);
  Kokkos::deep_copy(hp, 0);
  term.add_product(x, p, scale, fixed, hp);
  close(hp, oracle.product(body.x, body.p));
}

using Right = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutRight>;
using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;

}  // namespace

TEMPLATE_TEST_CASE("sweeps agree with the serial oracle", "[fem]", Elastic<StableNeoHookean>,
                   Elastic<FixedCorotated>, (Elastic<Arap, LimitLambda>),
                   (Elastic<StableNeoHookean2018, FullProjection>)) {
  Body const body;
  SECTION("fp64") { compare<TestType, Fp64, Right>(body, {}, 1e-11); }
  SECTION("mixed") { compare<TestType, Mixed, Right>(body, {}, 2e-4); }
}

TEST_CASE("neo-Hookean sweeps agree with the serial oracle", "[fem]") {
  Body const body(6, 0.002);  // no inverted element
  compare<Elastic<NeoHookean>, Fp64, Right>(body, {}, 1e-11);
  compare<Elastic<NeoHookean>, Fp32, Right>(body, {}, 1e-3);
}

TEST_CASE("sweeps do not depend on layout, patch or team size", "[fem]") {
  Body const body;
  using Material = Elastic<FixedCorotated>;
  compare<Material, Fp64, Left>(body, {.patch_size = 64}, 1e-11);
  compare<Material, Fp64, Right>(body, {.patch_size = 37, .team_size = 1}, 1e-11);

  // Bitwise: the shape of every sum is that of the patches alone.
  auto const gradient = [&]<class S>(SweepParams const& params) {
    ElasticTets<Material, Mixed, S> const term(body.rest, two_materials, body.material_of_tet,
                                               params);
    auto const x = test::to_field(body.x, VectorField<double, S>());
    auto const p = test::to_field(body.p, VectorField<float, S>());
    FixedMask<S> const fixed("fixed", body.x.size());
    VectorField<float, S> const g("g", body.x.size());
    BlockField<float, S> const h("h", body.x.size());
    double const change = term.add_gradient_after(x, p, 1e-3, 1.0, fixed, g, h);
    std::vector<double> all = {change, term.value(x, 1), term.quadratic_form(x, p, 1)};
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      for (int c = 0; c < 3; ++c) all.push_back(g(i, c));
      for (int c = 0; c < 6; ++c) all.push_back(h(i, c));
    }
    return all;
  };
  auto const expected = gradient.operator()<Right>({});
  CHECK(gradient.operator()<Left>({}) == expected);
  CHECK(gradient.operator()<Right>({.patch_size = 256, .team_size = 2}) == expected);
  CHECK(gradient.operator()<Right>({}) == expected);
  int const threads = omp_get_max_threads();
  omp_set_num_threads(1);
  CHECK(gradient.operator()<SerialSpace>({}) == expected);
  omp_set_num_threads(threads);
}

TEST_CASE("the assembled Hessian is the matrix-free one, and fixed rows are left alone", "[fem]") {
  Body const body;
  using Term = ElasticTets<Elastic<FixedCorotated>, Fp64>;
  std::vector<double> const mass(body.x.size(), 2.0);
  Unknowns<Fp64> const unknowns(mass, 0.1);
  for (std::size_t i = 0; i < body.x.size(); i += 5) unknowns.fixed(i) = 1;
  Potential potential(unknowns, Inertia(unknowns), Term(body.rest, two_materials[1]));
  potential.begin_step(0.01, 0.1, true);
  auto const x = test::to_field(body.x, Term::Positions());
  auto const p = test::to_field(body.p, Term::Vectors());
  for (std::size_t i = 0; i < body.x.size(); i += 5)
    for (int c = 0; c < 3; ++c) p(i, c) = 0;
  Term::Vectors const free("free", body.x.size()), assembled("assembled", body.x.size());
  potential.product(x, p, free);
  auto const matrix = potential.pattern();
  potential.assemble(x, matrix);
  product(matrix, p, assembled);
  double size = 0, worst = 0;
  for (std::size_t i = 0; i < body.x.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      size = std::max(size, std::abs(free(i, c)));
      worst = std::max(worst, std::abs(free(i, c) - assembled(i, c)));
      if (i % 5 == 0) CHECK(free(i, c) == 0);
    }
  CHECK(worst < 1e-12 * size);
  CHECK(asymmetry(matrix) < 1e-14);
}

TEST_CASE("the largest step stops where the first tet is flat", "[fem]") {
  Body const body(4, 0.0);
  using Term = ElasticTets<Elastic<NeoHookean>, Fp64>;
  Term const term(body.rest, two_materials[0]);
  auto const x = test::to_field(body.rest.points, Term::Positions());
  auto const p = test::to_field(body.p, Term::Vectors());
  double const infinity = std::numeric_limits<double>::infinity();
  double const bound = term.max_step(x, p, infinity);
  // Asked for less, it says that less is valid; for a little more, it finds the bound.
  for (double part : {1e-3, 0.5, 0.999}) CHECK(term.max_step(x, p, part * bound) == part * bound);
  CHECK(term.max_step(x, p, 1.001 * bound) == bound);
  auto const smallest_volume = [&](double t) {
    double smallest = 1e300;
    for (Tet const& tet : body.rest.tets) {
      Mat3<double> D;
      for (int a = 0; a < 3; ++a)
        for (int c = 0; c < 3; ++c) {
          D(c, a) = x(tet[a + 1], c) - x(tet[0], c) + t * (p(tet[a + 1], c) - p(tet[0], c));
        }
      smallest = std::min(smallest, determinant(D));
    }
    return smallest;
  };
  double const rest = smallest_volume(0);
  for (double part : {0.2, 0.5, 0.9, 0.999}) CHECK(smallest_volume(part * bound) > 0);
  CHECK_THAT(smallest_volume(bound), WithinAbs(0, 1e-12 * rest));
  CHECK(smallest_volume(1.001 * bound) < 0);
  // A translation and an expansion are free.
  for (std::size_t i = 0; i < body.x.size(); ++i)
    for (int c = 0; c < 3; ++c) p(i, c) = 1 + x(i, c);
  CHECK(term.max_step(x, p, infinity) == infinity);
}

TEST_CASE("where a cubic first vanishes", "[fem]") {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  CHECK(smallest_positive_root(1, 0, 0, 0) == infinity);
  CHECK(smallest_positive_root(1, 1, 1, 1) == infinity);
  CHECK(smallest_positive_root(0, 1, 0, 0) == 0);
  CHECK(smallest_positive_root(1, std::nan(""), 0, 0) == 0);
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 100000; ++k) {
    // Roots of known size; the polynomial is scaled to be positive at 0.
    double const size = std::pow(10.0, 6 * uniform(rng));
    double r[3] = {size * uniform(rng), size * uniform(rng), size * uniform(rng)};
    if (k % 10 == 0) r[1] = r[0];  // double roots: touched, perhaps not crossed
    double const s = -r[0] * r[1] * r[2] > 0 ? 1 : -1;
    double const a = -s * r[0] * r[1] * r[2], b = s * (r[0] * r[1] + r[1] * r[2] + r[2] * r[0]),
                 c = -s * (r[0] + r[1] + r[2]);
    double expected = infinity;
    for (double root : r) expected = root > 0 ? std::min(expected, root) : expected;
    double const found = smallest_positive_root(a, b, c, s);
    if (k % 10 == 0 && found > expected * (1 + 1e-6)) {
      // A double root may be missed by rounding, where the polynomial only touches zero.
      CHECK_THAT(r[0], WithinRel(expected, 1e-6));
      continue;
    }
    CHECK_THAT(found, WithinRel(expected, 1e-6));
  }
}
