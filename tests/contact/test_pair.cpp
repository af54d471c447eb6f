// The energy of a pair: value -> gradient -> curvature by finite differences in long double, for
// every feature, barrier, mollifier and curvature; and what holds of every force.
#include "pair_energies.hpp"

#include <catch2/catch_test_macros.hpp>

#include <algorithm>

using namespace taut;
using namespace taut::test::pairs;

namespace {

template <class T>
SquareMatrix<T, 12> assembled(PairState<T> const& s, auto const& block) {
  SquareMatrix<T, 12> h;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      Mat3<T> const m = block(s, a, b);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) h(3 * a + i, 3 * b + j) = m(i, j);
    }
  return h;
}

template <class T>
T form(SquareMatrix<T, 12> const& h, Vec3<T> const (&p)[4]) {
  T sum = 0;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) sum += p[i / 3][i % 3] * h(i, j) * p[j / 3][j % 3];
  return sum;
}

template <class T, int N>
T largest(SquareMatrix<T, N> const& h) {
  T r = 0;
  for (T const& entry : h.a) r = std::max(r, std::abs(entry));
  return r;
}

template <class T, int N>
T least_eigenvalue(SquareMatrix<T, N> const& h) {
  auto const eigen = symmetric_eigen(h);
  return *std::min_element(eigen.values, eigen.values + N);
}

template <class T>
T least_eigenvalue(Sym3<T> const& h) {
  return symmetric_eigen(h).values[2];
}

template <class Curvature>
auto const blocks = [](auto const& s, int a, int b) { return Curvature::block(s, a, b); };

// How far a sample can move, as a share of `p`, for finite differences.
Wide step_for(Sample const& s) { return 1e-3L * std::min(s.gap, s.parameters.activation - s.gap); }

}  // namespace

TEST_CASE("gradients are those of the energy", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, ExactCurvature, M>;
    for_every_feature(11, 5, [](Sample const& sample, Random& random) {
      Path const path(sample.y, random);
      auto const s = path.state<Energy>(sample, 0);
      REQUIRE(s.at.feature == sample.feature);
      REQUIRE(s.m.active ==
              (sample.kind == PairKind::edge_edge && std::is_same_v<M, EdgeMollifier>));
      Wide slope = 0, size = 0;
      for (int a = 0; a < 4; ++a) {
        slope += dot(Energy::gradient(s, a), path.p[a]);
        size += norm(Energy::gradient(s, a)) * norm(path.p[a]);
      }
      auto const energy = [&](Wide t) { return Energy::value(path.state<Energy>(sample, t)); };
      INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature));
      CHECK(std::abs(central(energy, step_for(sample)) - slope) < 1e-9L * size);
    });
  });
}

TEST_CASE("the exact curvature is the derivative of the gradient", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, ExactCurvature, M>;
    for_every_feature(12, 5, [](Sample const& sample, Random& random) {
      Path const path(sample.y, random);
      auto const s = path.state<Energy>(sample, 0);
      auto const h = assembled(s, blocks<ExactCurvature>);
      INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature));
      for (int a = 0; a < 4; ++a) {
        auto const gradient = [&](Wide t) {
          return Energy::gradient(path.state<Energy>(sample, t), a);
        };
        Vec3<Wide> const slope = central(gradient, step_for(sample));
        Vec3<Wide> product{};
        for (int b = 0; b < 4; ++b) product = product + ExactCurvature::block(s, a, b) * path.p[b];
        CHECK(norm(slope - product) < 1e-8L * largest(h));
      }
      for (int i = 0; i < 12; ++i)
        for (int j = 0; j < i; ++j) REQUIRE(std::abs(h(i, j) - h(j, i)) < 1e-15L * largest(h));
    });
  });
}

TEST_CASE("forms and blocks of every curvature agree", "[contact]") {
  for_every_energy([]<class B, class M>() {
    for_every_feature(13, 5, [](Sample const& sample, Random& random) {
      Path const path(sample.y, random);
      auto const check = [&]<class Curvature>() {
        auto const s = path.state<PairEnergy<B, Curvature, M>>(sample, 0);
        auto const h = assembled(s, blocks<Curvature>);
        INFO(B::name << ", " << Curvature::name << ", feature " << int(sample.feature));
        CHECK(std::abs(Curvature::form(s, path.p) - form(h, path.p)) < 1e-15L * largest(h));
      };
      check.template operator()<TruncatedCurvature>();
      check.template operator()<ExactCurvature>();
      check.template operator()<GaussNewtonCurvature>();
    });
  });
}

