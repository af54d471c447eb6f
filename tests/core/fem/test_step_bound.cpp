// How far a step may go before an element inverts: the sweeps against the root of each element's
// cubic, for slivers, crushed elements, elements far from the origin of their patch and either
// numbering, in every precision.
#include "elastic_oracle.hpp"

#include <taut/core/math/cubic.hpp>
#include <taut/core/potential/any_terms.hpp>
#include <taut/core/report/error.hpp>
#include <taut/presets/elastic.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <random>

using namespace taut;

namespace {

using Host = Space<Kokkos::DefaultHostExecutionSpace>;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Separate tets along a line of a given length, each with its own start and direction.
struct Crowd {
  TetMesh rest;
  std::vector<Point> x, p;
};

/// `flatness`: heights are 10^-u with u up to this, at rest (`thin_rest`) or only in x.
Crowd crowd(int tets, double length, double flatness, bool thin_rest, bool mirrored,
            unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Crowd c;
  for (int t = 0; t < tets; ++t) {
    double const at = length * t / tets;
    double const thickness = std::pow(10, -flatness * unit(engine));
    Point const corners[4] = {{0, 0, 0}, {1, 0, 0}, {0.3, 0.9, 0}, {0.4, 0.3, 0.8}};
    Tet tet;
    for (int a = 0; a < 4; ++a) {
      Point X = corners[a], x = corners[a], p;
      if (thin_rest) X[2] *= thickness;
      x[2] *= thickness;
      for (int k = 0; k < 3; ++k) {
        // Everything turns with t, so that no axis is special.
        X[k] += 0.01 * unit(engine) * (thin_rest ? thickness : 1);
        x[k] += 0.01 * unit(engine) * thickness;
        p[k] = 2 * unit(engine) - 1;
      }
      double const s = std::sin(0.1 * t), o = std::cos(0.1 * t);
      x = {at + o * x[0] - s * x[2], x[1], s * x[0] + o * x[2]};
      tet[a] = static_cast<int>(c.rest.points.size());
      c.rest.points.push_back(X);
      c.x.push_back(x);
      c.p.push_back(p);
    }
    if (mirrored && t % 2 == 1) std::swap(tet[2], tet[3]);
    c.rest.tets.push_back(tet);
  }
  return c;
}

/// The first inversion along p of any tet, one by one.
template <class Positions, class Vectors>
double first_inversion(TetMesh const& rest, Positions const& x, Vectors const& p) {
  double first = infinity;
  for (Tet const& tet : rest.tets) {
    Mat3<double> X, D, d;
    for (int a = 0; a < 3; ++a)
      for (int c = 0; c < 3; ++c) {
        X(c, a) = rest.points[tet[a + 1]][c] - rest.points[tet[0]][c];
        D(c, a) = double(x(tet[a + 1], c)) - double(x(tet[0], c));
        d(c, a) = double(p(tet[a + 1], c)) - double(p(tet[0], c));
      }
    double const sign = determinant(X) < 0 ? -1 : 1;
    double const root =
        smallest_positive_root(sign * determinant(D), sign * contract(cofactor(D), d),
                               sign * contract(D, cofactor(d)), sign * determinant(d));
    first = std::min(first, root);
  }
  return first;
}

}  // namespace

TEMPLATE_TEST_CASE("no step bound lies beyond the first inversion", "[fem]", Fp64, Mixed, Fp32) {
  using Term = ElasticTets<Elastic<NeoHookean>, TestType, Host>;
  for (bool thin_rest : {false, true})
    for (double flatness : {0., 3., 6.})
      for (double length : {1., 1e3}) {
        // A few tets, so that each decides now and then.
        for (unsigned seed = 0; seed < 20; ++seed) {
          Crowd const c = crowd(12, length, flatness, thin_rest, seed % 2 == 1, seed);
          Term const term(c.rest, lame_parameters(1e5, 0.3));
          auto const x = test::to_field(c.x, typename Term::Positions());
          auto const p = test::to_field(c.p, typename Term::Vectors());
          double const first = first_inversion(c.rest, x, p);
          CAPTURE(thin_rest, flatness, length, seed, first);
          double const half = Term::margin * first;
          for (double at_most : {0.1 * half, 0.9 * half, 0.999 * half, 2 * half, infinity}) {
            double const bound = term.max_step(x, p, at_most);
            double const exact = std::min(at_most, half);
            CHECK(std::abs(bound - exact) <= 1e-9 * exact);
            CHECK(term.max_prescribed_step(x, p, at_most) == bound);
          }
        }
      }
}

