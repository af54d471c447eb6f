// `taut run`: steps a scene and writes its result, report and checkpoints.
#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/apps/program/intersections.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/run_loop.hpp>
#include <taut/apps/program/scene_result.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <span>

namespace taut {

namespace {

/// What starts intersecting stays so where there is contact. Where there is none, it may be meant
/// to: it is warned of, unless the run is to be free of intersections.
void check_start(Scene const& scene, SceneGeometry& geometry, std::span<Point const> start,
                 ObjectIntersections const& surface, RunOptions const& options) {
  auto const found = surface.find(start);
  if (found.empty()) return;
  std::string const what =
      fmt::format("{}: the scene starts with {}; the first: {}", scene.file.string(),
                  surface.count(found), surface.text(found.front()));
  if (scene.contact || (options.check != CheckRun::off && !options.restart)) {
    bool const obstacle = std::any_of(found.begin(), found.end(), [&](Intersection const& i) {
      return surface.with_obstacle(i);
    });
    throw Error("{}. Move the objects apart (object.NAME.translate{}){}", what,
                obstacle ? " or obstacle.NAME.translate" : "",
                scene.contact
                    ? ", or let one that meets itself start at rest"
                    : ", let one that meets itself start at rest, or run without --check");
  }
  geometry.warnings.push_back(what + ". Nothing keeps bodies apart: [contact] would");
}

/// An iteration of a step leaves intersections.
class IntersectingIteration : public Error {
  using Error::Error;
};

/// The run of a scene of meshes.
class MeshRun final : public RunLoop {
public:
  /// `surface`: where steps, or also iterations, are to be checked.
  MeshRun(Scene const& scene, SceneGeometry const& geometry, RunOptions const& options,
          ObjectIntersections const* surface)
      : RunLoop(scene, options, result_mesh(scene, geometry),
                run_identity(options.scene.changes, scene, geometry)),
        scene_(scene),
        geometry_(geometry),
        surface_(surface),
        check_(options.check),
        simulation_(Simulation::create(scene, geometry)) {}

private:
  Simulation& simulation() override { return *simulation_; }

  void before_step() override {
    before_ = {};
    if (surface_) simulation_->save(before_);
  }
  NewtonReport step() override {
    try {
      return simulation_->step(watch_iterations());
    } catch (IntersectingIteration const&) {
      take_back();
      throw;
    }
  }
  void accept_step() override {
    if (surface_) refuse_intersections();
  }

  void add_to_line(Record& line) override {
    if (auto const contact = simulation().contact()) {
      totals().contacts += contact->contacts;
      totals().most_contacts = std::max(totals().most_contacts, double(contact->contacts));
      totals().smallest_gap = std::min(totals().smallest_gap, contact->smallest_gap);
      line.set("contacts", contact->contacts)
          .set("candidates", contact->candidates)
          .set("smallest_gap", contact->smallest_gap);
    }
    if (scene_.output.check) {
      auto const inverted = inverted_tets(geometry_.mesh, simulation().positions()).size();
      totals().most_inverted = std::max(totals().most_inverted, static_cast<double>(inverted));
      totals().inverted_steps += inverted > 0;
      line.set("inverted", inverted);
    }
  }

  /// After a step that leaves intersections: takes it back and throws.
  void refuse_intersections() {
    auto const found = surface_->find(simulation_->positions());
    if (found.empty()) {
      ++totals().checked_steps;
      return;
    }
    int const step = simulation_->steps();
    double const time = simulation_->time();
    take_back();
    throw Error("step {} at {:.6g} s leaves {}; the first: {}. {}", step, time,
                surface_->count(found), surface_->text(found.front()), what_now());
  }
  /// Of a step with intersections: goes back to the state before it and puts that into the result.
  void take_back() {
    ++totals().checked_steps;
    ++totals().intersecting_steps;
    simulation_->restore(before_);
    write_frame_off_grid();
  }
  std::string what_now() const {
    return fmt::format(
        "The state before it is the last frame. {}: --restart without --check goes on",
        who_is_to_blame());
  }
  std::string who_is_to_blame() const {
    if (!scene_.contact) return "Nothing keeps bodies apart, add a table [contact]";
    if (scene_.contact->text("bound") == "half_dhat") {
      return "contact.bound = \"half_dhat\" is no guarantee, use additive_ccd";
    }
    return "That must not happen with contact, report it together with the scene";
  }
  /// What the steps were looked at for, by all legs of the run.
  std::string intersections() const {
    RunTotals const& t = totals();
    if (t.checked_steps == 0) return "not looked for";
    if (t.intersecting_steps > 0) {
      return fmt::format("in {:.0f} of {:.0f} steps looked at", t.intersecting_steps,
                         t.checked_steps);
    }
    return t.checked_steps == t.steps
               ? "none"
               : fmt::format("none in {:.0f} of {:.0f} steps", t.checked_steps, t.steps);
  }
  IterationObserver watch_iterations() const {
    if (check_ != CheckRun::every_iteration) return {};
    return [&](IterationView const& view) {
      auto const found = surface_->find(view.positions());
      if (found.empty()) return;
      throw IntersectingIteration("step {} at {:.6g} s: iteration {} leaves {}; the first: {}. {}",
                                  simulation_->steps() + 1, simulation_->time(), view.index + 1,
                                  surface_->count(found), surface_->text(found.front()),
                                  what_now());
    };
  }

