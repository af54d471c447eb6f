// A rigid obstacle that is a formula: a swept term of the potential,
//
//   V(x) = Sum over vertices v of the surface and faces f of the obstacle of  K_v b(g_f(x_v)),
//
// which keeps bodies within a convex set (obstacle_shapes.hpp: why inside, and what else there is
// to do), with the barriers of contact between bodies (barrier.hpp) and its rules of stiffness
// (stiffness.hpp). A surface that lies on it resists like a layer of thickness dhat, of modulus P
// if that is given: then a body rests at a gap that depends on the load over P and on dhat alone,
// not on the time step and not on the mesh.
//
// The obstacle may move (MovingTerm): move_to says where it is to be at the end of the step, and
// within the step it goes there as prescribed unknowns do, in portions, each as far as nothing is
// crossed. On the way its centre goes straight while it turns about the centre, by less than half a
// turn. An obstacle that does not move has no sweep of its own in any of this.
#pragma once

#include <taut/contact/adaptive_stiffness.hpp>
#include <taut/contact/lag_obstacle.hpp>
#include <taut/contact/obstacle_kernels.hpp>
#include <taut/contact/start_activation.hpp>
#include <taut/core/exec/copy.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace taut {

/// What an obstacle amounts to at some positions. What is fixed does not count.
struct ObstacleReport {
  int contacts = 0;             ///< pairs of a vertex and a face that act
  double smallest_gap = 1;      ///< least distance over dhat, 1 if it is more
  Vec3<double> force{0, 0, 0};  ///< on the bodies, N
};

/// The area that each vertex turns towards something flat, m^2: the most, over the normals of the
/// triangles around it, that a third of them shows in that direction. On a smooth surface that is
/// the area that the vertex stands for (vertex_areas); at an edge of a block it leaves out the
/// other side of the edge, so that the faces of a block bear as they would were they alone.
inline std::vector<double> shown_areas(Surface const& surface, std::span<Point const> points) {
  std::vector<std::vector<Vec3<double>>> around(points.size());
  for (Triangle const& t : surface.triangles) {
    Vec3<double> edge[2];
    for (int k = 0; k < 2; ++k)
      for (int c = 0; c < 3; ++c) edge[k][c] = points[t[k + 1]][c] - points[t[0]][c];
    for (int corner : t) around[corner].push_back((1.0 / 6) * cross(edge[0], edge[1]));
  }
  std::vector<double> area(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (Vec3<double> const& towards : around[v]) {
      double shown = 0;
      for (Vec3<double> const& a : around[v]) shown += std::max(0.0, dot(a, towards));
      double const length = norm(towards);
      if (length > 0) area[v] = std::max(area[v], shown / length);
    }
  }
  return area;
}

/// What stopped a step.
struct LimitingVertex {
  int vertex;    ///< of the mesh
  int face;      ///< of the shape
  double alpha;  ///< the bound; 0: the gap is nil or not above round-off, no step is proved safe
};

template <ObstacleShape Shape_, Barrier Barrier_ = Normalised<LogBarrier>,
          class Stiffness_ = ElasticInclusiveStiffness, class Precision_ = Mixed,
          class Space_ = DefaultSpace>
class Obstacle {
public:
  using Shape = Shape_;
  using Barrier = Barrier_;
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using Fixed = FixedMask<Space>;

  static_assert(VertexStiffnessRule<Stiffness_, Precision, Space>,
                "taut: the stiffness of an Obstacle must satisfy VertexStiffnessRule "
                "(contact/stiffness.hpp)");

  struct Params {
    std::optional<double> dhat = {};  ///< m; else default_dhat (surface.hpp)
    double start_share = 0.9;         ///< as in Contact
    Barrier_ barrier = {};
    Stiffness_ stiffness = {};
    Clearance clearance = {.share = 0.45};  ///< as in Contact
  };

