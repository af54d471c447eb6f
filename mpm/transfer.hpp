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
  Kokkos::View<int* [3], typename S::layout, typename S::memory> cell;  ///< BlockViews

  /// t along each axis (spline.hpp).
  KOKKOS_FORCEINLINE_FUNCTION Vec3<double> operator()(int p) const {
    Vec3<double> t;
    double const per_dx = 1 / dx;
    for (int c = 0; c < 3; ++c) {
      t[c] = place_in_cell<K>(double(particles.x(p, c)) * per_dx, cell(p, c));
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

/// What a particle is to a sweep, one of them or a pack: numbers that lie apart, side by side.
template <class T, int numbers>
struct Collected {
  static constexpr int width = ScalarTraits<T>::lanes;
  ValueType<T> number[numbers][width];
  KOKKOS_FORCEINLINE_FUNCTION T operator[](int k) const { return load<T>(number[k]); }
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> vector(int k) const {
    return {(*this)[k], (*this)[k + 1], (*this)[k + 2]};
  }
};

/// Leaves mass and momentum of each patch in rows of four.
template <class S, class Precision, Spline K, bool packed>
struct ToGrid : BlockSweep<S, typename Precision::position, K, packed> {
  using Scalar = typename Precision::position;
  using Base = BlockSweep<S, Scalar, K, packed>;
  using T = typename Base::Value;
  using Local = typename Base::Local;

  PlaceInCell<S, Precision, K> place;
  Kokkos::View<Scalar*, typename S::memory> partial;

  std::size_t scratch_bytes() const { return Base::row_bytes(4); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank(), slots = this->blocks.slot_begin(patch);
    Local const rows(team.team_scratch(0), 4 * Base::nodes);
    this->clear(team, rows, 4);
    team.team_barrier();
    T const dx = T(static_cast<Scalar>(place.dx));
    auto const body = [&](int g, bool active) __attribute__((always_inline)) {
      Collected<T, 16> const own = collect(slots + g * Base::width);
      Weights<K, T> const at(own.vector(0));
      Vec3<T> const v = own.vector(3);
      T const m = own[15];
      auto const received = [&](int a, int b, int c, T(&row)[4]) __attribute__((always_inline)) {
        T const w = m * at.weight(a, b, c);
        row[0] = w;
        for (int k = 0; k < 3; ++k) {
          T const turned =
              T(Scalar(a)) * own[6 + k] + T(Scalar(b)) * own[9 + k] + T(Scalar(c)) * own[12 + k];
          row[1 + k] = w * (v[k] + dx * turned);
        }
      };
      this->template give<4>(team, active, this->blocks.corner.data() + slots + g * Base::width,
                             rows.data(), received);
    };
    this->in_rounds(team, patch, body);
    team.team_barrier();
    this->template take<4>(team, patch, rows, partial);
  }

private:
  /// t, the velocity at the lowest node, C by columns, mass. What fills a pack up has none.
  KOKKOS_FORCEINLINE_FUNCTION Collected<T, 16> collect(int slot) const {
    auto const& particles = place.particles;
    Collected<T, 16> to;
    for (int l = 0; l < Base::width; ++l) {
      int const p = this->blocks.like(slot + l);
      Vec3<double> const t = place(p);
      Mat3<double> const C = matrix_at(particles.C, p);
      Vec3<double> const v = C * place.to_base(t);
      for (int c = 0; c < 3; ++c) {
        to.number[c][l] = static_cast<Scalar>(t[c]);
        to.number[3 + c][l] = static_cast<Scalar>(v[c] + double(particles.v(p, c)));
      }
      for (int k = 0; k < 9; ++k) to.number[6 + k][l] = static_cast<Scalar>(C.a[k]);
      bool const is = this->blocks.particle(slot + l) >= 0;
      to.number[15][l] = is ? static_cast<Scalar>(particles.mass(p)) : Scalar(0);
    }
    return to;
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

/// The farthest that a particle of a patch goes, m.
template <class S, class Precision, Spline K>
struct ParticleTravel {
  using Scalar = typename Precision::position;
  BlockViews<K, S> blocks;
  PlaceInCell<S, Precision, K> place;
  VectorField<Scalar, S> x, rest;  ///< of the nodes
  KOKKOS_FUNCTION void operator()(int patch, double& farthest) const {
    int const slots = blocks.slot_begin(patch);
    for (int slot = slots; slot < slots + blocks.count(patch); ++slot) {
      Weights<K, double> const at(place(blocks.particle(slot)));
      int const* const node = blocks.nodes_of(patch) + blocks.corner(slot) / 4;
      Vec3<double> move{};
      for (int a = 0; a < K::width; ++a)
        for (int b = 0; b < K::width; ++b)
          for (int c = 0; c < K::width; ++c) {
            int const n = node[BlockViews<K, S>::local(a, b, c)];
            double const w = at.weight(a, b, c);
            for (int k = 0; k < 3; ++k) move[k] += w * (double(x(n, k)) - double(rest(n, k)));
          }
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
template <class S, class Precision, Spline K, class Transfer_, class Flow_, bool packed>
struct ToParticles : BlockSweep<S, typename Precision::position, K, packed> {
  using Scalar = typename Precision::position;
  using Base = BlockSweep<S, Scalar, K, packed>;
  using T = typename Base::Value;
  using Local = typename Base::Local;

  PlaceInCell<S, Precision, K> place;
  Displacement<S, Scalar> displacement;  ///< of the nodes
  NodeField<S, Scalar> v, v_before;      ///< of the nodes, at the end of the step and before it
  double h;
  Transfer_ transfer;
  Flow_ flow;

  std::size_t scratch_bytes() const { return (flips() ? 3 : 2) * Base::row_bytes(3); }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const patch = team.league_rank();
    Local const u(team.team_scratch(0), 4 * Base::nodes);
    Local const after(team.team_scratch(0), 4 * Base::nodes);
    Local const before(team.team_scratch(0), flips() ? 4 * Base::nodes : 0);
    Scalar const origin[3] = {0, 0, 0};
    this->load_from(team, patch, displacement, origin, u);
    this->load_from(team, patch, v, origin, after);
    if (flips()) this->load_from(team, patch, v_before, origin, before);
    team.team_barrier();
    int const slots = this->blocks.slot_begin(patch);
    auto const body = [&](int g) __attribute__((always_inline)) {
      move(slots + g * Base::width, u.data(), after.data(), before.data());
    };
    int const groups = packed ? this->groups(patch) : this->blocks.count(patch);
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, groups), body);
  }

private:
  KOKKOS_FORCEINLINE_FUNCTION bool flips() const { return transfer.flip != 0; }

  /// What the nodes make of a particle.
  struct Seen {
    Vec3<double> v, before, travel;
    Mat3<double> B,
        G;  ///< Sum w v a^T with a the place in the stencil, and Sum u grad w^T per cell
  };

  KOKKOS_FORCEINLINE_FUNCTION void move(int slot, Scalar const* u, Scalar const* after,
                                        Scalar const* before) const {
    Collected<T, 3> t;
    for (int l = 0; l < Base::width; ++l) {
      Vec3<double> const own = place(this->blocks.like(slot + l));
      for (int c = 0; c < 3; ++c) t.number[c][l] = static_cast<Scalar>(own[c]);
    }
    Weights<K, T> const at(t.vector(0));
    T first[3][K::width];  // weights times places
    for (int c = 0; c < 3; ++c)
      for (int a = 0; a < K::width; ++a) first[c][a] = T(Scalar(a)) * at.w[c][a];
    std::uint16_t const* const corner = this->blocks.corner.data() + slot;
    T value[3];
    Collected<T, 27> sum;
    auto const keep = [&](int to, T const* from, int count) __attribute__((always_inline)) {
      for (int k = 0; k < count; ++k) store(from[k], sum.number[to + k]);
    };
    Mat3<T> const G = Base::sums(at.w, at.d, corner, u, value);
    keep(0, value, 3);
    keep(3, G.a, 9);
    Mat3<T> const B = Base::sums(at.w, first, corner, after, value);
    keep(12, value, 3);
    keep(15, B.a, 9);
    if (flips()) {
      Base::sums(at.w, at.d, corner, before, value);
      keep(24, value, 3);
    }
    for (int l = 0; l < Base::width; ++l) {
      int const p = this->blocks.particle(slot + l);
      if (p < 0) continue;
      Seen seen{};
      auto const number = [&](int k) { return double(sum.number[k][l]); };
      for (int k = 0; k < 3; ++k) {
        seen.travel[k] = number(k);
        seen.v[k] = number(12 + k);
        if (flips()) seen.before[k] = number(24 + k);
      }
      for (int k = 0; k < 9; ++k) {
        seen.G.a[k] = number(3 + k);
        seen.B.a[k] = number(15 + k);
      }
      finish(p, {double(t.number[0][l]), double(t.number[1][l]), double(t.number[2][l])}, seen);
    }
  }

  KOKKOS_FUNCTION void finish(int p, Vec3<double> const& t, Seen const& seen) const {
    auto const& particles = place.particles;
    double const dx = place.dx;
    Mat3<double> const G = (1 / dx) * seen.G;
    Mat3<double> C = (1 / h) * G;
    if constexpr (K::inertia > 0) {
      // x_i - x_p = dx a + (from the particle to the lowest node)
      C = (1 / (K::inertia * dx * dx)) * (dx * seen.B + outer(seen.v, place.to_base(t)));
    }
    set_matrix(particles.C, p, transfer.affine(C));
    double const flip = transfer.flip;
    for (int k = 0; k < 3; ++k) {
      double const flipped = double(particles.v(p, k)) + seen.v[k] - seen.before[k];
      double const new_v = flips() ? (1 - flip) * seen.v[k] + flip * flipped : seen.v[k];
      particles.v(p, k) = static_cast<Scalar>(new_v);
      particles.x(p, k) = static_cast<Scalar>(double(particles.x(p, k)) + seen.travel[k]);
    }
    Mat3<double> const before = matrix_at(particles.F, p);
    Mat3<double> F = before + G * before;
    double plastic = double(particles.plastic(p)), stiffness = double(particles.stiffness(p));
    flow(particles.material(p), F, plastic, stiffness);
    particles.plastic(p) = static_cast<Scalar>(plastic);
    particles.stiffness(p) = static_cast<Scalar>(stiffness);
    set_matrix(particles.F, p, F);
  }
};

}  // namespace kernels

/// Masses and velocities of the nodes of a grid, and the way to and from particles. `packed` as for
/// BlockSweep.
template <Spline K, class Precision = Mixed, class Space = DefaultSpace,
          bool packed = Space::on_host>
class GridTransfer {
public:
  using Scalar = typename Precision::position;
  using Positions = VectorField<Scalar, Space>;
  using Blocks = ParticleBlocks<K, Space>;

  /// `team_size`: threads per patch where not packed.
  explicit GridTransfer(int team_size = 64) : team_size_(packed ? 1 : team_size) {}

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
  void to_grid(Particles<Precision, Space> const& particles, Blocks const& blocks, int nodes,
               double dx) {
    auto const& views = blocks.views();
    mass_ = mass_memory_.resize("node_mass", nodes);
    velocity_ = velocity_memory_.resize("node_velocity", nodes);
    grow(partial_, "transfer_partial",
         std::size_t(4) * BlockViews<K, Space>::nodes * views.patches);
    kernels::ToGrid<Space, Precision, K, packed> const kernel{
        {views}, {particles, dx, views.cell}, partial_};
    for_each_team<Space>("particles_to_grid", views.patches, team_size_, kernel.scratch_bytes(),
                         kernel);
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

  /// Moves particles by a step of h seconds in which the nodes went from `rest` to x, and their
  /// velocities changed from velocity() to v.
  template <Transfer T, Flow F>
  void to_particles(Particles<Precision, Space> const& particles, Blocks const& blocks,
                    Positions const& x, Positions const& rest, Positions const& v, double h,
                    double dx, T const& transfer, F const& flow) const {
    auto const& views = blocks.views();
    kernels::ToParticles<Space, Precision, K, T, F, packed> const kernel{
        {views}, {particles, dx, views.cell}, {x, rest}, {v}, {velocity_}, h, transfer, flow};
    for_each_team<Space>("to_particles", views.patches, team_size_, kernel.scratch_bytes(), kernel);
  }

private:
  int team_size_;
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
  auto const& views = blocks.views();
  return maximum<Space>(
      "particle_travel", views.patches, 0.0,
      kernels::ParticleTravel<Space, Precision, K>{views, {particles, dx, views.cell}, x, rest});
}

}  // namespace taut
