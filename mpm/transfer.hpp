// Mass and momentum between particles and the nodes of a grid (Jiang et al. 2015).
//
//   to the grid      m_i = Sum_p w_ip m_p,     m_i v_i = Sum_p w_ip m_p (v_p + C_p (x_i - x_p))
//   to particles     v_p = Sum_i w_ip v_i,     B_p = Sum_i w_ip v_i (x_i - x_p)^T,  C_p = B_p D^-1
//
// with D = Sum_i w_ip (x_i - x_p)(x_i - x_p)^T, which is inertia dx^2 I for quadratic and cubic
// splines; with linear ones D is singular at the nodes, and C_p is the gradient of velocity. All of
// it in Precision::position, for sums over many steps come from here. What becomes of C, and of the
// velocity, is the transfer's policy:
//
//   Apic      C as it is: keeps linear and angular momentum to round-off
//   Rpic      the part of C that turns: keeps both too, and damps what shears and stretches
//   PicFlip   no C; v_p = Sum w v_i + flip (v_p - Sum w v_i before the step): keeps linear momentum
#pragma once

#include <taut/mpm/block_sweep.hpp>
#include <taut/mpm/particles.hpp>

namespace taut {

struct Apic {
  static constexpr char const* name = "apic";
  static constexpr double flip = 0;
  KOKKOS_FUNCTION Mat3<double> affine(Mat3<double> const& C) const { return C; }
};
struct Rpic {
  static constexpr char const* name = "rpic";
  static constexpr double flip = 0;
  KOKKOS_FUNCTION Mat3<double> affine(Mat3<double> const& C) const {
    return 0.5 * (C - transpose(C));
  }
};
struct PicFlip {
  static constexpr char const* name = "pic_flip";
  double flip = 0.95;  ///< 0: PIC, which damps most; 1: FLIP, which damps nothing
  KOKKOS_FUNCTION Mat3<double> affine(Mat3<double> const&) const {
    return 0.0 * identity3<double>();
  }
};

template <class T>
concept Transfer = requires(T const& transfer, Mat3<double> const& C) {
  { T::name } -> std::convertible_to<char const*>;
  { transfer.flip } -> std::convertible_to<double>;
  { transfer.affine(C) } -> std::same_as<Mat3<double>>;
};

/// What a return map does to a particle once a step has ended: nothing.
struct NoFlow {
  static constexpr char const* name = "elastic";
  /// Makes F of a trial F elastic again. `plastic` and `stiffness` are the particle's.
  KOKKOS_FUNCTION void operator()(int material, Mat3<double>& F, double& plastic,
                                  double& stiffness) const {
    (void)material, (void)F, (void)plastic, (void)stiffness;
  }
};

/// A return map that runs after each step (materials/).
template <class T>
concept Flow = requires(T const& flow, Mat3<double>& F, double& plastic, double& stiffness) {
  { T::name } -> std::convertible_to<char const*>;
  {flow(0, F, plastic, stiffness)};
};

namespace kernels {

/// Where a particle is in its cell.
template <class S, class Precision, Spline K>
struct PlaceInCell {
  using Scalar = typename Precision::position;
  Particles<Precision, S> particles;
  double dx;

  /// t along each axis (spline.hpp).
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> operator()(int p) const {
    Vec3<double> t;
    double const per_dx = 1 / dx;
    for (int c = 0; c < 3; ++c) {
      double const x = double(particles.x(p, c)) * per_dx;
      t[c] = (x - base_node<K>(x)) - K::start;
    }
    return t;
  }
  /// From the particle to the lowest node that it sees, m.
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> to_base(Vec3<double> const& t) const {
    Vec3<double> d;
    for (int c = 0; c < 3; ++c) d[c] = -dx * (K::start + t[c]);
    return d;
  }
};

/// Leaves mass and momentum of each patch in rows of four.
template <class S, class Precision, Spline K>
struct ToGrid : BlockSweep<S, typename Precision::position, K, false> {
  using Scalar = typename Precision::position;
  using Base = BlockSweep<S, Scalar, K, false>;
  using Local = typename Base::Local;

