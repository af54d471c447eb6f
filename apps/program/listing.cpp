// The commands that say what there is: scenes, methods, and the plan of a scene.
#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/particle_methods.hpp>
#include <taut/apps/program/scene_geometry.hpp>
#include <taut/contact/surface.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>

namespace taut {

std::vector<std::filesystem::path> scene_folders() {
  std::vector<std::filesystem::path> folders;
  if (char const* own = std::getenv("TAUT_SCENES_DIR")) folders.emplace_back(own);
  std::error_code none;
  auto const program = std::filesystem::read_symlink("/proc/self/exe", none);
  if (!none) folders.push_back(program.parent_path().parent_path() / "share/taut/scenes");
  folders.emplace_back(TAUT_SCENES_SOURCE_DIR);
  std::erase_if(folders, [](auto const& f) { return !std::filesystem::is_directory(f); });
  return folders;
}

namespace {
std::map<std::string, std::filesystem::path> built_in_scenes() {
  std::map<std::string, std::filesystem::path> scenes;
  for (auto const& folder : scene_folders()) {
    for (auto const& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".toml") {
        scenes.emplace(entry.path().stem().string(), entry.path());
      }
    }
  }
  return scenes;
}
}  // namespace

std::filesystem::path find_scene(std::string const& name) {
  if (std::filesystem::is_regular_file(name)) return name;
  auto const scenes = built_in_scenes();
  if (auto const found = scenes.find(name); found != scenes.end()) return found->second;
  if (scenes.empty()) throw Error("scene \"{}\": there is no such file", name);
  std::vector<std::string_view> names;
  for (auto const& [known, path] : scenes) names.push_back(known);
  throw Error(
      "scene \"{}\": no file has this path and no built-in scene this name{}; `taut "
      "scenes` lists them",
      name, suggestion(", the nearest is \"", name, names, "\""));
}

int scenes_command() {
  int status = 0;
  for (auto const& [name, path] : built_in_scenes()) {
    try {
      fmt::print("{:<18} {}\n", name, read_scene_title(path).description);
    } catch (Error const& error) {
      fmt::print(stderr, "taut: {}\n", error.what());
      status = 1;
    }
  }
  return status;
}