  /// `surface`: whose vertices the obstacle keeps out; `rest`: where the mesh is at rest, m, one
  /// point per unknown. The obstacle is at rest at `pose`. Copies share everything: they are one
  /// obstacle. Throws Error where something does not fit or has no size.
  Obstacle(Unknowns<Precision, Space> const& unknowns, Surface const& surface,
           std::vector<Point> const& rest, Shape const& shape, Params const& params,
           RigidPose const& pose = {})
      : state_(std::make_shared<State>(unknowns, surface, rest, shape, params, pose)) {}

  double value(Positions const& x, double scale) const {
    using Kernel = kernels::ObstacleValue<Table>;
    return scale * sum<1>("obstacle_value", Kernel{table(), x})[0];
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    using Kernel = kernels::ObstacleChange<Table>;
    return scale * sum<1>("obstacle_change", Kernel{table(), x, p, alpha, false})[0];
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    using Kernel = kernels::ObstacleForm<Table>;
    return scale * sum<1>("obstacle_form", Kernel{table(), x, p})[0];
  }

  void add_form_shares(Positions const& x, Vectors const& p, double scale, Fixed const&,
                       Array<double, Space> const& shares) const {
    using Form = kernels::ObstacleForm<Table>;
    for_each<Space>("obstacle_shares", vertices(),
                    kernels::ObstacleShares<Form, Space>{Form{table(), x, p}, scale, shares});
  }

  void mark_acting(Positions const& x, Fixed const&, Array<int, Space> const& marks) const {
    for_each<Space>("obstacle_marks", vertices(),
                    kernels::MarkTouched<Table, Space>{table(), x, marks});
  }

  void add_gradient(Positions const& x, double scale, Fixed const&, Vectors const& g) const {
    gradient<0>(x, scale, g, g);
  }
  void add_gradient(Positions const& x, double scale, Fixed const&, Vectors const& g,
                    Vectors const& diagonal) const {
    gradient<3>(x, scale, g, diagonal);
  }
  void add_gradient(Positions const& x, double scale, Fixed const&, Vectors const& g,
                    Blocks const& blocks) const {
    gradient<6>(x, scale, g, blocks);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const&, Vectors const& g) const {
    return gradient_after<0>(x, p, alpha, scale, g, g);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const&, Vectors const& g, Vectors const& diagonal) const {
    return gradient_after<3>(x, p, alpha, scale, g, diagonal);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const&, Vectors const& g, Blocks const& blocks) const {
    return gradient_after<6>(x, p, alpha, scale, g, blocks);
  }

  void add_product(Positions const& x, Vectors const& p, double scale, Fixed const&,
                   Vectors const& hp) const {
    using Kernel = kernels::ObstacleProduct<Table>;
    for_each<Space>("obstacle_product", vertices(), Kernel{table(), x, p, scale, hp});
  }
  void add_to(Matrix const& matrix, Positions const& x, double scale, Fixed const&) const {
    using Kernel = kernels::ObstacleAssemble<Table, Space>;
    for_each<Space>("obstacle_assemble", vertices(), Kernel{table(), x, scale, matrix});
  }
  /// An obstacle couples no unknowns.
  void elements(std::vector<Connectivity>&) const {}

