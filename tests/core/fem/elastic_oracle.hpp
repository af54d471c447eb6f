// The elastic energy of a tet mesh in plain serial code, straight from the definitions: the oracle
// of the patch sweeps.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/materials/elastic.hpp>

#include <random>
#include <vector>

namespace taut::test {

template <class Model, class Filter>
struct ElasticOracle {
  using Material = Elastic<Model, Filter>;
  TetMesh const& rest;
  std::vector<Lame<double>> materials;
  std::vector<int> material_of_tet;

  Mat3<double> gradient_of(std::size_t t, std::vector<Point> const& field) const {
    Mat3<double> d;
    Tet const& tet = rest.tets[t];
    for (int a = 0; a < 3; ++a)
      for (int c = 0; c < 3; ++c) d(c, a) = field[tet[a + 1]][c] - field[tet[0]][c];
    return d * rest_shape(rest.points, tet).B;
  }
  Vec3<double> shape(std::size_t t, int a) const {
    Mat3<double> const B = rest_shape(rest.points, rest.tets[t]).B;
    if (a > 0) return {B(a - 1, 0), B(a - 1, 1), B(a - 1, 2)};
    Vec3<double> b{};
    for (int c = 0; c < 3; ++c) b[c] = -(B(0, c) + B(1, c) + B(2, c));
    return b;
  }
  auto state(std::size_t t, std::vector<Point> const& x) const {
    return Material::evaluate(materials[material_of_tet[t]], gradient_of(t, x));
  }
  double volume(std::size_t t) const { return rest_shape(rest.points, rest.tets[t]).W; }

  double value(std::vector<Point> const& x) const {
    double sum = 0;
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      sum += volume(t) * Material::energy(materials[material_of_tet[t]], gradient_of(t, x));
    }
    return sum;
  }
  std::vector<Point> gradient(std::vector<Point> const& x) const {
    std::vector<Point> g(rest.points.size(), Point{});
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      for (int a = 0; a < 4; ++a) {
        Vec3<double> const f = volume(t) * (Material::stress(state(t, x)) * shape(t, a));
        for (int c = 0; c < 3; ++c) g[rest.tets[t][a]][c] += f[c];
      }
    }
    return g;
  }
  std::vector<Sym3<double>> blocks(std::vector<Point> const& x) const {
    std::vector<Sym3<double>> h(rest.points.size(), Sym3<double>{});
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      for (int a = 0; a < 4; ++a) {
        Sym3<double> const b = Material::block(state(t, x), shape(t, a));
        for (int k = 0; k < 6; ++k) h[rest.tets[t][a]].s[k] += volume(t) * b.s[k];
      }
    }
    return h;
  }
  std::vector<Point> diagonal(std::vector<Point> const& x) const {
    std::vector<Point> h(rest.points.size(), Point{});
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      for (int a = 0; a < 4; ++a) {
        Vec3<double> const d = Material::diagonal(state(t, x), shape(t, a));
        for (int c = 0; c < 3; ++c) h[rest.tets[t][a]][c] += volume(t) * d[c];
      }
    }
    return h;
  }
  double quadratic_form(std::vector<Point> const& x, std::vector<Point> const& p) const {
    double sum = 0;
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      sum += volume(t) * Material::quadratic(state(t, x), gradient_of(t, p));
    }
    return sum;
  }
  std::vector<Point> product(std::vector<Point> const& x, std::vector<Point> const& p) const {
    std::vector<Point> hp(rest.points.size(), Point{});
    for (std::size_t t = 0; t < rest.tets.size(); ++t) {
      Mat3<double> const dP = Material::frame(state(t, x)).apply(gradient_of(t, p));
      for (int a = 0; a < 4; ++a) {
        Vec3<double> const f = volume(t) * (dP * shape(t, a));
        for (int c = 0; c < 3; ++c) hp[rest.tets[t][a]][c] += f[c];
      }
    }
    return hp;
  }
};

inline std::vector<Point> random_points(std::size_t n, double size, unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal(0, size);
  std::vector<Point> p(n);
  for (Point& q : p)
    for (double& c : q) c = normal(rng);
  return p;
}

template <class View>
View to_field(std::vector<Point> const& from, View) {
  View field("field", from.size());
  auto host = Kokkos::create_mirror_view(field);
  for (std::size_t i = 0; i < from.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      host(i, c) = static_cast<typename View::non_const_value_type>(from[i][c]);
    }
  assign(field, host);
  return field;
}

}  // namespace taut::test
