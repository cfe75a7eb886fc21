"""Linear solvers: conjugate gradients, multigrid and deflation on operators, sparse Cholesky.

The large system is a weighted cell Laplacian K with a term of low rank, K + J A^-1 J^T: rows J in
some of the cells and a symmetric positive semidefinite A^-1 between their columns. What the columns
stand for is not known here. Paper: the linear algebra of eq. (9). Compiled loops are in `kernels`.
"""
