// A simulation in one precision, for the source files that instantiate it.
#pragma once

#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/obstacle_terms.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace taut {

/// Their numbers, five at most.
std::string first_tets(std::vector<std::int32_t> const& tets);

template <class P>
class SimulationOf final : public Simulation {
public:
  using Position = typename P::position;
  using Positions = VectorField<Position, DefaultSpace>;
  using Vectors = VectorField<typename P::real, DefaultSpace>;

  SimulationOf(Scene const& scene, SceneGeometry const& geometry)
      : scene_(with_chosen_preconditioner(scene, geometry)),
        geometry_(geometry),
        mesh_(with_obstacles(geometry)),
        order_(locality_order(mesh_, geometry.material_of_tet)),
        lumped_(masses()),
        potential_(make_potential()),
        state_(size()),
        forces_("forces", size()),
        fixed_(Kokkos::create_mirror_view(potential_.unknowns().fixed)),
        prescribed_(Kokkos::create_mirror_view(potential_.unknowns().prescribed)),
        euler_(scene_.solver, lagging(), sleep(), rigid_predictor()),
        bdf2_(scene_.solver, lagging(), sleep(), rigid_predictor()),
        static_(scene_.solver, lagging()) {
    write(state_.x, geometry.start, mesh_.points);
    write(state_.v, geometry.velocity, std::vector<Point>(size()));
    refuse_forbidden_inversion();
    refuse_many_motions();
  }

  NewtonReport step(IterationObserver const& observer) override {
    double const h = scene_.step;
    prescribe(state_.time + h, h);
    Observer<P, DefaultSpace> inner;
    if (observer) {
      inner = [&](Iteration<P, DefaultSpace> const& i) {
        observer({i.index, i.energy_change_so_far, i.error_estimate,
                  [&] { return arranged(read(i.x), true); }});
      };
    }
    std::vector<RigidMap> const before = poses();
    NewtonReport report;
    try {
      report = advance_or_say(h, inner);
    } catch (Error const&) {
      place(before);
      throw;
    }
    if (report.stop == Stop::non_finite) {
      place(before);
      auto const inverted = inverted_tets(geometry_.mesh, read(reached_));
      throw Error(
          "step {} at {:.6g} s: the energy is not a number any more ({}); use a smaller time.step, "
          "or "
          "a material that tolerates inversion",
          state_.steps + 1, state_.time,
          inverted.empty()
              ? "no element is inverted"
              : fmt::format("{} inverted elements: {}", inverted.size(), first_tets(inverted)));
    }
    return report;
  }

  double time() const override { return state_.time; }
  int steps() const override { return state_.steps; }
  std::optional<ContactReport> contact() const override {
    if (!contact_) return {};
    ContactReport all = contact_->report(state_.x);
    for (auto const& obstacle : formulas_) {
      if (!obstacle) continue;
      ContactReport const one = obstacle->report(state_.x);
      all.contacts += one.contacts;
      all.smallest_gap = std::min(all.smallest_gap, one.smallest_gap);
    }
    return all;
  }
  std::vector<Point> positions() const override { return arranged(read(state_.x), true); }
  std::vector<Point> velocities() const override { return arranged(read(state_.v), false); }