TEST_CASE("what a solver gets of a curvature is positive and not below it", "[contact]") {
  for_every_energy([]<class B, class M>() {
    for_every_feature(14, 3, [](Sample const& sample, Random& random) {
      auto const check = [&]<class Curvature>() {
        using Energy = PairEnergy<B, Curvature, M>;
        INFO(B::name << ", " << Curvature::name << ", feature " << int(sample.feature));
        auto const s = Energy::evaluate(sample.kind, sample.parameters, sample.y);
        auto const raw = assembled(s, blocks<Curvature>), h = Energy::hessian(s);
        double const round_off = 1e-13 * largest(raw);
        CHECK(least_eigenvalue(h) > -round_off);
        Vec3<double> p[4];
        for (auto& v : p) v = uniform_vector(random);
        CHECK(Energy::quadratic(s, p) >= 0);
        CHECK(Energy::quadratic(s, p) <= form(h, p) + round_off);
        CHECK(std::abs(Energy::quadratic(s, p) - std::max(0.0, form(raw, p))) < round_off);
        for (int a = 0; a < 4; ++a) {
          Sym3<double> const block = Energy::block(s, a);
          Vec3<double> const diagonal = Energy::diagonal(s, a);
          CHECK(least_eigenvalue(block) > -round_off);
          CHECK(quadratic(block, p[a]) > dot(p[a], Curvature::block(s, a, a) * p[a]) - round_off);
          for (int k = 0; k < 3; ++k) {
            CHECK(diagonal[k] >= 0);
            CHECK(std::abs(diagonal[k] - std::max(0.0, Curvature::block(s, a, a)(k, k))) <
                  round_off);
          }
        }
      };
      check.template operator()<TruncatedCurvature>();
      check.template operator()<ExactCurvature>();
      check.template operator()<GaussNewtonCurvature>();
    });
  });
}

TEST_CASE("the truncated curvature is the exact one where nothing slides, else below it",
          "[contact]") {
  for_every_energy([]<class B, class M>() {
    for_every_feature(15, 10, [](Sample const& sample, Random& random) {
      Path const path(sample.y, random);
      auto const s = path.state<PairEnergy<B, ExactCurvature, M>>(sample, 0);
      Wide const truncated = TruncatedCurvature::form(s, path.p);
      Wide const exact = ExactCurvature::form(s, path.p);
      Feature const f = sample.feature;
      bool const slides =
          !(f >= Feature::a0_b0 || (f >= Feature::vertex_0 && f <= Feature::vertex_2));
      INFO(B::name << ", feature " << int(f));
      if (slides) {
        CHECK(truncated < exact);
      } else {
        Wide const size = largest(assembled(s, blocks<ExactCurvature>));
        CHECK(std::abs(truncated - exact) < 1e-16L * size);
      }
    });
  });
}

TEST_CASE("the Gauss-Newton curvature is that of F(w, d) with w and d linear, or above it",
          "[contact]") {
  int equal = 0;
  for_every_energy([&]<class B, class M>() {
    for_every_feature(16, 5, [&](Sample const& other, Random& random) {
      Sample const sample(random, other.feature, 1, 1e-3);  // F is convex only close to contact
      Path const path(sample.y, random);
      auto const s = path.state<PairEnergy<B, GaussNewtonCurvature, M>>(sample, 0);
      Wide const found = GaussNewtonCurvature::form(s, path.p);
      Wide const closing = dot(s.n, kernels::combine(s.at.c, path.p));
      INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature));
      if (!s.m.active) {
        CHECK(std::abs(found - s.b2 * square(closing)) <= 1e-16L * found);
        return;
      }
      Vec3<Wide> const dw = s.m.change_of_w(path.p);
      auto const F = [&](Wide t) {
        Vec3<Wide> const w = s.m.w + t * dw;
        Wide const q = dot(w, w);
        auto const b = evaluate_barrier<B>(s.at.distance + t * closing, s.activation);
        return Wide(sample.parameters.stiffness) * b.value * q * (2 - q);
      };
      Wide const h = 1e-3L * std::min<Wide>(sample.gap, s.activation - sample.gap) /
                     (1 + std::abs(closing) + norm(dw));
      Wide const second = (16 * (F(h) + F(-h)) - (F(2 * h) + F(-2 * h)) - 30 * F(0)) / (12 * h * h);
      Wide const size = std::abs(s.b2) * square(closing) + s.b * dot(dw, dw) +
                        std::abs(s.b1 * closing) * norm(dw);
      CHECK(found > second - 1e-8L * size);
      equal += std::abs(found - second) < 1e-8L * size;
    });
  });
  CHECK(equal > 20);
}

