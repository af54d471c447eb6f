// A strained block of particles in a deformed state, for the tests of their term.
#pragma once

#include <taut/mpm/elastic_particles.hpp>

#include "particle_oracle.hpp"
#include "particle_scenes.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <support/threads.hpp>

namespace taut::test {

using Field = std::vector<Vec3<double>>;

/// One combination of policies.
template <class Model, class Filter, class Kernel_, class Precision_, class Space_, bool packed_>
struct Combination {
  using Material = Elastic<Model, Filter>;
  using Kernel = Kernel_;
  using Precision = Precision_;
  using Space = Space_;
  static constexpr bool packed = packed_;
  using Term = ElasticParticles<Material, Kernel, Precision, Space, packed>;
};

template <class View>
View field_of(Field const& from) {
  View const view("field", from.size());
  auto const host = Kokkos::create_mirror_view(view);
  for (std::size_t i = 0; i < from.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      host(i, c) = static_cast<typename View::non_const_value_type>(from[i][c]);
    }
  assign(view, host);
  return view;
}
template <class View>
Field read(View const& view) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), view);
  Field to(view.extent(0));
  for (std::size_t i = 0; i < to.size(); ++i)
    for (int c = 0; c < 3; ++c) to[i][c] = double(host(i, c));
  return to;
}

inline double largest(Field const& field) {
  double most = 0;
  for (auto const& v : field) most = std::max(most, norm(v));
  return most;
}
inline double difference(Field const& a, Field const& b) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, norm(a[i] - b[i]));
  return most;
}

/// Where nodes may have gone, and a step that they may take.
struct JitteredNodes {
  Field x, p;
  JitteredNodes(std::vector<std::array<int, 3>> const& at, double dx) {
    std::mt19937 random(3);
    auto const jitter = [&] { return double(random()) / 4294967296.0 - 0.5; };
    for (auto const& ijk : at) {
      Vec3<double> place, step;
      for (int c = 0; c < 3; ++c) {
        place[c] = dx * (ijk[c] + 0.15 * jitter());
        step[c] = 0.02 * dx * jitter();
      }
      x.push_back(place);
      p.push_back(step);
    }
  }
};

/// Two materials for a problem.
template <class Material>
std::vector<typename Material::template Parameters<double>> two_materials() {
  return {{1e5, 1.5e5}, {3e6, 1e6}};
}

template <class C>
struct Problem {
  using Term = typename C::Term;
  using Space = typename C::Space;
  using Precision = typename C::Precision;
  using Positions = typename Term::Positions;
  using Vectors = typename Term::Vectors;

  std::vector<typename C::Material::template Parameters<double>> materials =
      two_materials<typename C::Material>();
  double dx = 0.05;
  std::vector<Particle> list;
  OnGrid<typename C::Kernel, Precision, Space> scene;
  Term term;
  ParticleOracle<typename C::Material> oracle;
  Positions x;
  Vectors p;
  Field x_host, p_host;
  FixedMask<Space> fixed;

  // Across leaves and the origin, with cells of several patches and blocks that are cut.
  explicit Problem(int team_size = 0, int cells = 4, int per_axis = 2)
      : list(jittered_block(cells, per_axis, dx, {-3.3, 5.2, 6.6}, 2)),
        scene(list, dx, 2),
        term(materials, 0, team_size),
        oracle{C::Kernel::width, dx, list, materials, scene.places(), {}},
        fixed("fixed", scene.nodes()) {
    term.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
    JitteredNodes const nodes(scene.places(), dx);
    x = field_of<Positions>(nodes.x);
    p = field_of<Vectors>(nodes.p);
    x_host = read(x);
    p_host = read(p);
  }
};

/// All that sweeps compute against the sums over all nodes.
template <class C>
void check_sweeps() {
  using Catch::Matchers::WithinAbs;
  using Catch::Matchers::WithinRel;
  double const eps = std::is_same_v<typename C::Precision, Fp64> ? 1e-12 : 3e-5;
  double const scale = 0.3;
  for (int const team : C::packed ? std::vector<int>{1} : team_sizes<typename C::Space>()) {
    Problem<C> problem(team);
    auto const& [materials, dx, list, scene, term, oracle, x, p, x_host, p_host, fixed] = problem;
    (void)materials, (void)dx, (void)list;
    int const n = scene.nodes();
    using Vectors = typename C::Term::Vectors;

    CHECK_THAT(term.value(x, scale), WithinRel(scale * oracle.value(x_host), eps));
    Field moved(x_host);
    for (int i = 0; i < n; ++i) moved[i] = moved[i] + 0.7 * p_host[i];
    double const change = scale * (oracle.value(moved) - oracle.value(x_host));
    CHECK_THAT(term.change(x, p, 0.7, scale), WithinRel(change, 100 * eps));
    CHECK_THAT(term.quadratic_form(x, p, scale),
               WithinRel(scale * oracle.quadratic_form(x_host, p_host), eps));

    Field exact = oracle.gradient(x_host);
    for (auto& v : exact) v = scale * v;
    Vectors const g("g", n), d("d", n), hp("hp", n);
    typename C::Term::Blocks const b("b", n);
    term.add_gradient(x, scale, fixed, g);
    CHECK(difference(read(g), exact) < eps * largest(exact));
    Vectors const g_d("g", n), g_b("g", n), g_after("g", n);
    term.add_gradient(x, scale, fixed, g_d, d);
    CHECK(difference(read(g_d), exact) < eps * largest(exact));
    Field diagonal = oracle.diagonal(x_host);
    for (auto& v : diagonal) v = scale * v;
    CHECK(difference(read(d), diagonal) < 10 * eps * largest(diagonal));
    term.add_gradient(x, scale, fixed, g_b, b);
    CHECK(difference(read(g_b), exact) < eps * largest(exact));
    auto const blocks = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), b);
    auto const exact_blocks = oracle.blocks(x_host);
    double wrong = 0, most = 0;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 6; ++k) {
        wrong = std::max(wrong, std::abs(double(blocks(i, k)) - scale * exact_blocks[i].s[k]));
        most = std::max(most, std::abs(scale * exact_blocks[i].s[k]));
      }
    CHECK(wrong < 10 * eps * most);
    // After a step of 0.7 p from x - 0.7 p.
    for (int i = 0; i < n; ++i) moved[i] = x_host[i] - 0.7 * p_host[i];
    double const arrived = scale * (oracle.value(x_host) - oracle.value(moved));
    CHECK_THAT(term.add_gradient_after(x, p, 0.7, scale, fixed, g_after),
               WithinRel(arrived, 100 * eps));
    CHECK(difference(read(g_after), exact) < eps * largest(exact));

    Field product = oracle.product(x_host, p_host);
    for (auto& v : product) v = scale * v;
    term.add_product(x, p, scale, fixed, hp);
    CHECK(difference(read(hp), product) < 3 * eps * largest(product));

    // Fixed nodes receive nothing.
    auto const host_fixed = Kokkos::create_mirror_view(fixed);
    for (int i = 0; i < n; ++i) host_fixed(i) = i % 3 == 0;
    assign(fixed, host_fixed);
    Vectors const g_fixed("g", n);
    term.add_gradient(x, scale, fixed, g_fixed);
    Field const left = read(g_fixed);
    for (int i = 0; i < n; ++i) {
      CHECK_THAT(norm(left[i] - (i % 3 == 0 ? Vec3<double>{} : exact[i])),
                 WithinAbs(0, eps * largest(exact)));
    }
  }
}

}  // namespace taut::test
