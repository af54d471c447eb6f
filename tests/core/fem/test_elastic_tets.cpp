// Elastic bodies beyond single sweeps: the guarantee that layout, teams and the number of threads
// do not change a bit, differences (F3), balance of forces (F2), the assembled Hessian and the
// largest step.
#include "elastic_samples.hpp"

#include <support/threads.hpp>
#include <taut/core/fem/body.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/sparse/operations.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Everything that the sweeps of a body give, number after number. The material is none of
/// presets/: those are compiled with other flags, for one space alone.
template <class S>
std::vector<double> all_results(Sample const& body, SweepParams const& params) {
  ElasticTets<Elastic<FixedCorotated, LimitLambda>, Mixed, S> const term(
      body.rest, two_materials, body.material_of_tet, params);
  std::size_t const n = body.x.size();
  auto const x = test::to_field(body.x, VectorField<double, S>());
  auto const p = test::to_field(body.p, VectorField<float, S>());
  FixedMask<S> const fixed("fixed", n);
  std::vector<double> all = {term.value(x, 1), term.change(x, p, 1e-3, 1),
                             term.quadratic_form(x, p, 1), term.max_prescribed_step(x, p, 1.0)};
  auto const append = [&](auto const& field) {
    auto const f = host(field);
    for (std::size_t i = 0; i < f.extent(0); ++i)
      for (std::size_t c = 0; c < f.extent(1); ++c) all.push_back(f(i, c));
  };
  // One gradient per mode of curvature.
  VectorField<float, S> const none("none", n), diagonal("diagonal", n), blocks("blocks", n),
      d("d", n), hp("hp", n);
  BlockField<float, S> const h("h", n);
  all.push_back(term.add_gradient_after(x, p, 1e-3, 1.0, fixed, none));
  all.push_back(term.add_gradient_after(x, p, 1e-3, 1.0, fixed, diagonal, d));
  all.push_back(term.add_gradient_after(x, p, 1e-3, 1.0, fixed, blocks, h));
  term.add_product(x, p, 1.0, fixed, hp);
  for (auto const& field : {none, diagonal, blocks, d, hp}) append(field);
  append(h);
  return all;
}

}  // namespace

TEST_CASE("sweeps are bitwise the same for any layout, team size and number of threads", "[fem]") {
  // The shape of every sum is that of the patches alone.
  Sample const body;
  auto const expected = all_results<Right>(body, {});
  CHECK(expected[3] > 0);  // the step to the first flat tet
  CHECK(expected[3] < 1);
  for (int team : test::team_sizes<Right>()) {
    CHECK(all_results<Right>(body, {.patch_size = 512, .team_size = team}) == expected);
    CHECK(all_results<Left>(body, {.patch_size = 512, .team_size = team}) == expected);
  }
  test::on_one_thread([&] { CHECK(all_results<Right>(body, {}) == expected); });
  CHECK(all_results<SerialSpace>(body, {}) == expected);
}

TEST_CASE("F3: central differences of a mesh's energy and forces close in at second order",
          "[fem]") {
  Sample body;
  // Stretched a little, where nothing is projected.
  std::vector<Point> const noise = test::random_points(body.x.size(), 1e-3, 5);
  for (std::size_t i = 0; i < body.x.size(); ++i)
    for (int c = 0; c < 3; ++c) body.x[i][c] = 1.03 * body.rest.points[i][c] + noise[i][c];
  using Term = ElasticTets<Elastic<FixedCorotated>, Fp64, Right>;
  Term const term(body.rest, two_materials, body.material_of_tet);
  std::size_t const n = body.x.size();
  auto const p = test::to_field(body.p, Term::Vectors());
  FixedMask<Right> const fixed("fixed", n);
  auto const at = [&](double t) {
    auto const x = test::to_field(body.x, Term::Positions());
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) x(i, c) += t * p(i, c);
    return x;
  };
  auto const gradient = [&](double t) {
    Term::Vectors const g("g", n);
    term.add_gradient(at(t), 1.0, fixed, g);
    return g;
  };
  auto const g = gradient(0);
  Term::Vectors const hp("hp", n);
  term.add_product(at(0), p, 1.0, fixed, hp);
  double slope = 0, curvature = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      slope += g(i, c) * p(i, c);
      curvature += p(i, c) * hp(i, c);
    }
  CHECK_THAT(term.quadratic_form(at(0), p, 1), WithinRel(curvature, 1e-12));
  auto const energy_error = [&](double h) {
    return std::abs((term.value(at(h), 1) - term.value(at(-h), 1)) / (2 * h) - slope);
  };
  auto const force_error = [&](double h) {
    auto const after = gradient(h), before = gradient(-h);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        sum += square((after(i, c) - before(i, c)) / (2 * h) - hp(i, c));
      }
    return std::sqrt(sum);
  };
  CHECK_THAT(std::log2(energy_error(2e-3) / energy_error(1e-3)), WithinAbs(2, 0.1));
  CHECK_THAT(std::log2(force_error(2e-3) / force_error(1e-3)), WithinAbs(2, 0.1));
}

