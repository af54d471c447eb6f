// Boundaries along which nodes slide: a term that is steep across them and flat along them,
//
//   V(x) = Sum_i Sum_k  1/2 s_i (n_ik . d_ik)^2,      d_ik = x_i - (X_i + h v_k(X_i)),
//
// over the boundaries k that hold node i, with n_ik the normal that leads out of the solid; where
// contact may separate, only while n . d < 0. Any number of normals may meet at a node: their
// constraints hold together, in corners too, without a basis in which they would be orthogonal.
// s_i is `steepness` times what else resists a motion of the node, so that it gives way by that
// share of what the constraint takes from its motion, whatever the material and the step. A block
// preconditioner takes all of it.
//
// Friction is Coulomb's, smoothed, with the normal force of the last minimisation (Lagging passes):
// along the boundary
//
//   D(x) = Sum mu f_ik g(|u_ik|),     u = (I - n n^T) d,   g' = y/e (2 - y/e) for y < e, then 1
//
// with f the force s |n . d| and e = stick_speed h (Li et al. 2020, section 5, for its smoothing).
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/exec/scan.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/mpm/boundary.hpp>

namespace taut {

struct SlipParams {
  double steepness = 1e3;     ///< over what else resists; 10 to 1e4
  double stick_speed = 1e-3;  ///< m/s, below which friction sticks
};

namespace kernels {

/// One node in one boundary.
struct SlipPair {
  int boundary = 0;
  Vec3<double> normal{}, target{};  ///< where the node would be if it went with the boundary, m
  double friction_force = 0;        ///< mu f of the last minimisation, N
  bool separates = false;
};

template <class S>
struct SlipViews {
  Kokkos::View<int*, typename S::memory> begin;  ///< per node, +1
  Kokkos::View<SlipPair*, typename S::memory> pair;
  Kokkos::View<double*, typename S::memory> stiffness;  ///< per node, N/m
  double stick = 1;                                     ///< e, m
  bool friction = false;
};

KOKKOS_FORCEINLINE_FUNCTION bool slides(Boundary const& b) {
  return b.contact != BoundaryContact::sticky;
}

template <class S, class Positions>
struct CountSlip {
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  int count;
  Positions rest;
  KOKKOS_FUNCTION int operator()(int n) const {
    Vec3<double> const x{double(rest(n, 0)), double(rest(n, 1)), double(rest(n, 2))};
    int held = 0;
    for (int k = 0; k < count; ++k) held += slides(boundaries(k)) && boundaries(k).holds(x);
    return held;
  }
};

template <class S, class Positions>
struct ListSlip {
  CountSlip<S, Positions> of;
  double h;
  SlipViews<S> to;
  KOKKOS_FUNCTION void operator()(int n) const {
    Vec3<double> const x{double(of.rest(n, 0)), double(of.rest(n, 1)), double(of.rest(n, 2))};
    int at = to.begin(n);
    for (int k = 0; k < of.count; ++k) {
      Boundary const& b = of.boundaries(k);
      SlipPair pair;
      if (!slides(b) || b.distance(x, pair.normal) > 0) continue;
      pair.boundary = k;
      pair.target = x + h * b.velocity_at(x);
      pair.separates = b.contact == BoundaryContact::separate;
      to.pair(at++) = pair;
    }
  }
};

template <class S, class Real>
struct SlipStiffness {
  Array<Real, S> resists;
  double steepness;
  Kokkos::View<double*, typename S::memory> stiffness;
  KOKKOS_FUNCTION void operator()(int n) const { stiffness(n) = steepness * double(resists(n)); }
};

/// The energy (J) of one node in its boundaries, and its derivatives.
template <class S>
struct SlipEnergy {
  SlipViews<S> views;

  /// g(y) / e and g'(y) / y times e, both smooth at 0.
  KOKKOS_FUNCTION static double smooth(double y) {
    return y < 1 ? y * y * (1 - y / 3) : y - 1.0 / 3;
  }
  KOKKOS_FUNCTION static double slope_over(double y) { return y < 1 ? 2 - y : 1 / y; }

