// Pairs in fp64 and fp32 against long double: energies, forces, and changes of energy.
#include "pair_energies.hpp"

#include <catch2/catch_test_macros.hpp>

using namespace taut;
using namespace taut::test::pairs;

namespace {

using Energies = std::array<Vec3<Wide>, 4>;

// Relative to which round-off of a pair counts: its edges over its gap, as distances are known to
// round-off of the edges, times how steep the barrier is, which is a power of the room.
Wide conditioning(Sample const& s) {
  return (4 * s.size / s.gap) / (1 - s.gap / s.parameters.activation);
}

template <class Energy, class T, class Position>
void compare(Sample const& sample, Vec3<Position> const (&y)[4], Random& random) {
  Vec3<Wide> wide[4], p_wide[4];
  Vec3<T> p[4];
  for (int a = 0; a < 4; ++a) {
    wide[a] = cast<Wide>(y[a]);
    p[a] = cast<T>(uniform_vector(random));
    p_wide[a] = cast<Wide>(p[a]);
  }
  auto const parameters = sample.parameters_in<T>();
  PairParameters<Wide> const exact_parameters{parameters.stiffness, parameters.activation,
                                              parameters.mollifier_scale};
  auto const s = Energy::evaluate(sample.kind, parameters, y);
  auto const r = Energy::evaluate(sample.kind, exact_parameters, wide);
  Wide const round_off = 8 * std::numeric_limits<T>::epsilon() * conditioning(sample);
  CHECK(s.at.feature == r.at.feature);
  CHECK(std::abs(Energy::value(s) - Energy::value(r)) < round_off * Energy::value(r));
  Wide force = 0;
  for (int a = 0; a < 4; ++a) force += norm(Energy::gradient(r, a));
  for (int a = 0; a < 4; ++a) {
    Vec3<Wide> const error = cast<Wide>(Energy::gradient(s, a)) - Energy::gradient(r, a);
    CHECK(norm(error) < round_off * force);
  }
  Wide size = 0;
  for (Wide const& h : Energy::hessian(r).a) size = std::max(size, std::abs(h));
  for (int a = 0; a < 4; ++a) size = std::max(size, force * norm(p_wide[a]) / sample.gap);
  CHECK(std::abs(Energy::quadratic(s, p) - Energy::quadratic(r, p_wide)) < 10 * round_off * size);
}

// Integral of g . step along the step, five Gauss points.
template <class Energy>
Wide integrated_change(PairKind kind, PairParameters<Wide> const& parameters,
                       Vec3<Wide> const (&y)[4], Vec3<Wide> const (&step)[4]) {
  constexpr Wide node[5] = {-0.906179845938663992797626878299L, -0.538469310105683091036314420700L,
                            0, 0.538469310105683091036314420700L,
                            0.906179845938663992797626878299L};
  constexpr Wide weight[5] = {0.236926885056189087514264040720L, 0.478628670499366468041291514836L,
                              128.0L / 225, 0.478628670499366468041291514836L,
                              0.236926885056189087514264040720L};
  Wide sum = 0;
  for (int k = 0; k < 5; ++k) {
    Vec3<Wide> z[4];
    for (int a = 0; a < 4; ++a) z[a] = y[a] - ((1 - node[k]) / 2) * step[a];
    auto const s = Energy::evaluate(kind, parameters, z);
    for (int a = 0; a < 4; ++a) sum += weight[k] / 2 * dot(Energy::gradient(s, a), step[a]);
  }
  return sum;
}

}  // namespace

TEST_CASE("energies, forces and curvatures in fp64 and fp32 are exact to round-off", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, GaussNewtonCurvature, M>;
    for_every_feature(31, 4, [](Sample const& unscaled, Random& random) {
      // From millimetres to kilometres.
      Sample const sample(random, unscaled.feature, log_uniform(random, 1e-3, 1e3));
      INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature));
      compare<Energy, double>(sample, sample.y, random);
      Vec3<float> rounded[4];
      for (int a = 0; a < 4; ++a) rounded[a] = cast<float>(sample.y[a]);
      compare<Energy, float>(sample, rounded, random);
    });
  });
}

TEST_CASE("kernels in fp32 see differences of fp64 positions, wherever they are", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, GaussNewtonCurvature, M>;
    for_every_feature(32, 4, [](Sample const& sample, Random& random) {
      Vec3<double> const far = uniform_vector(random, 1e6);
      Vec3<double> y[4];
      for (int a = 0; a < 4; ++a) y[a] = sample.y[a] + far;
      INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature));
      compare<Energy, float>(sample, y, random);
    });
  });
}

