// Homogeneous deformations, for which linear elements are exact whatever the mesh (F1, F2 and F10
// of the benchmark list).
#include "problem.hpp"

#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Lame<double> const material = lame_parameters(1e5, 0.3);

std::set<Point> boundary_points(TetMesh const& mesh) {
  std::set<Point> points;
  for (Triangle const& face : boundary_faces(mesh.tets)) {
    for (int v : face) points.insert(mesh.points[v]);
  }
  return points;
}

/// The mesh with its vertices inside moved by up to `size` cells, vertices and tets in any order.
TetMesh scrambled(TetMesh mesh, double size, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> noise(-size, size);
  auto const outside = boundary_points(mesh);
  for (Point& p : mesh.points) {
    if (outside.contains(p)) continue;
    for (double& c : p) c += noise(rng);
  }
  std::vector<std::int32_t> to(mesh.points.size());
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), rng);
  TetMesh mixed{mesh.points, mesh.tets};
  for (std::size_t v = 0; v < to.size(); ++v) mixed.points[to[v]] = mesh.points[v];
  for (Tet& tet : mixed.tets) {
    for (std::int32_t& v : tet) v = to[v];
    std::rotate(tet.begin(), tet.begin() + 1, tet.begin() + 3);  // an even permutation
  }
  std::shuffle(mixed.tets.begin(), mixed.tets.end(), rng);
  REQUIRE(inverted_tets(mixed, mixed.points).empty());
  return mixed;
}

Vec3<double> vec(Point const& p) { return {p[0], p[1], p[2]}; }

/// An affine map on the boundary; inside, anything but.
template <class Model, class P>
void patch_test(TetMesh const& mesh, double tolerance) {
  INFO(Model::name << " in " << P::name);
  Mat3<double> const A = {{1.1, 0.05, -0.1, 0.2, 0.9, 0.0, 0.0, -0.15, 1.05}};
  auto const outside = boundary_points(mesh);
  auto problem = ElasticProblem<P>::template make<Model>(
      mesh, material, [&](Point const& X) { return outside.contains(X); });
  using Position = typename P::position;
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> noise(-0.01, 0.01);
  std::size_t const n = problem.rest.points.size();
  REQUIRE(n > outside.size() + 20);
  std::vector<Vec3<double>> exact(n);
  for (std::size_t i = 0; i < n; ++i) {
    exact[i] = A * vec(problem.rest.points[i]);
    for (int c = 0; c < 3; ++c) {
      problem.unknowns.prescribed(i, c) = static_cast<Position>(exact[i][c]);
      problem.x(i, c) =
          static_cast<Position>(exact[i][c] + (problem.unknowns.fixed(i) ? 0 : noise(rng)));
    }
  }
  auto const report = problem.solve();
  CHECK((report.converged() || report.stop == Stop::stalled));
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(double(problem.x(i, c)) - exact[i][c]));
    }
  INFO(report.iterations << " iterations, " << to_string(report.stop));
  CHECK(worst < tolerance);  // the meshes are of size one
}

/// Rotation by a vector's length about its direction.
Mat3<double> rotation(Vec3<double> const& w) {
  double const angle = norm(w);
  RigidMap const map = rotation_about({w[0] / angle, w[1] / angle, w[2] / angle}, angle, {});
  Mat3<double> R;
  for (int a = 0; a < 3; ++a) {
    Point e{};
    e[a] = 1;
    Point const column = map(e);
    for (int c = 0; c < 3; ++c) R(c, a) = column[c];
  }
  return R;
}

/// Largest force, and the sums of forces and of torques relative to those of their sizes.
struct ForceSums {
  double largest = 0, force = 0, torque = 0;
};
template <class P>
ForceSums sums(ElasticProblem<P> const& problem) {
  auto const f = problem.elastic_forces();
  Vec3<double> force{}, torque{};
  double forces = 0, torques = 0;
  ForceSums s;
  for (std::size_t i = 0; i < problem.rest.points.size(); ++i) {
    Vec3<double> const x{problem.x(i, 0), problem.x(i, 1), problem.x(i, 2)};
    Vec3<double> const fi{f(i, 0), f(i, 1), f(i, 2)};
    force = force + fi;
    torque = torque + cross(x, fi);
    forces += norm(fi);
    torques += norm(x) * norm(fi);
    s.largest = std::max(s.largest, norm(fi));
  }
  s.force = norm(force) / forces;
  s.torque = norm(torque) / torques;
  return s;
}