  KOKKOS_FUNCTION Vec3<double> along(SlipPair const& p, Vec3<double> const& d) const {
    return (1 / views.stick) * (d - dot(p.normal, d) * p.normal);
  }
  KOKKOS_FUNCTION bool touches(SlipPair const& p, double depth) const {
    return !p.separates || depth < 0;
  }
  /// V(x + s) - V(x)
  KOKKOS_FUNCTION double change(int n, Vec3<double> const& x, Vec3<double> const& s) const {
    double sum = 0;
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      double before = dot(p.normal, d), step = dot(p.normal, s);
      if (p.separates) {
        double const after = Kokkos::min(before + step, 0.0);
        before = Kokkos::min(before, 0.0);
        step = after - before;
      }
      sum += views.stiffness(n) * step * (before + 0.5 * step);
      if (p.friction_force > 0) {
        double const from = norm(along(p, d)), to = norm(along(p, d + s));
        sum += p.friction_force * views.stick * (smooth(to) - smooth(from));
      }
    }
    return sum;
  }
  KOKKOS_FUNCTION double value(int n, Vec3<double> const& x) const {
    double sum = 0;
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      double const depth = dot(p.normal, d);
      if (touches(p, depth)) sum += 0.5 * views.stiffness(n) * depth * depth;
      if (p.friction_force > 0) sum += p.friction_force * views.stick * smooth(norm(along(p, d)));
    }
    return sum;
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int n, Vec3<double> const& x) const {
    Vec3<double> sum{};
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      double const depth = dot(p.normal, d);
      if (touches(p, depth)) sum = sum + (views.stiffness(n) * depth) * p.normal;
      if (p.friction_force > 0) {
        Vec3<double> const u = along(p, d);
        sum = sum + (p.friction_force * slope_over(norm(u))) * u;
      }
    }
    return sum;
  }
  /// Positive semi-definite: of friction, that of a spring with the same force.
  KOKKOS_FUNCTION Sym3<double> curvature(int n, Vec3<double> const& x) const {
    Sym3<double> sum{};
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target, &m = p.normal;
      double across = touches(p, dot(m, d)) ? views.stiffness(n) : 0, isotropic = 0;
      if (p.friction_force > 0) {
        isotropic = p.friction_force * slope_over(norm(along(p, d))) / views.stick;
        across -= isotropic;
      }
      constexpr int row[6] = {0, 1, 2, 0, 1, 0}, col[6] = {0, 1, 2, 1, 2, 2};
      for (int c = 0; c < 6; ++c) {
        sum.s[c] += across * m[row[c]] * m[col[c]] + (c < 3 ? isotropic : 0);
      }
    }
    return sum;
  }
};

template <class Field>
KOKKOS_FORCEINLINE_FUNCTION Vec3<double> vector_at(Field const& f, int n) {
  return {double(f(n, 0)), double(f(n, 1)), double(f(n, 2))};
}

template <class S, class Precision>
struct SlipSum {
  using Sum = Sums<typename Precision::sum, 1>;
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  int what;  ///< 0: value; 1: change by alpha p; 2: p' H p
  double alpha;
  KOKKOS_FUNCTION void operator()(int n, Sum& sum) const {
    if (energy.views.begin(n) == energy.views.begin(n + 1)) return;
    Vec3<double> const at = vector_at(x, n);
    double here;
    if (what == 0) {
      here = energy.value(n, at);
    } else if (what == 1) {
      here = energy.change(n, at, alpha * vector_at(p, n));
    } else {
      here = quadratic(energy.curvature(n, at), vector_at(p, n));
    }
    sum[0] += static_cast<typename Precision::sum>(here);
  }
};

template <class S, class Precision>
struct AddSlip {
  using Real = typename Precision::real;
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  double scale;
  FixedMask<S> fixed;
  VectorField<Real, S> g, p;  ///< p: of a product; empty: the gradient
  VectorField<Real, S> diagonal;
  BlockField<Real, S> blocks;
  KOKKOS_FUNCTION void operator()(int n) const {
    if (fixed(n) || energy.views.begin(n) == energy.views.begin(n + 1)) return;
    Vec3<double> const at = vector_at(x, n);
    Vec3<double> const add =
        p.extent(0) > 0 ? energy.curvature(n, at) * vector_at(p, n) : energy.gradient(n, at);
    for (int c = 0; c < 3; ++c) g(n, c) += static_cast<Real>(scale * add[c]);
    if (diagonal.extent(0) == 0 && blocks.extent(0) == 0) return;
    Sym3<double> const h = energy.curvature(n, at);
    if (blocks.extent(0) > 0) {
      for (int c = 0; c < 6; ++c) blocks(n, c) += static_cast<Real>(scale * h.s[c]);
    } else {
      for (int c = 0; c < 3; ++c) diagonal(n, c) += static_cast<Real>(scale * h.s[c]);
    }
  }
};

template <class S, class Precision, class Matrix>
struct AssembleSlip {
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  double scale;
  FixedMask<S> fixed;
  Matrix matrix;
  KOKKOS_FUNCTION void operator()(int n) const {
    if (fixed(n) || energy.views.begin(n) == energy.views.begin(n + 1)) return;
    matrix.add(n, n, scale * to_matrix(energy.curvature(n, vector_at(x, n))));
  }
};

/// Takes the friction forces from where a minimisation ended; tells by how much they have changed.
template <class S, class Precision>
struct Relag {
  SlipViews<S> views;
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  VectorField<typename Precision::position, S> x;
  KOKKOS_FUNCTION void operator()(int n, double& most) const {
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair& p = views.pair(k);
      double const depth = dot(p.normal, vector_at(x, n) - p.target);
      double const force =
          boundaries(p.boundary).friction * Kokkos::max(0.0, -views.stiffness(n) * depth);
      most = Kokkos::max(most, Kokkos::abs(force - p.friction_force));
      p.friction_force = force;
    }
  }
};

}  // namespace kernels

