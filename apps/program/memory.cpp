#include <taut/apps/program/memory.hpp>
#include <taut/core/report/error.hpp>

#include <fstream>
#include <limits>
#include <string>

namespace taut {

double memory_needed(SceneGeometry const& geometry, SolverOptions const& solver) {
  double const tets = double(geometry.mesh.tets.size());
  double const vertices = double(geometry.mesh.points.size());
  double const real = solver.text("precision") == "fp64" ? 8 : 4;
  // Element data and slots, the fields of state and minimiser, and the mesh that is kept.
  double bytes = tets * (14 * real + 60) + vertices * (30 * real + 400);
  bool const assembles =
      solver.text("method") == "newton" && solver.text("hessian") != "matrix_free";
  bool const schwarz = solver.text("preconditioner").starts_with("schwarz");
  if (assembles || schwarz) bytes += vertices * 15 * (72 + 4);  // ~15 blocks per row
  if (schwarz) {
    double const width = solver.text("preconditioner") == "schwarz_16" ? 16 : 32;
    bytes += vertices * 9 * width * real;
  }
  if (assembles && solver.text("hessian") == "direct") bytes += vertices * 15 * 72 * 20;  // fill-in
  return bytes;
}

double memory_available() {
  std::ifstream meminfo("/proc/meminfo");
  std::string word;
  while (meminfo >> word) {
    double kilobytes;
    if (word == "MemAvailable:" && meminfo >> kilobytes) return 1024 * kilobytes;
  }
  return std::numeric_limits<double>::infinity();
}

void require_memory(SceneGeometry const& geometry, SolverOptions const& solver) {
  double const needed = memory_needed(geometry, solver), available = memory_available();
  if (needed > available) {
    throw Error(
        "the scene has {} tets and needs about {:.1f} GB of memory, of which {:.1f} GB are free: "
        "lower its resolution, or use solver.precision = \"mixed\"",
        geometry.mesh.tets.size(), 1e-9 * needed, 1e-9 * available);
  }
}

}  // namespace taut
