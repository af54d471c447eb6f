// How far policies of contact bring a scene: each runs it from the start, and ends at the first
// step that is not clean. Inverted elements end it where the material forbids them; what tolerates
// them goes on, and the row says since when.
#include <taut/apps/chart/policy.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/apps/program/intersections.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/scene_result.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/timer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace taut {
namespace {

/// Full turns that a motion has gone through at time t, those back counted as well.
double turns(RigidMotion const& motion, double t) {
  double angle = 0;
  for (MotionPhase const& phase : motion.phases) {
    double const tau = std::min(t, phase.window.end) - phase.window.start;
    if (tau <= 0) break;
    angle += std::abs(phase.angular_velocity * tau + phase.angular_acceleration * tau * tau / 2);
  }
  return angle / (2 * std::numbers::pi);
}
double most_turns(SceneGeometry const& geometry, double t) {
  double most = 0;
  for (Pin const& pin : geometry.pins) most = std::max(most, turns(pin.motion, t));
  return most;
}

/// How a policy fared up to its last clean step.
struct Endurance {
  int steps = 0;
  double time = 0;  ///< s, simulated
  double iterations = 0, seconds = 0;
  double inverted_time = std::numeric_limits<double>::quiet_NaN();  ///< s, the first step with any
  std::size_t most_contacts = 0;
  double smallest_gap = 1;
  std::string ended = "end of scene", why;

  void end(std::string how, std::string reason) {
    ended = std::move(how);
    why = std::move(reason);
    // A row is one line.
    std::replace(why.begin(), why.end(), '\n', ' ');
  }
};

class Trial {
public:
  Trial(Scene const& scene, SceneGeometry const& geometry, ObjectIntersections const& surface,
        double max_seconds)
      : scene_(scene),
        geometry_(geometry),
        surface_(surface),
        max_seconds_(max_seconds),
        simulation_(Simulation::create(scene, geometry)) {
    auto const models = material_models();
    for (MaterialParameters const& m : geometry.materials) {
      auto const model = std::find_if(models.begin(), models.end(), [&](MaterialModel const& one) {
        return one.name == m.model;
      });
      forbids_inversion_.push_back(!model->allows_inversion);
    }
  }

  Endurance run() {
    while (simulation_->steps() < scene_.frames && step()) {
    }
    return so_far_;
  }

private:
  /// Whether to go on.
  bool step() {
    NewtonReport report;
    std::vector<Intersection> found;
    Timer const timer;
    double seconds = 0;
    try {
      report = simulation_->step();
      seconds = timer.seconds();
      found = surface_.find(simulation_->positions());
    } catch (Error const& error) {
      so_far_.end("no step", error.what());
      return false;
    }
    if (!found.empty()) {
      so_far_.end("intersects", surface_.count(found));
      return false;
    }
    auto const inverted = inverted_tets(geometry_.mesh, simulation_->positions());
    for (std::int32_t const tet : inverted) {
      if (!forbids_inversion_[geometry_.material_of_tet[tet]]) continue;
      so_far_.end("inverts", fmt::format("{} elements", inverted.size()));
      return false;
    }
    if (!report.converged()) {
      so_far_.end("not converged",
                  fmt::format("{} after {} iterations", to_string(report.stop), report.iterations));
      return false;
    }
    so_far_.steps = simulation_->steps();
    so_far_.time = simulation_->time();
    if (!inverted.empty()) so_far_.inverted_time = std::fmin(so_far_.inverted_time, so_far_.time);
    so_far_.iterations += report.iterations;
    so_far_.seconds += seconds;
    if (auto const contact = simulation_->contact()) {
      so_far_.most_contacts = std::max(so_far_.most_contacts, std::size_t(contact->contacts));
      so_far_.smallest_gap = std::min(so_far_.smallest_gap, double(contact->smallest_gap));
    }
    if (so_far_.seconds <= max_seconds_) return true;
    if (so_far_.steps < scene_.frames) {
      so_far_.end("out of time", fmt::format("more than {:g} s", max_seconds_));
    }
    return false;
  }

  Scene const& scene_;
  SceneGeometry const& geometry_;
  ObjectIntersections const& surface_;
  double max_seconds_;
  std::vector<bool> forbids_inversion_;  ///< per material
  std::unique_ptr<Simulation> simulation_;
  Endurance so_far_;
};

}  // namespace

std::string stability_of_policies(std::filesystem::path const& file, ChartOptions const& options) {
  Scene const scene = load_scene(file, options.scene.changes);
  if (!scene.contact) {
    throw Error(
        "{}: --stability compares policies of contact, which the scene has not: add a "
        "table [contact]",
        file.string());
  }
  std::vector<ChartPolicy> const policies = parse_policies(options.policies, scene);
  std::vector<Scene> scenes;
  for (ChartPolicy const& policy : policies) {
    scenes.push_back(load_scene(file, with(options.scene.changes, policy.overrides)));
  }
  SceneGeometry const geometry = build_within_memory(scene);
  ResultMesh const start = result_mesh(scene, geometry);
  ObjectIntersections const surface(start);
  if (auto const found = surface.find(start.mesh.points); !found.empty()) {
    throw Error("{}: the scene starts with {}: move the objects apart (object.NAME.translate)",
                file.string(), surface.count(found));
  }

  double const end = scene.frames * scene.step;
  std::string table = fmt::format(
      "# kind = stability\n{}# seconds_per_policy = {:g}\n# end_of_scene_s = {:g}\n"
      "# end_of_scene_turns = {:.4g}\n"
      "policy,steps,seconds_simulated,turns,inverted_seconds,inverted_turns,iterations,"
      "most_contacts,smallest_gap,seconds,ended,why\n",
      describe(scene, geometry), options.max_seconds, end, most_turns(geometry, end));
  fmt::print("{:<36} {:>7} {:>7} {:>10} {:>9}  ended\n", scene.name, "steps", "turns", "iterations",
             "seconds");
  for (std::size_t k = 0; k < policies.size(); ++k) {
    Endurance const e = Trial(scenes[k], geometry, surface, options.max_seconds).run();
    double const mean = e.steps > 0 ? e.iterations / e.steps : 0;
    double const turned = most_turns(geometry, e.time);
    bool const inverted = std::isfinite(e.inverted_time);
    table += fmt::format("{},{},{:.6g},{:.4g},{},{},{:.4g},{},{:.3g},{:.4g},{},{}\n",
                         field(policies[k].label), e.steps, e.time, turned, field(e.inverted_time),
                         inverted ? field(most_turns(geometry, e.inverted_time)) : "", mean,
                         e.most_contacts, e.smallest_gap, e.seconds, e.ended, field(e.why));
    fmt::print("{:<36} {:>7} {:>7.3g} {:>10.1f} {:>9.3g}  {}{}{}\n", policies[k].label, e.steps,
               turned, mean, e.seconds, e.ended, e.why.empty() ? "" : ": ", e.why);
    std::fflush(stdout);
  }
  return table;
}

}  // namespace taut