  PlaceInCell<S, Precision, K> place;
  Kokkos::View<Scalar*, typename S::memory> partial;

  std::size_t scratch_bytes() const { return Base::row_bytes(4); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank(), slots = this->blocks.slot_begin(patch);
    Local const rows(team.team_scratch(0), 4 * Base::nodes);
    this->clear(team, rows, 4);
    team.team_barrier();
    auto const& particles = place.particles;
    double const dx = place.dx;
    auto const body = [&](int g, bool active) {
      int const p = this->blocks.particle(slots + g);
      if (p < 0) return;  // padding, met by a thread that is alone
      Vec3<double> const t = place(p);
      Weights<K, double> const at(t);
      Mat3<double> const C = matrix_at(particles.C, p);
      double const m = double(particles.mass(p));
      Vec3<double> v = C * place.to_base(t);
      for (int c = 0; c < 3; ++c) v[c] += double(particles.v(p, c));
      auto const received = [&](int a, int b, int c, Scalar(&row)[4]) {
        double const w = m * at.weight(a, b, c);
        row[0] = static_cast<Scalar>(w);
        for (int k = 0; k < 3; ++k) {
          row[1 + k] =
              static_cast<Scalar>(w * (v[k] + dx * (a * C(k, 0) + b * C(k, 1) + c * C(k, 2))));
        }
      };
      this->template give<4>(team, active, this->blocks.corner.data() + slots + g, rows.data(),
                             received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<4>(team, patch, rows, partial);
  }
};

/// Mass and momentum of a node.
template <class S, class Scalar>
struct WriteNodes {
  Array<Scalar, S> mass;
  VectorField<Scalar, S> velocity;  ///< momentum, for the time being
  template <int numbers>
  KOKKOS_FORCEINLINE_FUNCTION void add(int node, Scalar const (&sum)[numbers]) const {
    static_assert(numbers == 4);
    mass(node) = sum[0];
    for (int c = 0; c < 3; ++c) velocity(node, c) = sum[1 + c];
  }
};

template <class S, class Scalar>
struct LargestMass {
  Array<Scalar, S> mass;
  KOKKOS_FUNCTION void operator()(int node, double& most) const {
    most = Kokkos::max(most, double(mass(node)));
  }
};

/// v = p / m; and m at least `floor`.
template <class S, class Scalar>
struct MomentumToVelocity {
  Array<Scalar, S> mass;
  VectorField<Scalar, S> velocity;
  Scalar floor;
  KOKKOS_FUNCTION void operator()(int node) const {
    Scalar const m = mass(node);
    for (int c = 0; c < 3; ++c) {
      Scalar const v = velocity(node, c) / m;
      velocity(node, c) = m > 0 ? v : Scalar(0);
    }
    if (!(m > floor)) mass(node) = floor;
  }
};

/// What a particle sees of the displacement of the nodes.
template <class S, class Precision, Spline K>
struct SeenByParticle {
  using Scalar = typename Precision::position;
  BlockViews<K, S> blocks;
  PlaceInCell<S, Precision, K> place;
  VectorField<Scalar, S> x, rest;  ///< of the nodes

  /// Calls visit(node, u, a, b, c, weights) for the nodes of a slot.
  template <class Visit>
  KOKKOS_FORCEINLINE_FUNCTION void for_each_node(int const* node, Visit const& visit) const {
    for (int a = 0; a < K::width; ++a)
      for (int b = 0; b < K::width; ++b)
        for (int c = 0; c < K::width; ++c) {
          int const n = node[BlockViews<K, S>::local(a, b, c)];
          Vec3<double> u;
          for (int k = 0; k < 3; ++k) u[k] = double(x(n, k)) - double(rest(n, k));
          visit(n, u, a, b, c);
        }
  }
};

/// The farthest that a particle of a patch goes, m.
template <class S, class Precision, Spline K>
struct ParticleTravel {
  SeenByParticle<S, Precision, K> seen;
  KOKKOS_FUNCTION void operator()(int patch, double& farthest) const {
    auto const& blocks = seen.blocks;
    int const slots = blocks.slot_begin(patch);
    for (int k = slots; k < slots + blocks.count(patch); ++k) {
      Weights<K, double> const at(seen.place(blocks.particle(k)));
      Vec3<double> move{};
      seen.for_each_node(blocks.nodes_of(patch) + blocks.corner(k) / 4,
                         [&](int, Vec3<double> const& u, int a, int b, int c) {
                           move = move + at.weight(a, b, c) * u;
                         });
      farthest = Kokkos::max(farthest, norm(move));
    }
  }
};

template <class S, class Scalar>
struct NodeTravel {
  VectorField<Scalar, S> x, rest;
  KOKKOS_FUNCTION void operator()(int n, double& farthest) const {
    Vec3<double> u;
    for (int k = 0; k < 3; ++k) u[k] = double(x(n, k)) - double(rest(n, k));
    farthest = Kokkos::max(farthest, norm(u));
  }
};

/// Moves the particles of a patch to the end of the step.
template <class S, class Precision, Spline K, class Transfer_, class Flow_>
struct ToParticles {
  using Scalar = typename Precision::position;
  SeenByParticle<S, Precision, K> seen;
  VectorField<Scalar, S> v, v_before;  ///< of the nodes, at the end of the step and before it
  double h;
  Transfer_ transfer;
  Flow_ flow;

  KOKKOS_FUNCTION void move(int p, int const* node) const {
    auto const& particles = seen.place.particles;
    double const dx = seen.place.dx;
    Vec3<double> const t = seen.place(p), to_base = seen.place.to_base(t);
    Weights<K, double> const at(t);
    Vec3<double> pic{}, gained{}, travel{};
    Mat3<double> B = 0.0 * identity3<double>(), G = B;
    seen.for_each_node(node, [&](int n, Vec3<double> const& u, int a, int b, int c) {
      double const w = at.weight(a, b, c);
      Vec3<double> const grad = at.gradient(a, b, c);
      Vec3<double> const d{to_base[0] + a * dx, to_base[1] + b * dx, to_base[2] + c * dx};
      Vec3<double> wv;
      for (int k = 0; k < 3; ++k) {
        wv[k] = w * double(v(n, k));
        if (transfer.flip != 0) gained[k] += wv[k] - w * double(v_before(n, k));
      }
      pic = pic + wv;
      travel = travel + w * u;
      if constexpr (K::inertia > 0) B = B + outer(wv, d);
      G = G + outer(u, grad);
    });
    G = (1 / dx) * G;
    double const flip = transfer.flip;
    Mat3<double> C = K::inertia > 0 ? (1 / (K::inertia * dx * dx)) * B : (1 / h) * G;
    set_matrix(particles.C, p, transfer.affine(C));
    for (int k = 0; k < 3; ++k) {
      double const new_v =
          flip != 0 ? (1 - flip) * pic[k] + flip * (double(particles.v(p, k)) + gained[k]) : pic[k];
      particles.v(p, k) = static_cast<Scalar>(new_v);
      particles.x(p, k) = static_cast<Scalar>(double(particles.x(p, k)) + travel[k]);
    }
    Mat3<double> const before = matrix_at(particles.F, p);
    Mat3<double> F = before + G * before;
    double plastic = double(particles.plastic(p)), stiffness = double(particles.stiffness(p));
    flow(particles.material(p), F, plastic, stiffness);
    particles.plastic(p) = static_cast<Scalar>(plastic);
    particles.stiffness(p) = static_cast<Scalar>(stiffness);
    set_matrix(particles.F, p, F);
  }
  KOKKOS_FUNCTION void operator()(int patch) const {
    auto const& blocks = seen.blocks;
    int const slots = blocks.slot_begin(patch);
    for (int k = slots; k < slots + blocks.count(patch); ++k) {
      move(blocks.particle(k), blocks.nodes_of(patch) + blocks.corner(k) / 4);
    }
  }
};

}  // namespace kernels

/// Masses and velocities of the nodes of a grid, and the way to and from particles.
template <Spline K, class Precision = Mixed, class Space = DefaultSpace>
class GridTransfer {
public:
  using Scalar = typename Precision::position;
  using Positions = VectorField<Scalar, Space>;

