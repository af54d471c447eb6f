// Matrices in the shared data, row by row.
#pragma once

#include <taut/materials/models.hpp>

#include <nlohmann/json.hpp>

namespace taut::test {

inline Mat3<double> matrix_of(nlohmann::json const& rows) {
  Mat3<double> m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = rows[i][j].get<double>();
  return m;
}

}  // namespace taut::test