template <class Model, class P>
void rigid_motion_test(TetMesh const& mesh, double tolerance) {
  INFO(Model::name << " in " << P::name);
  auto problem =
      ElasticProblem<P>::template make<Model>(mesh, material, [](Point const&) { return false; });
  std::size_t const n = problem.rest.points.size();
  Mat3<double> const R = rotation({1.1, -2.0, 0.7});
  Vec3<double> const shift{0.3, -0.2, 0.5};
  auto const place = [&](auto const& map) {
    for (std::size_t i = 0; i < n; ++i) {
      Vec3<double> const x = map(vec(problem.rest.points[i]));
      for (int c = 0; c < 3; ++c) problem.x(i, c) = static_cast<typename P::position>(x[c]);
    }
  };
  // Bent, twisted and pressed, not far from a third of the size of the body.
  auto const bend = [](Vec3<double> const& X) {
    return Vec3<double>{X[0] + 0.3 * X[1] * X[1], 0.8 * X[1] + 0.2 * X[2] * X[0],
                        X[2] - 0.25 * X[0] * X[1] + 0.1 * X[0]};
  };
  place(bend);
  auto const bent = sums(problem);
  auto const f = problem.elastic_forces();
  double const energy = problem.terms.value(problem.x, 1);
  CHECK(bent.force < tolerance);
  CHECK(bent.torque < tolerance);

  // Forces and energy go with the body.
  place([&](Vec3<double> const& X) { return R * bend(X) + shift; });
  auto const turned = problem.elastic_forces();
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) {
    Vec3<double> const expected = R * Vec3<double>{f(i, 0), f(i, 1), f(i, 2)};
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(turned(i, c) - expected[c]));
  }
  CHECK(worst < 10 * tolerance * bent.largest);
  CHECK_THAT(problem.terms.value(problem.x, 1), WithinRel(energy, 10 * tolerance));
  CHECK(sums(problem).torque < tolerance);

  // A turn alone costs nothing.
  place([&](Vec3<double> const& X) { return R * X + shift; });
  CHECK(sums(problem).largest < 10 * tolerance * bent.largest);
  CHECK(std::abs(problem.terms.value(problem.x, 1)) < 10 * tolerance * energy);
}

/// Total elastic force on the face X_axis = 1/2 of the unit cube under x = F X, N. What the edges
/// bear of the neighbouring faces cancels by symmetry.
template <class Model>
Vec3<double> traction(Mat3<double> const& F, Lame<double> const& lame, int axis) {
  auto problem = ElasticProblem<>::make<Model>(make_shape(BoxShape{}, 2), lame,
                                               [](Point const&) { return false; });
  std::size_t const n = problem.rest.points.size();
  for (std::size_t i = 0; i < n; ++i) {
    Vec3<double> const x = F * vec(problem.rest.points[i]);
    for (int c = 0; c < 3; ++c) problem.x(i, c) = x[c];
  }
  auto const f = problem.elastic_forces();
  Vec3<double> total{};
  for (std::size_t i = 0; i < n; ++i) {
    if (problem.rest.points[i][axis] < 0.5 - 1e-9) continue;
    total = total + Vec3<double>{f(i, 0), f(i, 1), f(i, 2)};
  }
  return total;
}

/// First Piola stress in closed form, from F, its cofactor, its rotation and its volume ratio.
template <class Model>
Mat3<double> closed_form(Lame<double> const& m, Mat3<double> const& F, Mat3<double> const& C,
                         Mat3<double> const& R, double J) {
  if constexpr (std::same_as<Model, Arap>) {
    return (2 * m.mu) * (F - R);
  } else if constexpr (std::same_as<Model, FixedCorotated>) {
    return (2 * m.mu) * (F - R) + (m.lambda * (J - 1)) * C;
  } else if constexpr (std::same_as<Model, NeoHookean>) {
    return m.mu * F + ((m.lambda * std::log(J) - m.mu) / J) * C;
  } else if constexpr (std::same_as<Model, StableNeoHookean>) {
    return m.mu * F + (m.lambda * (J - 1) - m.mu) * C;
  } else {
    double const mu = 4.0 / 3 * m.mu, lambda = m.lambda + 5.0 / 6 * m.mu;
    double const I2 = contract(F, F), alpha = 1 + 0.75 * mu / lambda;
    return (mu * (1 - 1 / (I2 + 1))) * F + (lambda * (J - alpha)) * C;
  }
}

}  // namespace