  /// The longest step up to `at_most` that is certain to leave every vertex its clearance (also
  /// where the step is stored), with the obstacle where it is; 0 if the gap of a vertex that moves
  /// is nil or not above round-off. Throws Error where p is not finite.
  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    return state_->bound({}, x, p, at_most);
  }
  /// As max_advance: prescribed motion goes by the same share as the obstacle, and may not cross it
  /// either, but for what the obstacle holds.
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    return max_advance(x, p, at_most);
  }
  /// What the last bound was cut by; none if it was not.
  std::optional<LimitingVertex> limiting_vertex() const { return state_->limiting; }
  std::optional<Obstruction> obstruction() const {
    auto const& at = state_->limiting;
    if (!at) return {};
    return Obstruction{fmt::format("a vertex at face {} of a {}", at->face, Shape::name),
                       {at->vertex}};
  }

  /// Takes over the stiffness per vertex, for rules that need it, and looks whether all is inside:
  /// throws Error, which names the vertex, if one that is free is not, or is no further from a face
  /// than round-off. What is fixed and not inside when the obstacle first meets it is held by the
  /// obstacle and free to go where it is told.
  void begin_step(StepStart<Precision, Space> const& start) const {
    state_->take_stiffness(start.stiffness);
    state_->enter(start.x);
    if (state_->start.is_short()) {
      state_->start.raise(kernels::FaceGap<Table>{state_->table, start.x});
    }
    FaceMotion const& motion = state_->track.motion();
    state_->carry = {turn_matrix(motion.turn), motion.along};
    state_->begun = state_->track.pose().rotation;
    if constexpr (AdaptiveRule<Stiffness_>) {
      Stiffness_& rule = state_->table.rule;
      if (!rule.adapts()) return;
      rule.reset();
      rule.adapt(balance_of(state_->table.barrier, *this, start, state_->table.fields.fixed,
                            state_->size));
    }
  }

  /// For friction: appends what acts at x; the coefficient of object k of the surface is mu(k, k).
  void lag(Positions const& x, kernels::FrictionMatrix<Space> const& mu,
           LaggedContacts<Precision, Space>& to) const {
    using Kernel = kernels::LagFace<Table, Precision, Space>;
    // Within the step, what is at x now was elsewhere on the way that it goes.
    state_->carry.centre = state_->table.faces.origin;
    state_->carry.back = state_->begun * transpose(state_->track.pose().rotation);
    to.append("obstacle_lag", vertices() * Shape::max_faces,
              Kernel{table(), x, state_->object, mu, state_->carry});
  }

  /// Where the obstacle is, and where it is told to go.
  RigidPose const& pose() const { return state_->track.pose(); }
  RigidPose const& target() const { return state_->track.target(); }
  /// Where the obstacle is to be at the end of the next step. Throws Error if that is no pose.
  void move_to(RigidPose const& target) const { state_->track.move_to(target); }
  /// Puts it there, at rest, whatever is in the way (at the start, from a checkpoint, to take back
  /// a step): the next begin_step looks at all anew.
  void place(RigidPose const& pose) const { state_->place(pose); }

  /// The longest way that the obstacle still has to take what is at the vertices of the surface,
  /// m; 0 if it has arrived.
  double motion_left(Positions const& x) const { return state_->motion_left(x); }
  /// How far it may go on, as a share of what is left (beyond 1: of that motion continued), with
  /// vertices that go by the same share of p: the longest of [0, at_most] that is certain to leave
  /// every vertex its clearance, and every shorter one too. Never above 16 while the obstacle
  /// moves; the same as max_step while it does not.
  double max_advance(Positions const& x, Vectors const& p, double at_most) const {
    constexpr double far = 16;
    FaceMotion const& motion = state_->track.motion();
    return state_->bound(motion, x, p, motion.moves ? std::min(at_most, far) : at_most);
  }
  /// Goes on by this share of what is left; from 1 on it lands exactly.
  void advance(double fraction) const { state_->advance(fraction); }

  Shape const& shape() const { return state_->shape; }
  double dhat() const { return state_->table.fields.dhat; }
  /// For checkpoints: below what each vertex of the surface is acted on, m.
  Array<double, Space> activation() const { return state_->table.activation; }
  void set_activation(Array<double, Space> const& of_vertex) const { state_->start.set(of_vertex); }
  ObstacleReport report(Positions const& x) const {
    using Forces = kernels::SumObstacleForces<Table>;
    auto const total = sum<4>("obstacle_forces", Forces{table(), x});
    using Gap = kernels::LeastObstacleGap<Table>;
    double const gap = minimum<Space>("obstacle_gap", vertices(), 1.0, Gap{{table(), x}});
    return {static_cast<int>(total[3]), gap, {total[0], total[1], total[2]}};
  }
  /// How many fixed vertices the obstacle holds (see begin_step).
  int held() const {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), state_->table.held);
    int count = 0;
    for (std::size_t i = 0; i < host.extent(0); ++i) count += host(i) != 0;
    return count;
  }

