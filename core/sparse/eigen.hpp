// The bridge to Eigen, for direct solves and for oracles. Included by source files only: Eigen is
// slow to compile.
#pragma once

#include <taut/core/sparse/block_csr.hpp>

#include <Eigen/SparseCore>

namespace taut {

/// The 3n x 3n scalar matrix, with the zeros that the blocks store.
Eigen::SparseMatrix<double> to_eigen(BlockCsr<SerialSpace, double> const& matrix);

}  // namespace taut