TEST_CASE("F1: the patch test is exact on any mesh, for any material", "[truth]") {
  TetMesh const regular = make_shape(BoxShape{}, 4);
  TetMesh const irregular = scrambled(make_shape(SphereShape{}, 4), 0.03, 5);
  for (TetMesh const* mesh : {&regular, &irregular}) {
    INFO(mesh->tets.size() << " tets");
    ElasticModels::for_each([&]<class Model>() {
      patch_test<Model, Fp64>(*mesh, 1e-12);
      patch_test<Model, Fp32>(*mesh, 1e-6);
    });
  }
}

TEST_CASE("F2: forces of a free body have no sum and no torque, and turn with it", "[truth]") {
  TetMesh const mesh = scrambled(make_shape(SphereShape{}, 4), 0.02, 6);
  ElasticModels::for_each([&]<class Model>() {
    rigid_motion_test<Model, Fp64>(mesh, 1e-13);
    rigid_motion_test<Model, Fp32>(mesh, 1e-5);
  });
}

TEST_CASE("F10: homogeneous deformations bear the load of the closed form", "[truth]") {
  // A stretch in three directions, and a simple shear, whose rotation is by atan(g / 2).
  double const a = 1.3, b = 0.9, c = 0.8, g = 0.6, cosine = 1 / std::hypot(1, g / 2),
               sine = cosine * g / 2;
  Mat3<double> const stretch = {{a, 0, 0, 0, b, 0, 0, 0, c}};
  Mat3<double> const stretch_cofactor = {{b * c, 0, 0, 0, c * a, 0, 0, 0, a * b}};
  Mat3<double> shear = identity3<double>(), shear_cofactor = identity3<double>(),
               turn = identity3<double>();
  shear(0, 1) = g;
  shear_cofactor(1, 0) = -g;
  turn(0, 0) = turn(1, 1) = cosine;
  turn(0, 1) = sine;
  turn(1, 0) = -sine;
  ElasticModels::for_each([&]<class Model>() {
    INFO(Model::name);
    for (int axis = 0; axis < 3; ++axis) {
      auto const check = [&](Mat3<double> const& F, Mat3<double> const& P) {
        Vec3<double> const force = traction<Model>(F, material, axis);
        for (int k = 0; k < 3; ++k) CHECK_THAT(force[k], WithinAbs(P(k, axis), 1e-11 * 1e5));
      };
      check(stretch, closed_form<Model>(material, stretch, stretch_cofactor, identity3<double>(),
                                        a * b * c));
      check(shear, closed_form<Model>(material, shear, shear_cofactor, turn, 1));
    }
  });
}

TEST_CASE("F10: nearly incompressible neo-Hookean under tension", "[truth]") {
  // Cauchy stress mu (l^2 - 1 / l) where the sides are free.
  Lame<double> const lame = lame_parameters(1e5, 0.4999);
  for (double l : {0.6, 1.5, 3.0}) {
    INFO("stretch " << l);
    // The sides contract until nothing pulls at them.
    double w = 1 / std::sqrt(l);
    for (int k = 0; k < 20; ++k) {
      double const pull = lame.mu * (w * w - 1) + lame.lambda * std::log(l * w * w);
      w -= pull / (2 * lame.mu * w + 2 * lame.lambda / w);
    }
    Mat3<double> const F = {{l, 0, 0, 0, w, 0, 0, 0, w}};
    CHECK_THAT(traction<NeoHookean>(F, lame, 1)[1], WithinAbs(0, 1e-8 * lame.lambda));
    double const stress = traction<NeoHookean>(F, lame, 0)[0] / (w * w);
    CHECK_THAT(stress, WithinRel(lame.mu * (l * l - 1 / l), 2e-3));
  }
}
