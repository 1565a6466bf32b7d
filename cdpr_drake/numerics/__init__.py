"""Small numerical tools that the other rooms share; they know nothing of robots.

Eigenpairs, least squares, small linear programs, copies and threads for kernels; kernels on other
scalars; stable steps of explicit integrators; what data cannot tell, in words; clocks that
differ. Functions whose module ends in `_kernel` are compiled
by numba, write into what the caller gives and allocate nothing, unless they say so.
"""

from cdpr_drake.numerics.arrays_by_address import (
    array_addresses,
    cube_at,
    integers_at,
    matrix_at,
    vector_at,
)
from cdpr_drake.numerics.copies_kernel import copy_matrix, copy_vector
from cdpr_drake.numerics.explicit_integration import (
    explicit_integrators,
    largest_stable_step,
    vibration_eigenvalues,
)
from cdpr_drake.numerics.kernel_calls import as_number, call_at_address, kernel_address
from cdpr_drake.numerics.least_squares_kernel import least_squares
from cdpr_drake.numerics.linear_program_kernel import append_column, lowest_point
from cdpr_drake.numerics.linear_system_kernel import eliminate, substitute
from cdpr_drake.numerics.null_directions import SHARE, named_direction, sparse_basis
from cdpr_drake.numerics.scalars import any_scalar
from cdpr_drake.numerics.smallest_eigenpair_kernel import (
    factor,
    smallest_eigenpair,
    smallest_eigenvalue,
)
from cdpr_drake.numerics.threads import over_rows
from cdpr_drake.numerics.time_shift import WORSE, tracker_shift

__all__ = [
    "SHARE", "WORSE", "any_scalar", "append_column", "array_addresses", "as_number",
    "call_at_address", "copy_matrix", "copy_vector", "cube_at", "eliminate", "explicit_integrators",
    "factor", "integers_at", "kernel_address", "largest_stable_step", "least_squares",
    "lowest_point", "matrix_at", "named_direction", "over_rows", "smallest_eigenpair",
    "smallest_eigenvalue", "sparse_basis", "substitute", "tracker_shift", "vector_at",
    "vibration_eigenvalues",
]  # fmt: skip