  void save(Checkpoint& checkpoint) const override {
    checkpoint.set("time", std::vector<double>{state_.time});
    checkpoint.set("last_step", std::vector<double>{state_.last_step});
    checkpoint.set("steps", std::vector<std::int32_t>{state_.steps});
    for (auto const& [name, field] : fields()) checkpoint.set(name, flat(field));
    if (sleep().on) {
      auto const record =
          scene_.scheme == TimeScheme::bdf2 ? bdf2_.sleep().record() : euler_.sleep().record();
      checkpoint.set("quiet_steps", record.quiet);
      checkpoint.set("sleep_noted", record.noted);
      checkpoint.set("sleep_pull", record.pull);
      checkpoint.set("sleep_fixed", record.fixed);
    }
    if (contact_) {
      save_field(checkpoint, "contact_activation", contact_->activation());
      for (std::size_t k = 0; k < formulas_.size(); ++k) {
        if (formulas_[k]) save_field(checkpoint, activation_name(k), formulas_[k]->activation());
      }
    }
    std::vector<double> numbers;
    for (RigidMap const& pose : poses()) {
      for (Point const& row : pose.rotation) numbers.insert(numbers.end(), row.begin(), row.end());
      numbers.insert(numbers.end(), pose.translation.begin(), pose.translation.end());
    }
    if (!numbers.empty()) checkpoint.set("obstacle_poses", numbers);
  }
  void restore(Checkpoint const& checkpoint) override {
    state_.time = checkpoint.number<double>("time");
    state_.last_step = checkpoint.number<double>("last_step");
    state_.steps = checkpoint.number<std::int32_t>("steps");
    for (auto const& [name, field] : fields()) {
      auto const& numbers = numbers_of<Position>(checkpoint, name, 3 * std::size_t(size()));
      auto const host = Kokkos::create_mirror_view(field);
      for (int i = 0; i < size(); ++i)
        for (int c = 0; c < 3; ++c) host(i, c) = numbers[3 * i + c];
      assign(field, host);
    }
    if (sleep().on) {
      typename Sleep<P, DefaultSpace>::Record const record{
          checkpoint.get<std::int32_t>("quiet_steps"), checkpoint.get<std::int32_t>("sleep_noted"),
          checkpoint.get<double>("sleep_pull"), checkpoint.get<std::int32_t>("sleep_fixed")};
      if (scene_.scheme == TimeScheme::bdf2) {
        bdf2_.sleep().restore(record);
      } else {
        euler_.sleep().restore(record);
      }
    }
    if (contact_) {
      contact_->set_activation(
          restored_field(checkpoint, "contact_activation", contact_->activation()));
      for (std::size_t k = 0; k < formulas_.size(); ++k) {
        if (!formulas_[k]) continue;
        formulas_[k]->set_activation(
            restored_field(checkpoint, activation_name(k), formulas_[k]->activation()));
      }
    }
    std::vector<RigidMap> read_poses = poses();
    if (read_poses.empty()) return;
    auto const& numbers = numbers_of<double>(checkpoint, "obstacle_poses", 12 * read_poses.size());
    auto next = numbers.begin();
    for (RigidMap& pose : read_poses) {
      for (Point& row : pose.rotation)
        for (double& entry : row) entry = *next++;
      for (double& entry : pose.translation) entry = *next++;
    }
    place(read_poses);
  }

private:
  using Lengths = Array<double, DefaultSpace>;
  static std::string activation_name(std::size_t obstacle) {
    return fmt::format("obstacle_{}_activation", obstacle);
  }
  static void save_field(Checkpoint& checkpoint, std::string const& name, Lengths const& field) {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    checkpoint.set(name, std::vector<double>(host.data(), host.data() + host.extent(0)));
  }
  /// One that is as long as `like`.
  static Lengths restored_field(Checkpoint const& checkpoint, std::string const& name,
                                Lengths const& like) {
    return to_space<DefaultSpace>("restored", numbers_of<double>(checkpoint, name, like.extent(0)));
  }
  /// Throws Error unless there are `count`.
  template <class T>
  static std::vector<T> const& numbers_of(Checkpoint const& checkpoint, std::string const& name,
                                          std::size_t count) {
    std::vector<T> const& numbers = checkpoint.get<T>(name);
    if (numbers.size() == count) return numbers;
    throw Error("the checkpoint holds {} numbers as {}, the scene needs {}; start the run again",
                numbers.size(), name, count);
  }

  /// Of bodies and of the surfaces of obstacles.
  int size() const { return static_cast<int>(mesh_.points.size()); }

