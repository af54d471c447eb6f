// A swept term made of small elements that couple N unknowns each: springs, hinges, pairs in
// contact. Write the element (value, gradient and curvature of one element) and get a term that
// works with every minimiser, precision and backend.
//
// Each unknown adds up its own rows by visiting its elements in order, so sums are deterministic
// and need no memory; an element is evaluated once per corner.
#pragma once

#include <taut/core/exec/buckets.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/core/report/error.hpp>

#include <array>
#include <limits>
#include <vector>

namespace taut {

/// An element kernel, copied to the device. For element e with its unknowns at x (m, fp64):
///   value(e, x)             energy, J
///   gradient(e, x, a)       dE/dx_a
///   curvature(e, x, a, b)   3x3 block (a, b) of a positive semi-definite d2E/dx2
template <class K>
concept Stencil = requires(K const& kernel, int e, Vec3<double> const (&x)[K::vertices]) {
  { K::vertices } -> std::convertible_to<int>;
  { kernel.value(e, x) } -> std::convertible_to<double>;
  { kernel.gradient(e, x, 0) } -> std::same_as<Vec3<double>>;
  { kernel.curvature(e, x, 0, 0) } -> std::same_as<Mat3<double>>;
};

namespace kernels {

template <class Kernel, class S, class Precision>
struct StencilData {
  static constexpr int N = Kernel::vertices;
  Kernel kernel;
  Kokkos::View<int*, typename S::memory> vertex;                      ///< N per element
  Kokkos::View<int*, typename S::memory> incidence_begin, incidence;  ///< N e + a, per unknown
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;

  template <class Field>
  KOKKOS_FUNCTION void corners(Field const& field, int e, Vec3<double> (&to)[N]) const {
    for (int a = 0; a < N; ++a)
      for (int c = 0; c < 3; ++c) to[a][c] = double(field(vertex(N * e + a), c));
  }
};

/// Energy (alpha = 0, no p), or E(x + to p) - E(x + from p).
template <class Kernel, class S, class Precision>
struct StencilEnergy : StencilData<Kernel, S, Precision> {
  using Base = StencilData<Kernel, S, Precision>;
  bool change;
  double from, to;
  KOKKOS_FUNCTION void operator()(int e, Sums<double, 1>& sum) const {
    Vec3<double> y[Base::N], s[Base::N], z[Base::N];
    this->corners(this->x, e, y);
    if (!change) {
      sum[0] += this->kernel.value(e, y);
      return;
    }
    this->corners(this->p, e, s);
    for (int a = 0; a < Base::N; ++a) {
      z[a] = y[a] + to * s[a];
      y[a] = y[a] + from * s[a];
    }
    sum[0] += this->kernel.value(e, z) - this->kernel.value(e, y);
  }
};

template <class Kernel, class S, class Precision>
struct StencilForm : StencilData<Kernel, S, Precision> {
  using Base = StencilData<Kernel, S, Precision>;
  KOKKOS_FUNCTION void operator()(int e, Sums<double, 1>& sum) const {
    Vec3<double> y[Base::N], s[Base::N];
    this->corners(this->x, e, y);
    this->corners(this->p, e, s);
    for (int a = 0; a < Base::N; ++a)
      for (int b = 0; b < Base::N; ++b) {
        sum[0] += dot(s[a], this->kernel.curvature(e, y, a, b) * s[b]);
      }
  }
};

/// An element's share is at its first unknown.
template <class Kernel, class S, class Precision>
struct StencilShares {
  StencilForm<Kernel, S, Precision> form;
  Array<double, S> shares;
  double scale;
  KOKKOS_FUNCTION void operator()(int i) const {
    Sums<double, 1> sum;
    for (int k = form.incidence_begin(i); k < form.incidence_begin(i + 1); ++k) {
      if (form.incidence(k) % Kernel::vertices == 0)
        form(form.incidence(k) / Kernel::vertices, sum);
    }
    shares(i) += scale * sum[0];
  }
};

/// Adds gradient and curvature (`numbers` of it per unknown) to unknown i; or the product with p.
template <class Kernel, class S, class Precision, class CurvatureField, int numbers, bool product>
struct StencilRows : StencilData<Kernel, S, Precision> {
  using Base = StencilData<Kernel, S, Precision>;
  using Real = typename Precision::real;
  FixedMask<S> fixed;
  VectorField<Real, S> g;
  CurvatureField curvature;
  double scale;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (fixed(i)) return;
    Vec3<double> sum{};
    double h[6] = {};
    for (int k = this->incidence_begin(i); k < this->incidence_begin(i + 1); ++k) {
      int const e = this->incidence(k) / Base::N, a = this->incidence(k) % Base::N;
      Vec3<double> y[Base::N], s[Base::N];
      this->corners(this->x, e, y);
      if constexpr (product) {
        this->corners(this->p, e, s);
        for (int b = 0; b < Base::N; ++b) {
          sum = sum + this->kernel.curvature(e, y, a, b) * s[b];
        }
      } else {
        sum = sum + this->kernel.gradient(e, y, a);
      }
      if constexpr (numbers > 0) {
        Mat3<double> block = this->kernel.curvature(e, y, a, a);
        for (int b = 0; b < Base::N; ++b) {  // an element may name an unknown twice
          bool const again = b != a && this->vertex(Base::N * e + b) == i;
          if (again) block = block + this->kernel.curvature(e, y, a, b);
        }
        double const entries[6] = {block(0, 0), block(1, 1), block(2, 2),
                                   block(0, 1), block(1, 2), block(0, 2)};
        for (int c = 0; c < numbers; ++c) h[c] += entries[c];
      }
    }
    for (int c = 0; c < 3; ++c) g(i, c) += static_cast<Real>(scale * sum[c]);
    if constexpr (numbers > 0) {
      for (int c = 0; c < numbers; ++c) curvature(i, c) += static_cast<Real>(scale * h[c]);
    }
  }
};

template <class Kernel, class S, class Precision>
struct StencilAssemble : StencilData<Kernel, S, Precision> {
  using Base = StencilData<Kernel, S, Precision>;
  FixedMask<S> fixed;
  BlockCsr<S, double> matrix;
  double scale;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (fixed(i)) return;
    for (int k = this->incidence_begin(i); k < this->incidence_begin(i + 1); ++k) {
      int const e = this->incidence(k) / Base::N, a = this->incidence(k) % Base::N;
      Vec3<double> y[Base::N];
      this->corners(this->x, e, y);
      for (int b = 0; b < Base::N; ++b) {
        int const j = this->vertex(Base::N * e + b);
        if (!fixed(j)) matrix.add(i, j, scale * this->kernel.curvature(e, y, a, b));
      }
    }
  }
};

}  // namespace kernels