private:
  using Table = kernels::ObstacleTable<Shape::max_faces, Barrier, Stiffness_, Precision, Space>;

  struct State {
    Shape shape;
    Clearance clearance;
    Table table;
    ObstacleTrack track;
    ObstacleCarry carry;                           ///< in the step that has begun
    Mat3<double> begun = identity3<double>();      ///< how it was turned then
    typename SurfaceViews<Space>::Indices object;  ///< per vertex of the mesh
    bool anew = true;              ///< nothing is known yet of what the obstacle holds
    StartActivation<Space> start;  ///< per vertex of the surface
    std::optional<LimitingVertex> limiting;
    double size;  ///< the diagonal of the box around the surface at rest, m
    Reducer<Space, double> reducer;

    State(Unknowns<Precision, Space> const& unknowns, Surface const& host,
          std::vector<Point> const& rest, Shape const& given, Params const& params,
          RigidPose const& pose)
        : shape(given), clearance(params.clearance), track(given.centre()) {
      if (rest.size() != host.object.size() || rest.size() != std::size_t(unknowns.size())) {
        throw Error(
            "obstacle: {} positions at rest, a surface over {} vertices and {} unknowns: give as "
            "many of each",
            rest.size(), host.object.size(), unknowns.size());
      }
      EdgeLengths const edges = edge_lengths(host, rest);
      if (!(edges.min > 0)) {
        throw Error("obstacle: a surface without edges, or with one of length zero: remove it");
      }
      double const dhat = params.dhat.value_or(default_dhat(host, rest));
      check(params, dhat);
      clearance.ample = std::min(clearance.ample, dhat);
      size = box_diagonal(host, rest);
      table.vertex = to_space<Space>("obstacle_vertex", host.vertices);
      object = to_space<Space>("obstacle_object", host.object);
      table.held = Fixed("obstacle_held", host.vertices.size());
      start = {"obstacle", host.vertices.size(), dhat, params.start_share};
      table.activation = start.of_vertex();
      table.barrier = params.barrier;
      table.rule = params.stiffness;
      table.fields = {area_of(host, rest), {}, unknowns.fixed, dhat};
      reducer = Reducer<Space, double>(vertices(), 4);
      place(pose);
    }
    void check(Params const& params, double dhat) const {
      if (!(dhat > 0) || !std::isfinite(dhat)) {
        throw Error("obstacle: an activation distance of {} m: give one above 0", dhat);
      }
      if (!params.stiffness.valid()) {
        throw Error("obstacle: the stiffness rule '{}' needs a positive stiffness (stiffness.hpp)",
                    Stiffness_::name);
      }
      kernels::check_clearance(params.clearance, 1);
      shape.check();
      for (int f = 0; f < shape.faces(); ++f) {
        ObstacleFace const face = shape.face(f);
        // The distance has a kink in the middle of a round face, where a barrier must not act.
        if (face.kind == FaceKind::plane || dhat < face.size) continue;
        throw Error(
            "obstacle: a {} with a radius of {} m for an activation distance of {} m: make dhat "
            "shorter than the radius",
            Shape::name, face.size, dhat);
      }
    }
    static Array<Real, Space> area_of(Surface const& host, std::vector<Point> const& rest) {
      Array<Real, Space> const field("obstacle_area", rest.size());
      std::vector<double> const area = shown_areas(host, rest);
      auto const to = Kokkos::create_mirror_view(field);
      for (int v : host.vertices) {
        to(v) = static_cast<Real>(area[v]);
        if (!(to(v) > 0)) {
          throw Error("obstacle: the triangles around vertex {} have no area: mend the mesh", v);
        }
      }
      assign(field, to);
      return field;
    }
    int vertices() const { return static_cast<int>(table.vertex.extent(0)); }

    void place(RigidPose const& pose) {
      track.place(pose);
      anew = true;
      table.faces = taut::place(shape, track.pose());
    }
    void advance(double fraction) {
      track.advance(fraction);
      table.faces = taut::place(shape, track.pose());
    }

    void take_stiffness(Array<Real, Space> const& stiffness) {
      if (!Stiffness_::per_vertex) return;
      if (stiffness.extent(0) != table.fields.area.extent(0)) {
        throw Error("obstacle: a stiffness for {} vertices, but there are {}", stiffness.extent(0),
                    table.fields.area.extent(0));
      }
      if (table.fields.stiffness.extent(0) == 0) {
        table.fields.stiffness = Array<Real, Space>("obstacle_stiffness", stiffness.extent(0));
      }
      assign_on<Space>(table.fields.stiffness, stiffness);
    }

    void enter(Positions const& x) {
      BoundedStep const worst =
          join_all<Space>("obstacle_enter", vertices(),
                          kernels::EnterObstacle<Table>{
                              {Kokkos::Experimental::infinity_v<double>}, table, x, anew});
      if (!(worst.alpha > 0)) refuse(vertex_of(worst), x);
      anew = false;
    }
    [[noreturn]] void refuse(LimitingVertex const& at, Positions const& x) const {
      auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), x);
      Vec3<double> y;
      for (int c = 0; c < 3; ++c) y[c] = double(host(at.vertex, c));
      double const gap = distance_to(table.faces.face[at.face], y - table.faces.origin).distance;
      char const* const where = gap > 0 ? "which is not above round-off" : "that is, beyond it";
      throw Error(
          "obstacle: vertex {} at ({}, {}, {}) is {:.6g} m from face {} of a {}, {}: move the body "
          "or "
          "the obstacle until there is a gap between them, or pin the vertex",
          at.vertex, y[0], y[1], y[2], gap, at.face, Shape::name, where);
    }
    LimitingVertex vertex_of(BoundedStep const& step) const {
      int const i = step.pair / Shape::max_faces;
      int vertex;
      Kokkos::deep_copy(vertex, Kokkos::subview(table.vertex, i));
      return {vertex, step.pair % Shape::max_faces, step.alpha};
    }

    double bound(FaceMotion const& motion, Positions const& x, Vectors const& p, double at_most) {
      limiting.reset();
      if (!(at_most > 0)) return at_most;
      BoundedStep const step =
          join_all<Space>("obstacle_bound", vertices(),
                          kernels::BoundFaces<Table>{{at_most}, table, clearance, motion, x, p});
      if (step.pair < 0) return at_most;
      if (step.alpha < 0) {
        throw Error(
            "obstacle: a step by a vector that is not finite, at vertex {}: look for what made it",
            vertex_of(step).vertex);
      }
      limiting = vertex_of(step);
      return step.alpha;
    }
    double motion_left(Positions const& x) const {
      FaceMotion const& motion = track.motion();
      if (!motion.moves) return 0;
      return maximum<Space>(
          "obstacle_carry", vertices(), 0.0,
          kernels::LongestCarry<Table>{table, motion, turn_matrix(motion.turn), x});
    }
  };

  int vertices() const { return state_->vertices(); }
  Table const& table() const {
    if (Stiffness_::per_vertex && state_->table.fields.stiffness.extent(0) == 0) {
      throw Error(
          "obstacle: the stiffness rule '{}' needs to be told when a step begins: call begin_step "
          "first, of the potential or of the term",
          Stiffness_::name);
    }
    return state_->table;
  }
  template <int K, class Kernel>
  Sums<double, K> sum(char const* name, Kernel const& kernel) const {
    return state_->reducer.template sum<K>(name, vertices(), kernel);
  }

  template <int numbers, class CurvatureField>
  using Gradient = kernels::ObstacleGradient<Table, numbers, CurvatureField>;

  template <int numbers, class CurvatureField>
  void gradient(Positions const& x, double scale, Vectors const& g, CurvatureField const& c) const {
    for_each<Space>("obstacle_gradient", vertices(),
                    Gradient<numbers, CurvatureField>{table(), x, scale, g, c});
  }
  template <int numbers, class CurvatureField>
  double gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                        Vectors const& g, CurvatureField const& c) const {
    using Kernel = kernels::ObstacleGradientAfter<Table, numbers, CurvatureField>;
    return scale * sum<1>("obstacle_gradient_after",
                          Kernel{{table(), x, scale, g, c}, {table(), x, p, alpha, true}})[0];
  }

  std::shared_ptr<State> state_;
};

}  // namespace taut
