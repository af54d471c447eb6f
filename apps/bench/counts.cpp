#include <taut/apps/bench/counts.hpp>
#include <taut/core/report/error.hpp>

namespace taut {
namespace {

// 3-vectors and 3x3 matrices: a scalar product 5, a cross product 9, A : B 17, A b 15, A B 45.
constexpr int dot3 = 5, cross3 = 9, contract9 = 17, times3 = 15, times9 = 45;
/// Edges and F = Ds B; the same for dF.
constexpr int deformation = 9 + times9;
/// C = [f1 x f2 | f2 x f0 | f0 x f1] and J = f0 . c0.
constexpr int cofactor = 3 * cross3 + dot3;
/// Polar decomposition by Horn's quartic as in core/math/polar.hpp: |F| and F / |F| 28; the quartic
/// 52; two Laguerre steps 44; Davenport's matrix 14; inverse iteration 126; R from the
/// quaternion 32. (In fp64 one more Laguerre step.)
constexpr int polar = 28 + 52 + 44 + 14 + 126 + 32;
/// The six entries of S = R'F, and (tr S I - S)^-1 by LDL'.
constexpr int twist_operator = 6 * dot3 + 34;
/// A product with a matrix for the four b_a: three, and minus their sum.
constexpr int times_b = 3 * times3 + 9;
/// A squared 12-vector, scaled and added.
constexpr int squares = 3 * 12;

/// Terms of J: their derivatives at most `scalars`, C : dF and F : cof(dF).
constexpr int j_form = contract9 + 3 + 3 * cross3 + contract9 + 3;
constexpr int j_diagonal = times_b + squares;
/// |F|^2 - |F - dF|^2 = 2 F : dF - dF : dF, and F - dF.
constexpr int i2_change = 2 * contract9 + 2 + 9;
/// J - J0 with one column of the change of C.
constexpr int j_change = 2 * cross3 + 3 + 2 * dot3 + 1;
/// Per vertex: a_k = r_k x b, G^-1 a_k and a_k . G^-1 a_k, scaled and added.
constexpr int rotation_diagonal = 12 * (cross3 + times3 + dot3 + 2);
/// axial(R'dF), its form with G^-1, scaled and added.
constexpr int rotation_form = 6 * dot3 + 3 + times3 + dot3 + 2;
/// I1 - I1_0 from the coefficients of the quartic: all of the change of C 63 + 2 dot3, C0 and
/// |C0|^2 26, dC : (C + C0) 26, the quartic at F - dF and five steps to its root 122, the
/// quotient 23.
constexpr int i1_change = 63 + 2 * dot3 + 1 + 26 + 26 + 122 + 23;

}  // namespace

MaterialCounts count_material(std::string_view model) {
  if (model == "arap") {
    return {polar + twist_operator, 18, rotation_diagonal, rotation_form,
            cofactor + i2_change + i1_change + 3};
  }
  if (model == "fixed_corotated") {
    return {polar + twist_operator + cofactor + 2, 18 + 18, rotation_diagonal + j_diagonal,
            rotation_form + j_form, i2_change + i1_change + 8};
  }
  if (model == "neo_hookean") {
    return {cofactor + 10, 18, j_diagonal, j_form, i2_change + j_change + 11};
  }
  if (model == "stable_neo_hookean") {
    return {cofactor + 3, 18, j_diagonal, j_form, i2_change + j_change + 8};
  }
  if (model == "stable_neo_hookean_2018") {
    // also |F|^2, F b_a and F : dF, for the second derivative by I2
    return {cofactor + contract9 + 8, 18, 2 * j_diagonal, j_form + contract9 + 3,
            i2_change + j_change + 12};
  }
  throw Error("bench: the flops of {} are not counted: add them to count_material", model);
}

ElasticCounts count_elastic(std::string_view model, std::string_view precision,
                            double vertices_per_tet) {
  MaterialCounts const m = count_material(model);
  // F; 2 d2 F; P b_a; |b_a|^2 with b_0, scaled; the weight; adding 24 numbers to vertices.
  int const gradient = deformation + m.state + 9 + m.stress + times_b + (9 + 4 * dot3 + 4) +
                       m.diagonal + 3 + 12 + 24;
  // F; dF; |dF|^2, scaled; weight and sum.
  int const form = 2 * deformation + m.state + contract9 + 1 + m.form + 2;
  int const change = deformation + 9 + m.change + 2;
  // Per vertex: the inverse of the diagonal, y, P g, P y, five scalar products, p = -P g + beta p,
  // g'p, p'Mp, x + alpha p, and gradient and change of the inertia.
  int const vectors = 3 + 3 + 3 + 3 + 30 + 6 + 6 + 6 + 6 + 6 + 10;

  double const real = precision == "fp64" ? 8 : 4, position = precision == "fp32" ? 4 : 8;
  double const element = 16 + 10 * real + 4, v = vertices_per_tet;
  double const gradient_bytes = element + v * (3 * position + 2 * 6 * real);
  double const form_bytes = element + v * (3 * position + 3 * real);
  return {{gradient_bytes, double(gradient)},
          {form_bytes, double(form)},
          {gradient_bytes + form_bytes + v * 27.5 * real, gradient + form + change + v * vectors}};
}

}  // namespace taut