template <Stencil Kernel, class Precision_ = Mixed, class Space_ = DefaultSpace>
class StencilTerm {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<typename Precision::real, Space>;
  using Blocks = BlockField<typename Precision::real, Space>;
  using Fixed = FixedMask<Space>;
  static constexpr int N = Kernel::vertices;

  /// `elements[e]` names the N unknowns of element e; there are `unknowns` in all.
  StencilTerm(Kernel const& kernel, std::vector<std::array<int, N>> const& elements, int unknowns)
      : kernel_(kernel), reducer_(static_cast<int>(elements.size()), 1) {
    for (auto const& element : elements) {
      for (int v : element) {
        if (v < 0 || v >= unknowns) {
          throw Error("an element names unknown {}, but there are {}: renumber it", v, unknowns);
        }
        vertices_.push_back(v);
      }
    }
    Buckets const incidence = sort_into_buckets(vertices_, unknowns);
    vertex_ = to_space<Space>("stencil_vertex", vertices_);
    incidence_begin_ = to_space<Space>("stencil_incidence_begin", incidence.begin);
    incidence_ = to_space<Space>("stencil_incidence", incidence.item);
  }

  double value(Positions const& x, double scale) const {
    return scale * energy(x, Vectors(), false, 0, 0);
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * energy(x, p, true, 0, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    kernels::StencilForm<Kernel, Space, Precision> const form{data(x, p)};
    return scale * reducer_.template sum<1>("stencil_form", count(), form)[0];
  }
  void add_form_shares(Positions const& x, Vectors const& p, double scale, Fixed const&,
                       Array<double, Space> const& shares) const {
    kernels::StencilForm<Kernel, Space, Precision> const form{data(x, p)};
    for_each<Space>("stencil_shares", incidence_begin_.extent_int(0) - 1,
                    kernels::StencilShares<Kernel, Space, Precision>{form, shares, scale});
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g) const {
    rows<0, false>(x, Vectors(), scale, fixed, g, g);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Vectors const& diagonal) const {
    rows<3, false>(x, Vectors(), scale, fixed, g, diagonal);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Blocks const& blocks) const {
    rows<6, false>(x, Vectors(), scale, fixed, g, blocks);
  }
  template <class... Curvature>
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Curvature const&... c) const {
    add_gradient(x, scale, fixed, g, c...);
    return scale * energy(x, p, true, -alpha, 0);
  }
  void add_product(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                   Vectors const& hp) const {
    rows<0, true>(x, p, scale, fixed, hp, hp);
  }
  void add_to(BlockCsr<Space, double> const& matrix, Positions const& x, double scale,
              Fixed const& fixed) const {
    for_each<Space>("stencil_assemble", static_cast<int>(fixed.extent(0)),
                    kernels::StencilAssemble<Kernel, Space, Precision>{data(x, Vectors()), fixed,
                                                                       matrix, scale});
  }
  double max_step(Positions const&, Vectors const&, double at_most) const { return at_most; }
  double max_prescribed_step(Positions const&, Vectors const&, double at_most) const {
    return at_most;
  }
  void elements(std::vector<Connectivity>& kinds) const { kinds.push_back({vertices_, N}); }

private:
  using Data = kernels::StencilData<Kernel, Space, Precision>;
  using Indices = Kokkos::View<int*, typename Space::memory>;

  int count() const { return static_cast<int>(vertices_.size()) / N; }
  Data data(Positions const& x, Vectors const& p) const {
    return {kernel_, vertex_, incidence_begin_, incidence_, x, p};
  }
  double energy(Positions const& x, Vectors const& p, bool change, double from, double to) const {
    kernels::StencilEnergy<Kernel, Space, Precision> const e{data(x, p), change, from, to};
    return reducer_.template sum<1>("stencil_energy", count(), e)[0];
  }
  template <int numbers, bool product, class CurvatureField>
  void rows(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
            Vectors const& g, CurvatureField const& c) const {
    using Rows = kernels::StencilRows<Kernel, Space, Precision, CurvatureField, numbers, product>;
    for_each<Space>("stencil_rows", static_cast<int>(fixed.extent(0)),
                    Rows{data(x, p), fixed, g, c, scale});
  }

  Kernel kernel_;
  std::vector<int> vertices_;
  Indices vertex_, incidence_begin_, incidence_;
  Reducer<Space, double> reducer_;
};

}  // namespace taut