TEST_CASE("forces of a pair cancel, and so do their moments", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, GaussNewtonCurvature, M>;
    for_every_feature(17, 5, [](Sample const& sample, Random&) {
      auto const check = [&]<class T>() {
        Vec3<T> y[4];
        for (int a = 0; a < 4; ++a) y[a] = cast<T>(sample.y[a]);
        auto const s = Energy::evaluate(sample.kind, sample.parameters_in<T>(), y);
        Vec3<Wide> sum{}, moment{};
        Wide size = 0;
        for (int a = 0; a < 4; ++a) {
          Vec3<Wide> const g = cast<Wide>(Energy::gradient(s, a));
          sum = sum + g;
          moment = moment + cross(cast<Wide>(y[a]), g);
          size += norm(g);
        }
        Wide const round_off = 8 * std::numeric_limits<T>::epsilon() * size;
        INFO(B::name << ", feature " << int(sample.feature));
        CHECK(size > 0);
        CHECK(norm(sum) < round_off);
        CHECK(norm(moment) < 2 * sample.size * round_off);
      };
      check.template operator()<double>();
      check.template operator()<float>();
    });
  });
}

TEST_CASE("a pair does not see translations, and its forces turn with it", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, ExactCurvature, M>;
    for_every_feature(18, 3, [](Sample const& sample, Random& random) {
      Vec3<double> const axis = uniform_direction(random), shift = uniform_vector(random, 3);
      double const angle = uniform(random, -3, 3);
      auto const turn = [&](Vec3<double> const& v) {  // Rodrigues
        return std::cos(angle) * v + std::sin(angle) * cross(axis, v) +
               ((1 - std::cos(angle)) * dot(axis, v)) * axis;
      };
      Vec3<double> there[4], p[4], q[4];
      for (int a = 0; a < 4; ++a) {
        there[a] = turn(sample.y[a]) + shift;
        p[a] = uniform_vector(random);
        q[a] = turn(p[a]);
      }
      auto const s = Energy::evaluate(sample.kind, sample.parameters, sample.y);
      auto const r = Energy::evaluate(sample.kind, sample.parameters, there);
      INFO(B::name << ", feature " << int(sample.feature));
      // Positions are rounded to 1e-15 of edges that are up to 100 times the gap.
      CHECK(std::abs(Energy::value(s) / Energy::value(r) - 1) < 1e-11);
      double size = 0;
      for (int a = 0; a < 4; ++a) size = std::max(size, norm(Energy::gradient(s, a)));
      for (int a = 0; a < 4; ++a) {
        CHECK(norm(turn(Energy::gradient(s, a)) - Energy::gradient(r, a)) < 1e-11 * size);
      }
      double const scale = largest(assembled(s, blocks<ExactCurvature>));
      CHECK(std::abs(ExactCurvature::form(s, p) - ExactCurvature::form(r, q)) < 1e-10 * scale);
    });
  });
}