  /// The bodies, and the vertices of obstacles that are surfaces: vertices without a tet.
  static TetMesh with_obstacles(SceneGeometry const& geometry) {
    TetMesh all = geometry.mesh;
    for (ObstacleSurface const& surface : geometry.obstacle_meshes) {
      if (surface.drawn_only) continue;
      all.points.insert(all.points.end(), surface.mesh.points.begin(), surface.mesh.points.end());
    }
    return all;
  }
  /// Calls visit(surface, index of its first vertex in mesh_) for those that things collide with.
  template <class Visit>
  void for_each_surface(Visit const& visit) const {
    std::size_t first = geometry_.mesh.points.size();
    for (ObstacleSurface const& surface : geometry_.obstacle_meshes) {
      if (surface.drawn_only) continue;
      visit(surface, static_cast<std::int32_t>(first));
      first += surface.mesh.points.size();
    }
  }

  /// kg, in the order of mesh_. An obstacle never moves freely, so that any mass will do.
  std::vector<double> masses() const {
    std::vector<double> density;
    for (std::int32_t m : geometry_.material_of_tet) {
      density.push_back(geometry_.materials[m].density);
    }
    std::vector<double> mass = lumped_mass(mesh_, density);
    std::size_t const bodies = geometry_.mesh.points.size();
    double const total = std::accumulate(mass.begin(), mass.end(), 0.0);
    std::fill(mass.begin() + bodies, mass.end(), total / double(bodies));
    return mass;
  }

  ProgramPotential<P> make_potential() {
    std::vector<double> mass;
    for (std::int32_t v : order_.vertices) mass.push_back(lumped_[v]);
    Unknowns<P> const unknowns(mass, mean_edge_length(geometry_.mesh));
    ProgramTerms<P> terms;
    // One term per model; the tets of a material stay together in the solver's order.
    std::vector<std::string> models;
    for (MaterialParameters const& m : geometry_.materials) {
      if (std::find(models.begin(), models.end(), m.model) == models.end())
        models.push_back(m.model);
    }
    for (std::string const& model : models) {
      ElasticPart const part = part_of(model);
      ElasticModels::with(model, [&]<class Model>() {
        add_elastic_term<Model, P>(terms, part, scene_.solver.text("curvature"));
        return true;
      });
    }
    AnySteppedTerms<P, DefaultSpace> told;
    if (scene_.contact) {
      add_contact(told, unknowns);
    } else if (!scene_.obstacles.empty()) {
      throw Error("{}: an obstacle is nothing without contact: add a table [contact]",
                  scene_.obstacles.front().where);
    }
    Point const& g = scene_.gravity;
    return ProgramPotential<P>(unknowns, Inertia<P>(unknowns),
                               BodyForce<P>(unknowns, {g[0], g[1], g[2]}), terms, told);
  }