/// The boundaries that do not stick, as a term of the potential of a grid. ParticleStepper tells it
/// (`hold`) what is where. Where there is friction, give the time stepper two passes or more.
template <class Precision_ = Mixed, class Space_ = DefaultSpace>
class Slip {
public:
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;

  /// Throws Error for a steepness or a speed that cannot be.
  explicit Slip(SlipParams const& params = {}) : params_(params) {
    if (!(params.steepness >= 10 && params.steepness <= 1e4) || !(params.stick_speed > 0)) {
      throw Error("slip: steepness = {}, stick_speed = {} m/s; give 10 to 1e4, and a speed above 0",
                  params.steepness, params.stick_speed);
    }
  }

  /// A step of h seconds begins, with nodes at `rest` and the boundaries where they will be.
  void hold(Positions const& rest, BoundaryList<Space> const& boundaries, double h) {
    nodes_ = static_cast<int>(rest.extent(0));
    boundaries_ = boundaries.list();
    using Count = kernels::CountSlip<Space, Positions>;
    Count const count{boundaries_, boundaries.count(), rest};
    grow(views_.begin, "slip_begin", nodes_ + 1);
    int const pairs = exclusive_scan<Space, int>("count_slip", nodes_, count, views_.begin);
    assign_on<Space>(Kokkos::subview(views_.begin, Kokkos::make_pair(nodes_, nodes_ + 1)), pairs);
    grow(views_.pair, "slip_pairs", pairs);
    grow(views_.stiffness, "slip_stiffness", nodes_);
    views_.stick = params_.stick_speed * h;
    views_.friction = false;
    for (BoundarySpec const& spec : boundaries.specs()) views_.friction |= spec.friction > 0;
    for_each<Space>("list_slip", nodes_, kernels::ListSlip<Space, Positions>{count, h, views_});
    reducer_.provide(nodes_, 1);
  }
  void begin_step(StepStart<Precision, Space> const& start) const {
    for_each<Space>(
        "slip_stiffness", nodes_,
        kernels::SlipStiffness<Space, Real>{start.stiffness, params_.steepness, views_.stiffness});
  }
  bool relag(Positions const& x) const {
    if (!views_.friction) return false;
    return maximum<Space>("relag_slip", nodes_, 0.0,
                          kernels::Relag<Space, Precision>{views_, boundaries_, x}) > 0;
  }

  static constexpr bool couples = false;  ///< nodes (UncoupledTerm)

  double value(Positions const& x, double scale) const { return scale * sum(x, {}, 0, 0); }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    return scale * sum(x, p, 1, alpha);
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    return scale * sum(x, p, 2, 0);
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g) const {
    add(x, scale, fixed, g, {}, {}, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Vectors const& diagonal) const {
    add(x, scale, fixed, g, {}, diagonal, {});
  }
  void add_gradient(Positions const& x, double scale, FixedMask<Space> const& fixed,
                    Vectors const& g, Blocks const& blocks) const {
    add(x, scale, fixed, g, {}, {}, blocks);
  }
  template <class... Curvature>
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            FixedMask<Space> const& fixed, Vectors const& g,
                            Curvature const&... curvature) const {
    add_gradient(x, scale, fixed, g, curvature...);
    return -change(x, p, -alpha, scale);
  }
  void add_product(Positions const& x, Vectors const& p, double scale,
                   FixedMask<Space> const& fixed, Vectors const& hp) const {
    if (nodes_ > 0) add(x, scale, fixed, hp, p, {}, {});
  }
  void add_to(Matrix const& matrix, Positions const& x, double scale,
              FixedMask<Space> const& fixed) const {
    for_each<Space>(
        "slip_assemble", nodes_,
        kernels::AssembleSlip<Space, Precision, Matrix>{{views_}, x, scale, fixed, matrix});
  }
  double max_step(Positions const&, Vectors const&, double at_most) const { return at_most; }
  double max_prescribed_step(Positions const&, Vectors const&, double at_most) const {
    return at_most;
  }
  void elements(std::vector<Connectivity>&) const {}  // diagonal blocks are always there

private:
  double sum(Positions const& x, Vectors const& p, int what, double alpha) const {
    return double(reducer_.template sum<1>(
        "slip_energy", nodes_, kernels::SlipSum<Space, Precision>{{views_}, x, p, what, alpha})[0]);
  }
  void add(Positions const& x, double scale, FixedMask<Space> const& fixed, Vectors const& g,
           Vectors const& p, Vectors const& diagonal, Blocks const& blocks) const {
    for_each<Space>(
        "slip_gradient", nodes_,
        kernels::AddSlip<Space, Precision>{{views_}, x, scale, fixed, g, p, diagonal, blocks});
  }

  SlipParams params_;
  int nodes_ = 0;
  kernels::SlipViews<Space> views_;
  Kokkos::View<Boundary const*, typename Space::memory> boundaries_;
  Reducer<Space, typename Precision::sum> reducer_;
};

}  // namespace taut