TEST_CASE("F2: elastic forces have neither a resultant nor a torque", "[fem]") {
  Sample const body;
  using Term = ElasticTets<Elastic<FixedCorotated>, Fp64, Right>;
  Term const term(body.rest, two_materials, body.material_of_tet);
  std::size_t const n = body.x.size();
  auto const x = test::to_field(body.x, Term::Positions());
  FixedMask<Right> const fixed("fixed", n);
  Term::Vectors const g("g", n);
  term.add_gradient(x, 1.0, fixed, g);
  Vec3<double> force{}, torque{};
  double force_size = 0, torque_size = 0;
  for (std::size_t i = 0; i < n; ++i) {
    Vec3<double> const f = {g(i, 0), g(i, 1), g(i, 2)}, r = {x(i, 0), x(i, 1), x(i, 2)};
    force = force + f;
    torque = torque + cross(r, f);
    force_size += norm(f);
    torque_size += norm(r) * norm(f);
  }
  CHECK(norm(force) < 1e-14 * force_size);
  CHECK(norm(torque) < 1e-14 * torque_size);

  // A body that was turned rigidly bears no forces at all.
  Sample turned;
  double const c = std::cos(2.0), s = std::sin(2.0);
  for (std::size_t i = 0; i < n; ++i) {
    Point const& X = turned.rest.points[i];
    turned.x[i] = {c * X[0] - s * X[1] + 5, s * X[0] + c * X[1], X[2] - 3};
  }
  assign(g, 0);
  term.add_gradient(test::to_field(turned.x, Term::Positions()), 1.0, fixed, g);
  double largest_force = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) largest_force = std::max(largest_force, std::abs(g(i, k)));
  CHECK(largest_force < 1e-11 * force_size);
}

TEST_CASE("a shuffled mesh gives the same results in the input's order", "[fem]") {
  TetMesh const mesh = make_shape(BoxShape{{1, 1.2, 0.9}}, 5);
  std::size_t const n = mesh.points.size();
  std::mt19937 random(8);
  std::vector<std::int32_t> to(n);
  for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<std::int32_t>(i);
  std::shuffle(to.begin(), to.end(), random);
  TetMesh shuffled = mesh;
  for (std::size_t i = 0; i < n; ++i) shuffled.points[to[i]] = mesh.points[i];
  for (Tet& tet : shuffled.tets)
    for (std::int32_t& v : tet) v = to[v];
  std::shuffle(shuffled.tets.begin(), shuffled.tets.end(), random);

  auto const forces = [&](TetMesh const& input) {
    Body<Fp64, Right> const body(input, 1000);
    CHECK(body.in_input_order(body.positions()) == input.points);
    ElasticTets<Elastic<FixedCorotated>, Fp64, Right> const term(body.rest, two_materials[0]);
    auto const x = body.positions();
    for (std::size_t i = 0; i < n; ++i) {
      double const X = x(i, 0), Y = x(i, 1), Z = x(i, 2);
      x(i, 0) = 1.1 * X + 0.3 * Y * Y;
      x(i, 1) = Y + 0.2 * std::sin(3 * Z);
      x(i, 2) = 0.8 * Z - 0.1 * X * Y;
    }
    FixedMask<Right> const fixed("fixed", n);
    VectorField<double, Right> const g("g", n);
    term.add_gradient(x, 1.0, fixed, g);
    return body.in_input_order(g);
  };
  auto const expected = forces(mesh), found = forces(shuffled);
  double const unit = largest(expected);
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(found[to[i]][c] - expected[i][c]));
    }
  CHECK(worst < 1e-13 * unit);
}

TEST_CASE("the assembled Hessian is the matrix-free one, and fixed rows are left alone", "[fem]") {
  Sample const body;
  using Term = ElasticTets<Elastic<FixedCorotated>, Fp64, Right>;
  std::vector<double> const mass(body.x.size(), 2.0);
  Unknowns<Fp64, Right> const unknowns(mass, 0.1);
  for (std::size_t i = 0; i < body.x.size(); i += 5) unknowns.fixed(i) = 1;
  Potential potential(unknowns, Inertia(unknowns), Term(body.rest, two_materials[1]));
  auto const x = test::to_field(body.x, Term::Positions());
  potential.begin_step(x, 0.01, 0.1, true);
  auto const p = test::to_field(body.p, Term::Vectors());
  for (std::size_t i = 0; i < body.x.size(); i += 5)
    for (int c = 0; c < 3; ++c) p(i, c) = 0;
  Term::Vectors const free("free", body.x.size()), assembled("assembled", body.x.size());
  potential.product(x, p, free);
  auto const matrix = potential.pattern(x);
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
  Sample const body(4, 0.0);
  using Term = ElasticTets<Elastic<NeoHookean>, Fp64, Right>;
  Term const term(body.rest, two_materials[0]);
  auto const x = test::to_field(body.rest.points, Term::Positions());
  auto const p = test::to_field(body.p, Term::Vectors());
  double const infinity = std::numeric_limits<double>::infinity();
  double const bound = term.max_step(x, p, infinity);
  // Asked for less, it says that less is valid; for a little more, it finds the bound.
  for (double part : {1e-3, 0.5, 0.999}) CHECK(term.max_step(x, p, part * bound) == part * bound);
  CHECK(term.max_step(x, p, 1.001 * bound) == bound);
  double const first = bound / Term::margin;
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
  for (double part : {0.2, 0.5, 0.9, 0.999}) CHECK(smallest_volume(part * first) > 0);
  CHECK_THAT(smallest_volume(first), WithinAbs(0, 1e-12 * rest));
  CHECK(smallest_volume(1.001 * first) < 0);
  // A translation and an expansion are free.
  for (std::size_t i = 0; i < body.x.size(); ++i)
    for (int c = 0; c < 3; ++c) p(i, c) = 1 + x(i, c);
  CHECK(term.max_step(x, p, infinity) == infinity);
}