  void add_contact(AnySteppedTerms<P, DefaultSpace>& terms, Unknowns<P> const& unknowns) {
    std::vector<int> const object = object_of_vertex();
    std::vector<Triangle> triangles;
    auto const add = [&](Triangle const& t, std::int32_t first) {
      triangles.push_back({order_.new_vertex[first + t[0]], order_.new_vertex[first + t[1]],
                           order_.new_vertex[first + t[2]]});
    };
    for (Triangle const& t : boundary_faces(geometry_.mesh.tets)) add(t, 0);
    Surface const bodies = make_surface(triangles, object);
    for_each_surface([&](ObstacleSurface const& surface, std::int32_t first) {
      for (Triangle const& t : surface.mesh.triangles) add(t, first);
    });
    ContactPart<P> part{unknowns, make_surface(std::move(triangles), object), {}, 0};
    for (std::int32_t v : order_.vertices) part.rest.push_back(mesh_.points[v]);
    // By default after the edges of the bodies, however coarse or fine the obstacles are.
    double const given = scene_.contact->number("dhat");
    part.dhat = given > 0 ? given : default_dhat(bodies, part.rest);
    contact_ = add_contact_term<P>(terms, part, *scene_.contact);
    part.surface = bodies;
    for (SceneObstacle const& obstacle : scene_.obstacles) {
      formulas_.push_back(obstacle.is_surface()
                              ? nullptr
                              : add_obstacle_term<P>(terms, part, *scene_.contact, obstacle));
    }
    refuse_outside();
    for (ObjectPart const& body : geometry_.objects) refuse_small(body, contact_->dhat());
    add_friction(terms, part);
  }
  void add_friction(AnySteppedTerms<P, DefaultSpace>& terms, ContactPart<P> const& part) const {
    double const mu = scene_.contact->number("friction");
    bool any = mu > 0;
    for (SceneObstacle const& obstacle : scene_.obstacles) any |= obstacle.friction.value_or(0) > 0;
    if (!any) return;
    // By default after the box of the bodies, however large the obstacles are.
    double const given = scene_.contact->number("stick_speed");
    double const speed = given > 0 ? given : default_stick_speed(geometry_.mesh.points);
    Friction<P> friction(part.unknowns, part.rest, {speed});
    FrictionCoefficients of_pairs(mu);
    int const bodies = static_cast<int>(geometry_.objects.size());
    for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) {
      double const own = scene_.obstacles[k].friction.value_or(mu);
      if (formulas_[k]) formulas_[k]->add_to(friction, own);
      if (formulas_[k] || own == mu) continue;
      for (int body = 0; body < bodies; ++body) {
        of_pairs.set(body, bodies + static_cast<int>(k), own);
      }
    }
    contact_->add_to(friction, of_pairs);
    terms.add(friction);
  }
  typename Sleep<P, DefaultSpace>::Params sleep() const {
    double const speed = scene_.solver.number("sleep_speed");
    if (!(speed > 0)) return {};
    std::string const& preconditioner = scene_.solver.text("preconditioner");
    std::string const& method = scene_.solver.text("method");
    bool const by_islands = scene_.solver.flag("islands") && !scene_.solver.flag("regions") &&
                            !preconditioner.starts_with("schwarz") && method != "newton" &&
                            method != "lbfgs" && method != "chebyshev";
    if (!by_islands || scene_.scheme == TimeScheme::quasi_static) {
      throw Error(
          "{}: solver.sleep_speed needs islands, which method = \"{}\" with preconditioner = "
          "\"{}\" does not go by here: choose nonlinear CG with inertia, a pointwise "
          "preconditioner, islands = true and regions = false, or sleep_speed = 0",
          scene_.file.string(), method, preconditioner);
    }
    return {.on = true, .speed = speed, .steps = scene_.solver.integer("sleep_steps")};
  }
  typename RigidPredictor<P, DefaultSpace>::Params rigid_predictor() const {
    return {.on = scene_.solver.flag("rigid_predictor")};
  }
  Lagging lagging() const {
    return {scene_.contact ? scene_.contact->integer("friction_passes") : 1};
  }
  /// What starts beyond an obstacle that is a formula, or on it.
  void refuse_outside() const {
    for (std::size_t k = 0; k < formulas_.size(); ++k) {
      if (!formulas_[k]) continue;
      for (ObjectPart const& body : geometry_.objects) {
        for (int v = 0; v < body.vertices; ++v) {
          Point const& x = geometry_.start[body.first_vertex + v];
          if (formulas_[k]->depth(x) > 0) continue;
          throw Error(
              "{}: vertex {} of object {} at ({:.6g}, {:.6g}, {:.6g}) starts {:.3g} m beyond "
              "obstacle "
              "{}: move one of them (object.NAME.translate, obstacle.NAME.translate)",
              scene_.file.string(), v, body.name, x[0], x[1], x[2], -formulas_[k]->depth(x),
              scene_.obstacles[k].name);
        }
      }
    }
  }
  /// Calls visit(number, its first vertex in mesh_, how many) for bodies, and for obstacles that
  /// are surfaces: these are numbered behind the bodies, as the scene lists all of them.
  template <class Visit>
  void for_each_object(Visit const& visit) const {
    int const bodies = static_cast<int>(geometry_.objects.size());
    for (int k = 0; k < bodies; ++k) {
      visit(k, geometry_.objects[k].first_vertex, geometry_.objects[k].vertices);
    }
    for_each_surface([&](ObstacleSurface const& surface, std::int32_t first) {
      visit(bodies + static_cast<int>(surface.obstacle), first,
            static_cast<std::int32_t>(surface.mesh.points.size()));
    });
  }
  std::string const& name_of(int object) const {
    int const bodies = static_cast<int>(geometry_.objects.size());
    return object < bodies ? geometry_.objects[object].name
                           : scene_.obstacles[object - bodies].name;
  }
  std::vector<int> object_of_vertex() const {
    std::vector<int> object(size());
    for_each_object([&](int number, std::int32_t first, std::int32_t count) {
      for (std::int32_t v = first; v < first + count; ++v) object[order_.new_vertex[v]] = number;
    });
    return object;
  }
  /// A body that is nowhere further from another side of itself than dhat.
  void refuse_small(ObjectPart const& body, double dhat) const {
    auto const first = geometry_.mesh.points.begin() + body.first_vertex;
    double largest = 0;
    for (int c = 0; c < 3; ++c) {
      auto const [low, high] =
          std::minmax_element(first, first + body.vertices,
                              [&](Point const& a, Point const& b) { return a[c] < b[c]; });
      largest = std::max(largest, (*high)[c] - (*low)[c]);
    }
    if (dhat < largest) return;
    throw Error(
        "{}: contact begins to act at {:.3g} m (contact.dhat), but object {} is only {:.3g} m "
        "long: "
        "reduce contact.dhat",
        scene_.file.string(), dhat, body.name, largest);
  }

  ElasticPart part_of(std::string const& model) const {
    ElasticPart part;
    for (std::int32_t v : order_.vertices) part.rest.points.push_back(mesh_.points[v]);
    for (MaterialParameters const& m : geometry_.materials) {
      part.materials.push_back(lame_parameters(m.young, m.poisson));
    }
    for (std::int32_t t : order_.tets) {
      int const m = geometry_.material_of_tet[t];
      if (geometry_.materials[m].model != model) continue;
      Tet tet;
      for (int a = 0; a < 4; ++a) tet[a] = order_.new_vertex[geometry_.mesh.tets[t][a]];
      part.rest.tets.push_back(tet);
      part.material_of_tet.push_back(m);
    }
    return part;
  }

  void refuse_forbidden_inversion() const {
    for (std::int32_t t : inverted_tets(geometry_.mesh, geometry_.start)) {
      std::string const& model = geometry_.materials[geometry_.material_of_tet[t]].model;
      bool const allowed =
          ElasticModels::with(model, []<class Model>() { return Model::allows_inversion; });
      if (!allowed) {
        throw Error(
            "{}: element {} starts inverted or flat, which {} forbids: start it at rest or choose "
            "a "
            "model that tolerates inversion",
            scene_.file.string(), t, model);
      }
    }
  }

  /// What never moves has one mark. Every other pin and obstacle has one of its own, as long as
  /// there are any left: those of one mark are not kept apart, which contact must not be given.
  class Marks {
  public:
    static constexpr int of_motions = std::numeric_limits<std::uint8_t>::max() - 1;
    std::uint8_t next(RigidMotion const& motion) {
      if (motion.phases.empty()) return still;
      if (last_ - still < of_motions) ++last_;
      return last_;
    }

  private:
    static constexpr std::uint8_t still = 1;
    std::uint8_t last_ = still;
  };
  void refuse_many_motions() const {
    if (!scene_.contact) return;
    auto const pins = std::count_if(geometry_.pins.begin(), geometry_.pins.end(),
                                    [](Pin const& pin) { return !pin.motion.phases.empty(); });
    int obstacles = 0;
    for_each_surface([&](ObstacleSurface const& surface, std::int32_t) {
      obstacles += !scene_.obstacles[surface.obstacle].motion.phases.empty();
    });
    if (pins + obstacles <= Marks::of_motions) return;
    throw Error(
        "{}: {} pins and {} obstacles of triangles move, and contact keeps no more than {} of them "
        "apart: make one pin of those that move alike (a list of selections), or let fewer move",
        scene_.file.string(), pins, obstacles, Marks::of_motions);
  }

  /// Pins and forces of the step that ends at time t.
  void prescribe(double t, double h) {
    assign(fixed_, std::uint8_t(0));
    Marks marks;
    for (Pin const& pin : geometry_.pins) {
      std::uint8_t const mark = marks.next(pin.motion);
      if (!pin.window.covers_step(t, h)) continue;
      RigidMap const map = pin.motion.at(t);
      for (std::int32_t v : pin.vertices) {
        prescribe_vertex(order_.new_vertex[v], map(geometry_.mesh.points[v]), mark);
      }
    }
    for_each_surface([&](ObstacleSurface const& surface, std::int32_t first) {
      RigidMotion const& motion = scene_.obstacles[surface.obstacle].motion;
      std::uint8_t const mark = marks.next(motion);
      RigidMap const map = motion.at(t);
      for (std::size_t v = 0; v < surface.mesh.points.size(); ++v) {
        prescribe_vertex(order_.new_vertex[first + v], map(surface.mesh.points[v]), mark);
      }
    });
    for (std::size_t k = 0; k < formulas_.size(); ++k) {
      SceneObstacle const& obstacle = scene_.obstacles[k];
      if (formulas_[k]) formulas_[k]->move_to(compose(obstacle.motion.at(t), obstacle.placement));
    }
    assign(potential_.unknowns().fixed, fixed_);
    assign(potential_.unknowns().prescribed, prescribed_);

    bool any = false;
    auto const host = Kokkos::create_mirror_view(forces_);
    assign(host, 0);
    for (Force const& force : geometry_.forces) {
      if (!force.window.covers_step(t, h)) continue;
      any = true;
      for (std::size_t k = 0; k < force.vertices.size(); ++k) {
        std::int32_t const v = force.vertices[k];
        for (int c = 0; c < 3; ++c) {
          double f = lumped_[v] * force.acceleration[c];
          if (!force.force.empty()) f += force.force[k][c];
          host(order_.new_vertex[v], c) += static_cast<typename P::real>(f);
        }
      }
    }
    assign(forces_, host);
    potential_.template term<BodyForce<P>>().set_forces(any ? forces_ : Vectors());
  }

  void prescribe_vertex(int i, Point const& to, std::uint8_t mark) {
    fixed_(i) = mark;
    for (int c = 0; c < 3; ++c) prescribed_(i, c) = static_cast<Position>(to[c]);
  }

  /// Where space around an obstacle that is a formula has been brought since time 0.
  RigidMap place_of(std::size_t obstacle) const {
    return compose(formulas_[obstacle]->pose(), inverse(scene_.obstacles[obstacle].placement));
  }
  /// Of all obstacles that are formulas.
  std::vector<RigidMap> poses() const {
    std::vector<RigidMap> all;
    for (auto const& obstacle : formulas_) {
      if (obstacle) all.push_back(obstacle->pose());
    }
    return all;
  }
  void place(std::vector<RigidMap> const& all) const {
    auto next = all.begin();
    for (auto const& obstacle : formulas_) {
      if (obstacle) obstacle->place(*next++);
    }
  }

  /// Names what holds up pins.
  NewtonReport advance_or_say(double h, Observer<P, DefaultSpace> const& observer) {
    try {
      return advance(h, observer);
    } catch (HeldUp const& held) {
      std::vector<std::string> pins;
      for (Pin const& pin : geometry_.pins) {
        if (pin.window.covers_step(state_.time + h, h)) pins.push_back(pin.name);
      }
      for (SceneObstacle const& obstacle : scene_.obstacles) {
        if (!obstacle.motion.phases.empty()) pins.push_back(obstacle.name);
      }
      auto const& unknowns = held.by().unknowns;
      throw Error(
          "step {} at {:.6g} s: what moves by script ({}) is held up by {}{}{}: let it move less "
          "or "
          "slower, give the bodies room, or release the pin",
          state_.steps + 1, state_.time, fmt::join(pins, ", "), held.by().what,
          unknowns.empty() ? "" : ", ", names_of(unknowns));
    }
  }
  /// "vertex 12 of mat, vertices 3, 4, 5 of floor", numbered as in the meshes of the objects.
  std::string names_of(std::vector<int> const& unknowns) const {
    std::string text;
    for_each_object([&](int number, std::int32_t first, std::int32_t count) {
      std::vector<int> inside;
      for (int i : unknowns) {
        int const v = order_.vertices[i] - first;
        if (v >= 0 && v < count) inside.push_back(v);
      }
      if (inside.empty()) return;
      text += fmt::format("{}{} {} of {}", text.empty() ? "" : ", ",
                          inside.size() == 1 ? "vertex" : "vertices", fmt::join(inside, ", "),
                          name_of(number));
    });
    return text;
  }

  NewtonReport advance(double h, Observer<P, DefaultSpace> const& observer) {
    auto const run = [&](auto& stepper) {
      NewtonReport const report = stepper.step(potential_, state_, h, observer);
      reached_ = stepper.reached();
      return report;
    };
    switch (scene_.scheme) {
      case TimeScheme::bdf2:
        return run(bdf2_);
      case TimeScheme::quasi_static:
        return run(static_);
      default:
        return run(euler_);
    }
  }

  template <class Field>
  void write(Field const& field, std::vector<Point> const& bodies, std::vector<Point> all) const {
    std::copy(bodies.begin(), bodies.end(), all.begin());  // behind them, obstacles
    auto const host = Kokkos::create_mirror_view(field);
    for (int i = 0; i < size(); ++i)
      for (int c = 0; c < 3; ++c) host(i, c) = static_cast<Position>(all[order_.vertices[i]][c]);
    assign(field, host);
  }
  std::vector<Point> read(Positions const& field) const {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    std::vector<Point> to(size());
    for (int i = 0; i < size(); ++i)
      for (int c = 0; c < 3; ++c) to[order_.vertices[i]][c] = host(i, c);
    return to;
  }
  /// From the order of mesh_ to that of the scene's obstacles: puts those that are drawn only among
  /// the others, at their `places` or with zeros.
  std::vector<Point> arranged(std::vector<Point> const& all, bool places) const {
    auto next = all.begin() + std::ssize(geometry_.mesh.points);
    std::vector<Point> to(all.begin(), next);
    for (ObstacleSurface const& surface : geometry_.obstacle_meshes) {
      auto const count = std::ssize(surface.mesh.points);
      if (!surface.drawn_only) {
        to.insert(to.end(), next, next + count);
        next += count;
      } else if (places) {
        RigidMap const place = place_of(surface.obstacle);
        for (Point const& x : surface.mesh.points) to.push_back(place(x));
      } else {
        to.insert(to.end(), count, Point{});
      }
    }
    return to;
  }
  std::vector<Position> flat(Positions const& field) const {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    std::vector<Position> to;
    for (int i = 0; i < size(); ++i)
      for (int c = 0; c < 3; ++c) to.push_back(host(i, c));
    return to;
  }
  std::vector<std::pair<std::string, Positions>> fields() const {
    return {{"x", state_.x}, {"v", state_.v}, {"x_last", state_.x_last}, {"v_last", state_.v_last}};
  }
  Scene scene_;
  SceneGeometry geometry_;
  TetMesh mesh_;  ///< of the scene, with the vertices of obstacles
  Ordering order_;
  std::vector<double> lumped_;                        ///< kg, in the order of mesh_
  std::shared_ptr<ProgramContact<P> const> contact_;  ///< null: nothing keeps bodies apart
  std::vector<std::shared_ptr<ProgramObstacle<P> const>> formulas_;  ///< null: it is a surface
  ProgramPotential<P> potential_;
  State<P> state_;
  Positions reached_;  ///< by the last minimisation, also where the step was then refused
  Vectors forces_;
  typename FixedMask<DefaultSpace>::HostMirror fixed_;
  typename Positions::HostMirror prescribed_;
  ImplicitEuler<AnyMinimiser<P>> euler_;
  Bdf2<AnyMinimiser<P>> bdf2_;
  QuasiStatic<AnyMinimiser<P>> static_;
};

template <class P>
std::unique_ptr<Simulation> make_simulation(Scene const& scene, SceneGeometry const& geometry) {
  return std::make_unique<SimulationOf<P>>(scene, geometry);
}

inline constinit LatePart<std::unique_ptr<Simulation>(Scene const&, SceneGeometry const&)>
    simulation_in_mixed, simulation_in_fp32;

}  // namespace taut
