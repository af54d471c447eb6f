#include <taut/core/sparse/eigen.hpp>

namespace taut {

Eigen::SparseMatrix<double> to_eigen(BlockCsr<SerialSpace, double> const& matrix) {
  int const n = matrix.rows();
  Eigen::SparseMatrix<double, Eigen::RowMajor> rows(3 * n, 3 * n);
  rows.resizeNonZeros(9 * static_cast<Eigen::Index>(matrix.block.extent(0)));
  int entry = 0;
  for (int i = 0; i < n; ++i) {
    for (int r = 0; r < 3; ++r) {
      rows.outerIndexPtr()[3 * i + r] = entry;
      for (int k = matrix.row_begin(i); k < matrix.row_begin(i + 1); ++k) {
        for (int c = 0; c < 3; ++c, ++entry) {
          rows.innerIndexPtr()[entry] = 3 * matrix.column(k) + c;
          rows.valuePtr()[entry] = matrix.block(k)(r, c);
        }
      }
    }
  }
  rows.outerIndexPtr()[3 * n] = entry;
  return rows;
}

}  // namespace taut