  void append_frame(ResultWriter& result) override {
    auto const x = simulation_->positions();
    result.append(simulation_->time(), x, simulation_->velocities());
    if (!scene_.output.obj) return;
    if (boundary_.empty()) boundary_ = boundary_faces(geometry_.mesh.tets);
    // Bodies alone: the points of obstacles are behind theirs.
    write_obj(folder() / "obj" / fmt::format("frame_{:05}.obj", simulation_->steps()),
              {{x.begin(), x.begin() + std::ssize(geometry_.mesh.points)}, boundary_});
  }

  void add_to_summary(Record& summary) const override {
    if (scene_.contact) set_contact(summary);
    PreconditionerChoice const preconditioner = choose_preconditioner(scene_, geometry_);
    summary.set("vertices", geometry_.mesh.points.size())
        .set("tets", geometry_.mesh.tets.size())
        .set("preconditioner", preconditioner.name)
        .set("preconditioner_because", preconditioner.reason)
        .set("most_inverted_elements", static_cast<std::int64_t>(totals().most_inverted))
        .set("steps_with_inverted_elements", static_cast<std::int64_t>(totals().inverted_steps))
        .set("intersections", intersections())
        .set("warnings", geometry_.warnings);
  }
  void set_contact(Record& summary) const {
    summary.set("mean_contacts", totals().steps > 0 ? totals().contacts / totals().steps : 0)
        .set("most_contacts", static_cast<std::int64_t>(totals().most_contacts))
        .set("smallest_gap", totals().smallest_gap)
        .set("steps_cut", static_cast<std::int64_t>(totals().cut_steps));
  }

  void say_more() const override {
    if (scene_.contact) {
      fmt::print(
          "contact  {:.1f} pairs on average, {:.0f} at most; smallest gap {:.2g} of dhat{}\n",
          totals().steps > 0 ? totals().contacts / totals().steps : 0, totals().most_contacts,
          totals().smallest_gap,
          totals().checked_steps > 0 ? "; intersections: " + intersections() : "");
    }
    if (totals().inverted_steps > 0) {
      fmt::print(
          "inverted elements in {:.0f} of {:.0f} steps, at most {:.0f} of {} at a time: this "
          "material tolerates them; neo_hookean does not let them be\n",
          totals().inverted_steps, totals().steps, totals().most_inverted,
          geometry_.mesh.tets.size());
    }
  }

  Scene const& scene_;
  SceneGeometry const& geometry_;
  ObjectIntersections const* surface_;  ///< null: not asked for
  CheckRun check_;
  std::unique_ptr<Simulation> simulation_;
  Checkpoint before_;  ///< the step in progress
  std::vector<Triangle> boundary_;
};

}  // namespace

int run_command(RunOptions const& options) {
  Scene const scene = load_scene(find_scene(options.scene.scene), options.scene.changes);
  if (scene.particles) return run_particles(scene, options);
  SceneGeometry geometry = build_within_memory(scene);
  ResultMesh const start = result_mesh(scene, geometry);
  ObjectIntersections const surface(start);
  check_start(scene, geometry, start.mesh.points, surface, options);
  for (std::string const& warning : geometry.warnings) fmt::print(stderr, "warning: {}\n", warning);
  return MeshRun(scene, geometry, options, options.check == CheckRun::off ? nullptr : &surface)
      .run();
}

}  // namespace taut
