// Bytes and flops that a sweep over linear tets cannot do without, per tet: the measure that the
// bench compares its times with.
//
// Bytes, as for an ideal cache: per tet 4 vertex indices (16), B = Dm^-1 and W (10 numbers) and the
// number of the material (4); per vertex what a sweep reads and writes of x, p, g and the diagonal,
// once each. With 5.5 tets per vertex and fp32 this is 71 bytes for gradient and diagonal, 64 for
// p'Hp, and 20 for the vector operations of an iteration (110 per vertex): 155 in all.
// What our patches move beyond that (local copies, partial sums) counts as their loss.
//
// Flops: additions, multiplications, divisions, roots and logarithms count one each, comparisons
// none. What two quantities share is counted once; what could be computed once at rest but would
// have to be read from memory (b_0, |b_a|^2) is counted as computed.
#pragma once

#include <string_view>

namespace taut {

struct SweepCounts {
  double bytes;  ///< per tet
  double flops;  ///< per tet
};

struct ElasticCounts {
  SweepCounts gradient;        ///< g and the diagonal of H, at given x
  SweepCounts quadratic_form;  ///< p'Hp, at given x and p
  SweepCounts iteration;       ///< of PNCG with Jacobi and a check of sufficient decrease
};

/// Flops at a deformation gradient F.
struct MaterialCounts {
  int state;     ///< for stress and curvature
  int stress;    ///< P, of its terms
  int diagonal;  ///< b_a' (d2Psi/dF2) b_a beyond the isotropic term
  int form;      ///< dF : d2Psi/dF2 : dF beyond the isotropic term
  int change;    ///< Psi(F) - Psi(F - dF), from F, the state and dF
};

/// Throws Error for a model that has not been counted.
MaterialCounts count_material(std::string_view model);

/// `precision`: fp32, mixed or fp64. Throws Error for a model that has not been counted.
ElasticCounts count_elastic(std::string_view model, std::string_view precision,
                            double vertices_per_tet);

}  // namespace taut