  /// Of the nodes.
  Array<Scalar, Space> const& mass() const { return mass_; }
  Positions const& velocity() const { return velocity_; }

  /// Mass (kg) and velocity (m/s) of `nodes` nodes of spacing dx (m).
  ///
  /// A node at the rim of what particles see may receive a mass that is lost in the round-off of
  /// its neighbours', or none at all. Its share of F is then lost as well (weights vanish with
  /// the square of what slopes do, for all but linear splines), but a node without mass makes no
  /// sense to a minimiser: masses are raised to eps^2 times the largest, which changes nothing that
  /// survives rounding.
  void to_grid(Particles<Precision, Space> const& particles, ParticleBlocks<K, Space> const& blocks,
               int nodes, double dx) {
    auto const& views = blocks.views();
    mass_ = mass_memory_.resize("node_mass", nodes);
    velocity_ = velocity_memory_.resize("node_velocity", nodes);
    grow(partial_, "transfer_partial",
         std::size_t(4) * BlockViews<K, Space>::nodes * views.patches);
    kernels::ToGrid<Space, Precision, K> const kernel{{views}, {particles, dx}, partial_};
    for_each_team<Space>("particles_to_grid", views.patches, Space::on_host ? 1 : 64,
                         kernel.scratch_bytes(), kernel);
    using Write = kernels::WriteNodes<Space, Scalar>;
    for_each<Space>(
        "gather_nodes", nodes,
        kernels::GatherRows<Space, Scalar, K, 4, Write>{views, partial_, {mass_, velocity_}});
    double const largest =
        maximum<Space>("largest_mass", nodes, 0.0, kernels::LargestMass<Space, Scalar>{mass_});
    double const eps = double(Kokkos::Experimental::epsilon_v<typename Precision::real>);
    for_each<Space>("node_velocity", nodes,
                    kernels::MomentumToVelocity<Space, Scalar>{
                        mass_, velocity_, static_cast<Scalar>(eps * eps * largest)});
  }

private:
  Array<Scalar, Space> mass_;
  Positions velocity_;
  Resizable<Array<Scalar, Space>> mass_memory_;
  Resizable<Positions> velocity_memory_;
  Kokkos::View<Scalar*, typename Space::memory> partial_;
};

/// The farthest that a particle goes while the nodes go from `rest` to x (m).
template <Spline K, class Precision, class Space, class Positions>
double farthest_travel(Particles<Precision, Space> const& particles,
                       ParticleBlocks<K, Space> const& blocks, Positions const& x,
                       Positions const& rest, double dx) {
  return maximum<Space>(
      "particle_travel", blocks.views().patches, 0.0,
      kernels::ParticleTravel<Space, Precision, K>{{blocks.views(), {particles, dx}, x, rest}});
}

/// Moves particles by a step of h seconds in which the nodes went from `rest` to x and their
/// velocities changed from v_before to v.
template <Spline K, class Precision, class Space, class Positions, Transfer T, Flow F>
void to_particles(Particles<Precision, Space> const& particles,
                  ParticleBlocks<K, Space> const& blocks, Positions const& x, Positions const& rest,
                  Positions const& v, Positions const& v_before, double h, double dx,
                  T const& transfer, F const& flow) {
  for_each<Space>("to_particles", blocks.views().patches,
                  kernels::ToParticles<Space, Precision, K, T, F>{
                      {blocks.views(), {particles, dx}, x, rest}, v, v_before, h, transfer, flow});
}

}  // namespace taut