TEMPLATE_TEST_CASE("what p'Hp certifies inverts no element, in either direction", "[fem]", Fp64,
                   Mixed, Fp32) {
  using Term = ElasticTets<Elastic<NeoHookean>, TestType, Host>;
  bool const coarse = std::is_same_v<typename TestType::real, float>;
  for (bool thin_rest : {false, true})
    for (double flatness : {0., 3., 6.})
      for (double length : {1., 1e3})
        for (unsigned seed = 0; seed < 20; ++seed) {
          Crowd const c = crowd(12, length, flatness, thin_rest, seed % 2 == 1, seed);
          Term const term(c.rest, lame_parameters(1e5, 0.3));
          auto const x = test::to_field(c.x, typename Term::Positions());
          auto const p = test::to_field(c.p, typename Term::Vectors());
          auto const back = test::to_field(c.p, typename Term::Vectors());
          for (std::size_t i = 0; i < c.p.size(); ++i)
            for (int k = 0; k < 3; ++k) back(i, k) = -back(i, k);
          double certified = infinity;
          double const form = term.quadratic_form(x, p, 1.0, certified);
          double const first =
              std::min(first_inversion(c.rest, x, p), first_inversion(c.rest, x, back));
          CAPTURE(thin_rest, flatness, length, seed, first, certified);
          // Where rounding has inverted an element, the energy and its form are not numbers.
          if (certified > 0) CHECK(form == term.quadratic_form(x, p, 1.0));
          CHECK((certified < first || certified == 0));
          // It is the norm of F^-1 dF that counts, where the inversion sees an eigenvalue: for the
          // worst of twelve tets they are not far apart.
          if (flatness == 0 && (!coarse || length == 1)) CHECK(certified > 0.1 * first);
          // It vouches for steps up to its length, and says nothing about longer ones.
          double const spared = 0.999 * Term::margin * certified;
          CHECK(term.max_step(x, p, spared, certified) == spared);
          CHECK(term.max_step(x, p, infinity, certified) == term.max_step(x, p, infinity));
          double lower = 1e-30;
          term.quadratic_form(x, p, 1.0, lower);
          CHECK(lower <= 1e-30);  // lowered, not overwritten
        }
}

TEST_CASE("a certificate is for numbers within range", "[fem]") {
  // Squares that overflow or vanish in fp32, and what is not a number, certify nothing.
  using Term = ElasticTets<Elastic<NeoHookean>, Fp32, Host>;
  Crowd const c = crowd(16, 1, 0, false, false, 1);
  Term const term(c.rest, lame_parameters(1e5, 0.3));
  auto const certify = [&](double size, double motion) {
    auto x = test::to_field(c.x, Term::Positions());
    auto const p = test::to_field(c.p, Term::Vectors());
    for (std::size_t i = 0; i < c.x.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        x(i, k) *= float(size);
        p(i, k) *= float(motion);
      }
    double certified = infinity;
    term.quadratic_form(x, p, 1.0, certified);
    double const first = first_inversion(c.rest, x, p);
    CAPTURE(size, motion, first);
    CHECK(certified < first);
    return certified;
  };
  double const usual = certify(1, 1);
  CHECK(usual > 0);
  for (double motion : {1e-12, 1e-6, 1e6, 1e12}) {
    double const certified = certify(1, motion);
    CHECK(certified <= 1.01 * usual / motion);
    CHECK(certified >= 0.5 * usual / motion);
  }
  for (double size : {1e-12, 1e-7, 1e8, 1e12}) CHECK(certify(size, size) == 0);
  CHECK(certify(1, 1e30) == 0);
  for (double size : {1e-2, 1e2}) CHECK(std::abs(certify(size, size) / usual - 1) < 0.01);

  auto const x = test::to_field(c.x, Term::Positions());
  auto const p = test::to_field(c.p, Term::Vectors());
  p(37, 2) = std::numeric_limits<float>::quiet_NaN();
  double certified = infinity;
  term.quadratic_form(x, p, 1.0, certified);
  CHECK(certified == 0);
}