TEST_CASE("the mollifier takes the jump of the force away where edges become parallel",
          "[contact]") {
  // Edge b lies above edge a and is turned about the middle of the overlap: the closest points jump
  // from one end of the overlap to the other.
  auto const forces = []<class Energy>(double angle) {
    Vec3<double> const middle{0.7, 0, 0.05}, along{std::cos(angle), std::sin(angle), 0};
    double const tilt = 1e-3 * angle;  // lowers one end, whichever side it is turned to
    Vec3<double> const y[4] = {{0, 0, 0},
                               {1, 0, 0},
                               middle - 0.3 * along - Vec3<double>{0, 0, tilt},
                               middle + 0.8 * along + Vec3<double>{0, 0, tilt}};
    double const scale = EdgeMollifier::scale(y);
    auto const s = Energy::evaluate(PairKind::edge_edge, PairParameters<double>{1, 0.1, scale}, y);
    std::array<Vec3<double>, 4> g;
    for (int a = 0; a < 4; ++a) g[std::size_t(a)] = Energy::gradient(s, a);
    return g;
  };
  auto const jump = [&]<class Energy>() {
    auto const left = forces.template operator()<Energy>(-1e-7);
    auto const right = forces.template operator()<Energy>(1e-7);
    double largest_jump = 0;
    for (std::size_t a = 0; a < 4; ++a)
      largest_jump = std::max(largest_jump, norm(left[a] - right[a]));
    return largest_jump;
  };
  double const plain =
      jump.template operator()<PairEnergy<LogBarrier, GaussNewtonCurvature, NoMollifier>>();
  double const mollified =
      jump.template operator()<PairEnergy<LogBarrier, GaussNewtonCurvature, EdgeMollifier>>();
  CHECK(plain > 0.05);
  CHECK(mollified < 1e-5 * plain);
}

TEST_CASE("the mollifier ends at the threshold of the rest lengths, smoothly", "[contact]") {
  Vec3<double> const rest[4] = {{0, 0, 0}, {2, 0, 0}, {0, 0, 1}, {0, 3, 1}};
  double const scale = EdgeMollifier::scale(rest);
  auto const at_sine = [&](double sine) {
    Vec3<double> const y[4] = {
        {0, 0, 0}, {2, 0, 0}, {0, 0, 1}, {3 * std::sqrt(1 - sine * sine), 3 * sine, 1}};
    return EdgeMollifier::evaluate(y, scale);
  };
  double const end = std::sqrt(EdgeMollifier::default_threshold);
  CHECK_FALSE(at_sine(1.0001 * end).active);
  CHECK(at_sine(1.0001 * end).value == 1);
  CHECK(at_sine(0.9999 * end).active);
  CHECK(std::abs(at_sine(0.9999 * end).value - 1) < 1e-7);
  CHECK(at_sine(0.9999 * end).first < 1e-3);
  CHECK(std::abs(at_sine(0.5 * end).value - 0.25 * 1.75) < 1e-14);
  CHECK(at_sine(0).value == 0);
  CHECK(at_sine(0).active);
  // Exactly parallel edges have a curvature without NaN.
  using Energy = PairEnergy<>;
  Vec3<double> const parallel[4] = {{0, 0, 0}, {2, 0, 0}, {0, 0, 1}, {3, 0, 1}};
  auto const s =
      Energy::evaluate(PairKind::edge_edge, PairParameters<double>{1, 2, scale}, parallel);
  auto const h = Energy::hessian(s);
  CHECK(Energy::value(s) == 0);
  CHECK(largest(h) > 0);
  CHECK(std::isfinite(largest(h)));
  CHECK(least_eigenvalue(h) > -1e-14 * largest(h));
  for (int a = 0; a < 4; ++a) CHECK(norm(Energy::gradient(s, a)) == 0);
}

TEST_CASE("a pair beyond its activation distance has no energy, force or curvature", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, ExactCurvature, M>;
    for_every_feature(19, 1, [](Sample const& sample, Random& random) {
      auto parameters = sample.parameters;
      parameters.activation = 0.999 * sample.gap;
      auto const s = Energy::evaluate(sample.kind, parameters, sample.y);
      Vec3<double> p[4];
      for (auto& v : p) v = uniform_vector(random);
      CHECK(Energy::value(s) == 0);
      CHECK(Energy::quadratic(s, p) == 0);
      CHECK(largest(Energy::hessian(s)) == 0);
      for (int a = 0; a < 4; ++a) CHECK(norm(Energy::gradient(s, a)) == 0);
    });
  });
}
