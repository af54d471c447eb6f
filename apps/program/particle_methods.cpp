#include <taut/apps/program/particle_methods_impl.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <array>

namespace taut {
namespace {

/// L-BFGS with the cycle of multigrid as metric.
class DefaultBuilder : ParticleOptions {
public:
  using ParticleOptions::ParticleOptions;

  bool is_asked_for() const {
    return method_ == "lbfgs" && multigrid() && options_.text("smoother") == "auto" &&
           options_.text("coarse_solver") == "auto";
  }
  Made make() const {
    using Minimiser = Lbfgs<ParticleMultigrid, AnyLineSearch, ParticleStopping, P, S>;
    typename Minimiser::Params params;
    params.lbfgs.window = options_.integer("history");
    params.lbfgs.newton_step = false;  // a cycle is close to the inverse, in size too
    params.lbfgs.newton_first_step = true;
    params.lbfgs.forget_when_renewed = options_.flag("forget");
    params.preconditioner = cycle();
    return hold<Minimiser>(params, window());
  }
};

/// The metric of a method that comes with one; empty: it takes the one that is asked for.
std::string metric_of(std::string const& method) {
  if (method == "lbfgs_h") return "inverse_by_pcg";
  if (method == "pn_sgspcg") return "symmetric_gauss_seidel";
  if (method.starts_with("pn_pcg") || method == "gast15" || method == "lbfgs_plain") {
    return "block_jacobi";
  }
  bool const has_cycle = method.starts_with("hot") || method == "lbfgs_gmg" ||
                         method == "pn_mgpcg" || method == "pn_gmgpcg" || method == "admm";
  return has_cycle ? "multigrid" : "";
}

}  // namespace

std::string particle_preconditioner(SolverOptions const& options) {
  std::string const own = metric_of(options.text("method"));
  if (!own.empty()) return own;
  std::string const& asked = options.text("preconditioner");
  return asked == "auto" ? "multigrid" : asked;
}

bool has_strong_cycle(SolverOptions const& options) {
  return metric_of(options.text("method")).empty() &&
         particle_preconditioner(options) == "multigrid";
}

void refuse_without_effect(Section const& solver, SolverOptions const& options) {
  std::string const& method = options.text("method");
  auto const refuse = [&](char const* key, std::string const& why) {
    if (solver.find(key) == nullptr) return;
    throw Error("{}: {} has no effect: {}", solver.at(key).place, solver.path(key), why);
  };
  for (char const* key : {"regions", "islands", "rigid_predictor", "sleep_speed", "sleep_steps"}) {
    refuse(key, "it is of meshes; leave it out");
  }
  if (options.text("curvature") != "project") {
    refuse("curvature", "that of material points is projected exactly; leave it out");
  }
  if (method.starts_with("pn_") || method == "gast15") {
    refuse("hessian",
           fmt::format("{} has its own; leave it out, or use method = \"newton\"", method));
  }
  std::string const own = metric_of(method);
  if (!own.empty() && options.text("preconditioner") != "auto") {
    refuse("preconditioner",
           fmt::format("that of {} is {}; leave it out, or use method = \"lbfgs\"", method, own));
  }
  if (method == "admm") {
    for (char const* key : {"line_search", "safeguard"}) {
      refuse(key, "admm takes its steps as they are; leave it out");
    }
  }
  if (options.text("strong_cycle") == "always" && !has_strong_cycle(options)) {
    refuse("strong_cycle",
           fmt::format("{} with {} has no strong cycle; leave it out, or use method "
                       "= \"lbfgs\" with multigrid",
                       method, particle_preconditioner(options)));
  }
}

std::span<MethodTitle const> particle_method_titles() {
  static constexpr std::array titles{
      MethodTitle{"lbfgs", "L-BFGS", "with the cycle of multigrid as metric: the default"},
      MethodTitle{"hot", "HOT", "as published: fine matrix, symmetric Gauss-Seidel, 3 levels"},
      MethodTitle{"hot_quadratic", "HOT-quadratic", "the same with quadratic embedding"},
      MethodTitle{"lbfgs_h", "LBFGS-H", "L-BFGS, the first Hessian inverted by PCG as metric"},
      MethodTitle{"lbfgs_gmg", "LBFGS-GMG", "HOT with levels made of the particles, not of P'AP"},
      MethodTitle{"lbfgs_plain", "L-BFGS (block Jacobi)", "L-BFGS with block Jacobi as metric"},
      MethodTitle{"pn_pcg", "PN-PCG", "projected Newton, PCG with block Jacobi on the matrix"},
      MethodTitle{"pn_pcg_mf", "PN-PCG(MF)", "the same without a matrix"},
      MethodTitle{"pn_sgspcg", "PN-SGS-PCG", "the same with symmetric Gauss-Seidel"},
      MethodTitle{"pn_mgpcg", "PN-MGPCG", "projected Newton, PCG with HOT's cycle"},
      MethodTitle{"pn_gmgpcg", "PN-GMG-PCG", "projected Newton, PCG with the cycle of lbfgs_gmg"},
      MethodTitle{"gast15", "Gast15", "projected Newton of Gast et al. 2015, without a matrix"},
      MethodTitle{"admm", "ADMM", "alternating directions, particles' own gradients (Fang 2019)"}};
  return titles;
}

ParticleMinimiser::ParticleMinimiser(Params const& options) {
  DefaultBuilder const builder(options);
  minimiser_ = builder.is_asked_for()
                   ? builder.make()
                   : other_particle_minimiser(
                         fmt::format("method = {} with preconditioner = {} and smoother = {}",
                                     options.text("method"), particle_preconditioner(options),
                                     options.text("smoother")),
                         options);
}

}  // namespace taut