TEST_CASE("changes of energy are exact where differences cancel", "[contact]") {
  for_every_energy([]<class B, class M>() {
    using Energy = PairEnergy<B, GaussNewtonCurvature, M>;
    for_every_feature(33, 3, [](Sample const& sample, Random& random) {
      auto const check = [&]<class T>(double length) {
        Vec3<T> y[4], step[4];
        Vec3<Wide> after[4], before[4], moved[4];
        for (int a = 0; a < 4; ++a) {
          y[a] = cast<T>(sample.y[a]);
          step[a] = cast<T>(uniform_vector(random, length * sample.gap));
          after[a] = cast<Wide>(y[a]);
          moved[a] = cast<Wide>(step[a]);
          before[a] = after[a] - moved[a];
        }
        auto const parameters = sample.parameters_in<T>();
        PairParameters<Wide> const exact_parameters{parameters.stiffness, parameters.activation,
                                                    parameters.mollifier_scale};
        auto const s = Energy::evaluate(sample.kind, parameters, y);
        Wide const found = Energy::change(sample.kind, parameters, s, step);
        auto const r = Energy::evaluate(sample.kind, exact_parameters, after);
        auto const r0 = Energy::evaluate(sample.kind, exact_parameters, before);
        Wide const exact =
            length > 1e-3 ? Energy::value(r) - Energy::value(r0)
                          : integrated_change<Energy>(sample.kind, exact_parameters, after, moved);
        // What the change would be if all forces did work.
        Wide work = std::abs(exact);
        for (int a = 0; a < 4; ++a) {
          work += norm(Energy::gradient(r, a)) * norm(moved[a]);
          work += norm(Energy::gradient(r0, a)) * norm(moved[a]);
        }
        INFO(B::name << ", mollifier " << M::name << ", feature " << int(sample.feature)
                     << ", length " << length << ", " << sizeof(T) << " bytes");
        Wide const round_off = 8 * std::numeric_limits<T>::epsilon() * conditioning(sample);
        CHECK(std::abs(found - exact) < (round_off + 1e-12L) * work);
        CHECK(work > 0);
      };
      for (double const length : {3.0, 0.3, 1e-2, 1e-5, 1e-9, 1e-13}) {
        check.template operator()<double>(length);
        check.template operator()<float>(length);
      }
    });
  });
}

TEST_CASE("changes of energy add up along a path that enters and leaves contact", "[contact]") {
  using Energy = PairEnergy<>;
  Random random(34);
  for (int k = 0; k < 20; ++k) {
    // A point drops on a triangle and passes its edge; nearly parallel edges turn over each other.
    bool const point = k % 2 == 0;
    PairKind const kind = point ? PairKind::point_triangle : PairKind::edge_edge;
    PairParameters<double> const parameters{1, 0.1, 1 / (0.1 * 1)};
    double const slope = uniform(random, -0.2, 0.2);
    auto const at = [&](double t, Vec3<double>(&y)[4]) {
      double const height = 0.02 + 0.1 * square(2 * t - 1);
      if (point) {
        Vec3<double> const z[4] = {
            {-0.2 + t, 0.1 + slope * t, height}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        for (int a = 0; a < 4; ++a) y[a] = z[a];
      } else {
        double const turn = 0.3 * (2 * t - 1);
        Vec3<double> const z[4] = {
            {0, 0, 0}, {1, 0, 0}, {0.2, -turn, height}, {0.8, turn + 1e-3, height + slope * 0.01}};
        for (int a = 0; a < 4; ++a) y[a] = z[a];
      }
    };
    double sum = 0, largest = 0;
    int const steps = 1000;
    for (int n = 1; n <= steps; ++n) {
      Vec3<double> before[4], after[4], step[4];
      at(double(n - 1) / steps, before);
      at(double(n) / steps, after);
      for (int a = 0; a < 4; ++a) step[a] = after[a] - before[a];
      auto const s = Energy::evaluate(kind, parameters, after);
      sum += Energy::change(kind, parameters, s, step);
      largest = std::max(largest, Energy::value(s));
      REQUIRE(std::abs(sum - Energy::value(s)) < 1e-13 * (largest + 1e-6));
    }
    CHECK(largest > 1e-6);
    CHECK(std::abs(sum) < 1e-13 * largest);
  }
}