TEST_CASE("a list of terms certifies for those of its terms that can", "[fem]") {
  Crowd const c = crowd(12, 1, 1, false, false, 3), d = crowd(12, 1, 1, false, false, 4);
  auto const lame = lame_parameters(1e5, 0.3);
  ElasticTets<Elastic<NeoHookean>> const first(c.rest, lame), second(d.rest, lame);
  ElasticTets<Elastic<StableNeoHookean>> const tolerant(c.rest, lame);
  auto const x = test::to_field(c.x, VectorField<double, DefaultSpace>());
  auto const p = test::to_field(c.p, VectorField<float, DefaultSpace>());
  auto const of = [&](auto const& term) {
    double certified = infinity;
    term.quadratic_form(x, p, 1.0, certified);
    return certified;
  };
  AnyTerms<> free, both;
  free.add(tolerant);
  both.add(first);
  both.add(tolerant);
  both.add(second);
  CHECK(of(tolerant) == infinity);
  CHECK(of(free) == infinity);
  CHECK(of(both) == std::min(of(first), of(second)));
  CHECK(both.max_step(x, p, infinity, of(both)) == both.max_step(x, p, infinity));
  CHECK(both.max_step(x, p, 0.5 * of(both), of(both)) == 0.5 * of(both));
}

TEST_CASE("a direction that is not a number allows no step", "[fem]") {
  using Term = ElasticTets<Elastic<NeoHookean>, Mixed, Host>;
  Crowd const c = crowd(40, 10, 1, false, false, 1);
  Term const term(c.rest, lame_parameters(1e5, 0.3));
  auto const x = test::to_field(c.x, Term::Positions());
  auto const p = test::to_field(c.p, Term::Vectors());
  for (int v : {0, 77, 159}) {
    auto const kept = p(v, 1);
    p(v, 1) = std::numeric_limits<float>::quiet_NaN();
    CHECK(term.max_step(x, p, 2.0) == 0);
    p(v, 1) = kept;
  }
}

TEST_CASE("elastic terms refuse meshes that they cannot hold", "[fem]") {
  using Term = ElasticTets<Elastic<NeoHookean>, Fp64, Host>;
  Crowd c = crowd(3, 1, 0, false, false, 1);
  auto const lame = lame_parameters(1e5, 0.3);
  CHECK_THROWS_AS(Term(c.rest, lame, {.patch_size = 0}), Error);
  CHECK_THROWS_AS(Term(c.rest, lame, {.patch_size = 4097}), Error);
  CHECK_THROWS_AS(Term(c.rest, {lame}, {0, 1, 0}), Error);
  CHECK_THROWS_AS(Term(c.rest, {lame}, {0, 0}), Error);
  Term const term(c.rest, lame, {.patch_size = 4096});
  FixedMask<Host> const fixed("fixed", 11);
  Term::Vectors const g("g", 11);
  CHECK_THROWS_AS(term.add_gradient(test::to_field(c.x, Term::Positions()), 1, fixed, g), Error);
  c.rest.tets[1][2] = 12;
  CHECK_THROWS_AS(Term(c.rest, lame), Error);
}