namespace {

std::string to_text(OptionValue const& value) {
  if (auto const* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (auto const* integer = std::get_if<int>(&value)) return std::to_string(*integer);
  if (auto const* number = std::get_if<double>(&value)) return fmt::format("{:g}", *number);
  return std::get<std::string>(value);
}

/// "at least 1 and at most 100", or the words to choose from.
std::string accepted(OptionKey const& key) {
  if (!key.choices.empty()) return fmt::format("{}", fmt::join(key.choices, ", "));
  if (std::holds_alternative<bool>(key.fallback)) return "true, false";
  return key.range.describe();
}

void print_key(std::string_view table, OptionKey const& key) {
  fmt::print("{}.{} = {}\n", table, key.name, to_text(key.fallback));
  fmt::print("  {}\n  {}\n", accepted(key), key.help);
}

/// What ends a step.
std::string stop_of(SolverOptions const& solver, double edge, double h, bool quasi_static) {
  std::string const& rule = solver.text("stopping");
  double const tolerance = solver.number("tolerance");
  if (rule == "energy_drop")
    return fmt::format("when an iteration gains less than {:.3g} of what the first one did",
                       tolerance);
  if (rule == "gradient_norm")
    return fmt::format("when the gradient's norm is below {:.3g} of the first one", tolerance);
  if (rule == "budget") return "after max_iterations, whatever the error is then";
  std::string text = fmt::format("when the error is estimated to be below {:.3g} m (rms{})",
                                 tolerance * edge, quasi_static ? "" : ", by mass");
  if (!quasi_static) text += fmt::format(", which is {:.3g} m/s", tolerance * edge / h);
  return text;
}

/// From what distance on contact acts, m, if the scene does not say: as its simulation finds it.
double usual_dhat(SceneGeometry const& geometry) {
  std::vector<int> object(geometry.mesh.points.size());
  for (std::size_t k = 0; k < geometry.objects.size(); ++k) {
    ObjectPart const& part = geometry.objects[k];
    std::fill_n(object.begin() + part.first_vertex, part.vertices, static_cast<int>(k));
  }
  return default_dhat(make_surface(boundary_faces(geometry.mesh.tets), object),
                      geometry.mesh.points);
}

void print_contact(Scene const& scene, SceneGeometry const& geometry) {
  if (!scene.contact) {
    fmt::print("  (no contact: no [contact], so bodies pass through each other)\n");
    return;
  }
  ContactOptions const& contact = *scene.contact;
  double const dhat = contact.number("dhat");
  fmt::print("  contact       keeps bodies apart: {} barrier below {}, {} curvature, {}\n",
             contact.text("barrier"),
             dhat > 0 ? fmt::format("{:.3g} m", dhat)
                      : fmt::format("{:.3g} m (0.3 of the mean edge of the finest surface)",
                                    usual_dhat(geometry)),
             contact.text("curvature"),
             contact.flag("mollifier") ? "parallel edges mollified" : "parallel edges as they are");
  fmt::print("                pairs by {}, stiffness {}\n", contact.text("search"),
             contact.text("stiffness"));
  fmt::print("                steps by {}: {}\n", contact.text("bound"),
             contact.text("bound") == "half_dhat" ? "NO guarantee, bodies may cross"
                                                  : "certified, nothing crosses");
}

/// The plan of a scene of material points.
int plan_particles(Scene const& scene) {
  ParticleScene const& points = *scene.particles;
  SceneParticles const particles = build_particles(scene);
  SolverOptions const& solver = scene.solver;
  fmt::print("{}: {}\n", scene.name, scene.description);
  fmt::print("  {} particles of {} object{}, a grid of {:.4g} m; {} boundar{}\n",
             particles.initial(), points.bodies.size(), points.bodies.size() == 1 ? "" : "s",
             points.spacing, points.boundaries.size(), points.boundaries.size() == 1 ? "y" : "ies");
  double cells = 0;
  for (Particle const& p : particles.list) {
    cells += p.volume / (points.spacing * points.spacing * points.spacing);
  }
  auto const count = static_cast<double>(particles.list.size());
  if (!points.sources.empty())
    fmt::print("  {} particles more come out of {} source{}\n", count - double(particles.initial()),
               points.sources.size(), points.sources.size() == 1 ? "" : "s");
  fmt::print("  memory: about {:.2g} GB\n",
             1e-9 * particle_memory_needed(count, count / cells, solver));
  fmt::print("terms of the potential\n");
  fmt::print(
      "  inertia       carries the motion on: {} between particles and grid, implicit Euler\n",
      points.transfer);
  fmt::print("{}", scene.gravity != Point{} ? "  body force    pulls: gravity\n"
                                            : "  (no body force: no gravity)\n");
  double stiffest = 0, softest = std::numeric_limits<double>::infinity(), fastest = 0;
  for (std::size_t m = 0; m < particles.materials.size(); ++m) {
    MaterialParameters const& one = particles.materials[m];
    stiffest = std::max(stiffest, one.young);
    softest = std::min(softest, one.young);
    fastest = std::max(fastest, std::sqrt(one.young / one.density));
    fmt::print(
        "  particles     resist deformation: {}, {:.3g} Pa{}\n", one.model, one.young,
        particles.flows[m].kind == FlowKind::none
            ? ""
            : fmt::format("; {} a step {} takes what they cannot bear",
                          yields_in_step(one.model, particles.flows[m].kind) ? "in" : "after",
                          plasticity_kinds()[static_cast<std::size_t>(particles.flows[m].kind)]));
  }
  fmt::print("{}",
             points.ghost_penalty > 0
                 ? "  ghost_penalty holds nodes that particles hardly see to the body\n"
                 : "  (no ghost_penalty: nodes that particles hardly see are as free as others)\n");
  bool const slips = std::any_of(points.boundaries.begin(), points.boundaries.end(),
                                 [](auto const& b) { return b.law != BoundaryLaw::stick; });
  fmt::print("{}",
             slips ? "  slip          holds nodes back that are in boundaries which do not stick\n"
                   : "  (no slip: no boundary slips or separates)\n");
  double const longest = points.longest_step.value_or(scene.step);
  fmt::print(
      "steps\n  frames of {:.4g} s, in steps of the grid of at most {:.4g} s or {:.3g} cells; "
      "halved where a particle would cross {:.3g}\n",
      scene.step, longest, points.cfl, points.crossing);
  fmt::print("minimiser\n");
  std::string const& method = solver.text("method");
  // Where a name is in both lists, the one of particles says more.
  auto titles = particle_method_titles();
  auto const named = [&](MethodTitle const& title) { return title.name == method; };
  if (std::none_of(titles.begin(), titles.end(), named)) titles = method_titles();
  for (MethodTitle const& title : titles) {
    if (named(title)) {
      fmt::print("  method        finds the direction: {}, {}\n", title.name, title.description);
    }
  }
  fmt::print("  metric        evens out stiffness and mass: {}\n", particle_preconditioner(solver));
  if (has_strong_cycle(solver)) {
    std::string const& strong = solver.text("strong_cycle");
    fmt::print("                {}\n",
               strong == "auto" ? "in steps that it has not ended after 400 iterations, a stronger "
                                  "one: exact at light nodes and on a coarser level"
               : strong == "always" ? "exact at light nodes and on a coarser level"
                                    : "the same however long a step takes");
  }
  fmt::print("  curvature     is projected exactly, particle by particle\n");
  fmt::print("  line search   says how far to go: {}\n", solver.text("line_search"));
  fmt::print("  stop          {}: {}; at most {} iterations\n", solver.text("stopping"),
             stop_of(solver, points.spacing, longest, false), solver.integer("max_iterations"));
  fmt::print("advice\n  the fastest wave crosses {:.2g} cells per step\n",
             fastest * longest / points.spacing);
  if (stiffest > 100 * softest) {
    fmt::print("  stiffness varies by {:.1e}: compare with method = \"newton\"\n",
               stiffest / softest);
  }
  for (std::string const& warning : particles.warnings) fmt::print("warning: {}\n", warning);
  return 0;
}

}  // namespace

int methods_command() {
  fmt::print("solver.method: what minimises the energy of a step\n");
  for (MethodTitle const& m : method_titles()) fmt::print("  {:<11} {}\n", m.name, m.description);
  fmt::print("solver.method, of material points: nonlinear CG and newton as above, and\n");
  for (MethodTitle const& m : particle_method_titles()) {
    fmt::print("  {:<13} {}\n", m.name, m.description);
  }
  for (OptionKey const& key : solver_keys()) {
    if (key.name != "method") print_key("solver", key);
  }
  for (OptionKey const& key : contact_keys()) print_key("contact", key);
  fmt::print("material.model: what resists deformation\n");
  for (MaterialModel const& model : material_models()) {
    fmt::print("  {:<24} {}\n  {:<24} {}\n", model.name, model.description, "",
               model.allows_inversion ? "tolerates inverted elements" : "keeps J > 0");
  }
  fmt::print(
      "of material points ([grid]): {}; plasticity.kind: {}\n"
      "  hencky_plastic lets von_mises and sand yield in the step, every other model after it\n",
      fmt::join(particle_models(), ", "), fmt::join(plasticity_kinds(), ", "));
  return 0;
}

int plan_command(SceneArguments const& arguments) {
  Scene const scene = load_scene(find_scene(arguments.scene), arguments.changes);
  if (scene.particles) return plan_particles(scene);
  SolverOptions const& solver = scene.solver;
  require_of_meshes(solver);
  SceneGeometry const geometry = build_geometry(scene);
  double const h = scene.step, edge = mean_edge_length(geometry.mesh);

  fmt::print("{}: {}\n", scene.name, scene.description);
  fmt::print("  {} vertices, {} tets, {} object{}; mean edge {:.4g} m\n",
             geometry.mesh.points.size(), geometry.mesh.tets.size(), geometry.objects.size(),
             geometry.objects.size() == 1 ? "" : "s", edge);
  fmt::print("terms of the potential\n");
  if (scene.scheme == TimeScheme::quasi_static) {
    fmt::print("  (no inertia: the solve is quasi-static, each step is an equilibrium)\n");
  } else {
    fmt::print("  inertia       carries the motion on: lumped mass, {} with h = {:.4g} s\n",
               scene.scheme == TimeScheme::bdf2 ? "BDF2 (second order)"
                                                : "implicit Euler (first order, dissipative)",
               h);
  }
  bool const forces = !geometry.forces.empty();
  bool const gravity = scene.gravity != Point{};
  if (gravity || forces) {
    fmt::print("  body force    pulls: {}{}{}\n", gravity ? "gravity" : "",
               gravity && forces ? " and " : "", forces ? "forces of the scene" : "");
  } else {
    fmt::print("  (no body force: no gravity, no [[force]])\n");
  }
  std::set<std::string> models;
  double stiffest = 0, softest = 1e300;
  for (MaterialParameters const& m : geometry.materials) {
    models.insert(m.model);
    stiffest = std::max(stiffest, m.young);
    softest = std::min(softest, m.young);
  }
  for (std::string const& model : models) {
    bool const inverts =
        ElasticModels::with(model, []<class Model>() { return Model::allows_inversion; });
    bool const rotation = ElasticModels::with(model, []<class Model>() { return Model::use.d1; });
    fmt::print("  elastic tets  resist deformation: {}: {}{}\n", model,
               rotation ? "needs the polar decomposition of F"
                        : "invariants alone, no polar decomposition",
               inverts ? "" : "; steps are bounded so that J > 0");
  }
  if (!geometry.pins.empty()) {
    std::size_t pinned = 0;
    for (Pin const& pin : geometry.pins) pinned += pin.vertices.size();
    fmt::print("  pins          prescribe {} vertices, which leave the unknowns while held\n",
               pinned);
  }
  print_contact(scene, geometry);

  fmt::print("minimiser\n");
  bool const quasi_static = scene.scheme == TimeScheme::quasi_static;
  std::string const& method = solver.text("method");
  for (MethodTitle const& title : method_titles())
    if (title.name == method)
      fmt::print("  method        finds the direction: {}, {}\n", method, title.description);
  if (method == "newton") {
    fmt::print("  linear solve  {}, to {:.3g} of the residual at most\n", solver.text("hessian"),
               solver.number("linear_tolerance"));
  }
  PreconditionerChoice const metric = choose_preconditioner(scene, geometry);
  fmt::print("  metric        evens out stiffness and mass: {} ({}){}\n", metric.name,
             metric.reason,
             metric.name == "identity" ? "" : ", refreshed " + solver.text("refresh"));
  fmt::print("  curvature     keeps the metric positive where elements buckle: {}\n",
             solver.text("curvature"));
  fmt::print("  line search   says how far to go: {}\n", solver.text("line_search"));
  fmt::print("  safeguard     {}\n", solver.flag("safeguard")
                                         ? "restarts where descent is lost"
                                         : "off: nothing keeps the energy from rising");
  fmt::print("  precision     of numbers: {}\n", solver.text("precision"));
  fmt::print("  stop          {}: {}; at most {} iterations\n", solver.text("stopping"),
             stop_of(solver, edge, h, quasi_static), solver.integer("max_iterations"));
  fmt::print("advice\n");
  if (!quasi_static) {
    double const courant = elements_per_step(scene, geometry);
    fmt::print("  the fastest wave crosses {:.2g} elements per step{}\n", courant,
               courant < 1 ? ": an explicit method would do" : "");
    if (courant > 30 && metric.name == "block_jacobi") {
      fmt::print(
          "  that is stiff: measure `taut chart {} --methods "
          "dk,dk:preconditioner=schwarz_32,newton`\n",
          arguments.scene);
    }
  } else if (method != "newton") {
    fmt::print(
        "  without inertia the whole body answers at once: measure `taut chart {} --methods "
        "dk,dk:preconditioner=schwarz_32,newton`\n",
        arguments.scene);
  }
  if (stiffest > 100 * softest) {
    fmt::print(
        "  stiffness varies by {:.1e}: the error estimate of a local preconditioner is "
        "optimistic, compare with newton\n",
        stiffest / softest);
  }
  fmt::print("  memory: about {:.2g} GB\n", 1e-9 * memory_needed(size_of(geometry), solver));
  for (std::string const& warning : geometry.warnings) fmt::print("warning: {}\n", warning);
  return 0;
}

}  // namespace taut
