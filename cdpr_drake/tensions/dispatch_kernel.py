"""Any kernel of tension distribution behind one compiled call, by its address.

What calls a kernel by its address is compiled, and cached on disk, once for all of them. As an
argument a kernel would make it another function in every process; its position in a chain of
comparisons would make all of them wait for all others.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.closed_form_kernel import MISSED
from cdpr_drake.tensions.problem import (
    LEAST_FORCE_SHARE,
    RESIDUAL_TOLERANCE,
    VERDICT_ROUNDING,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    nearest_tensions_in,
)

_MATRIX, _VECTOR = types.float64[:, ::1], types.float64[::1]
_SIGNATURE = types.int64(_MATRIX, _MATRIX, *[_VECTOR] * 6)


@cache
def kernel_address(kernel: Any) -> int:
    """Where the machine code of a kernel with the arguments of `TensionMethod.kernel` begins."""
    compiled = kernel.get_compile_result(_SIGNATURE)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


@intrinsic
def _call(typing: Any, address: Any, work: Any, W: Any, w: Any, lower: Any, upper: Any,
          reference: Any, row_scale: Any, t: Any) -> Any:  # fmt: skip
    """What the kernel at an address returns."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        convention, given = context.call_conv, (_SIGNATURE.return_type, _SIGNATURE.args)
        kind = convention.get_function_type(*given).as_pointer()
        kernel = builder.inttoptr(arguments[0], kind)
        status, code = convention.call_function(builder, kernel, *given, arguments[1:])
        with builder.if_then(status.is_error, likely=False):
            convention.return_status_propagate(builder, status)
        return code

    return _SIGNATURE.return_type(types.intp, *_SIGNATURE.args), generate


@njit(cache=True, inline="always")
def finish(
    code: int, exact: bool, work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, t: Array,
) -> int:  # fmt: skip
    """What becomes of a kernel's code and tensions: the exact program has the last word.

    Where rounding loses the line or the polygon of a barely feasible problem, the least tensions
    take its place; they are exact, and prove infeasibility where there is none.

    From what the kernel returned and whether its method is exact to what `solve_one` returns; all
    other arguments as `TensionMethod.kernel`.
    """
    if exact and code == MISSED:
        code = nearest_tensions_in(work, W, w, lower, upper, reference, t)
    elif code == FEASIBLE:  # by rounding at most out of bounds
        for i in range(t.shape[0]):
            t[i] = min(max(t[i], lower[i]), upper[i])
    return code


@njit(cache=True)
def solve_one(
    kernel: int, exact: bool, work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """One problem by the kernel at an address, which must fit the redundancy of W; 0: by none.

    The first two arguments as `TensionMethod.compiled` gives them, all others as
    `TensionMethod.kernel` takes them.

    Returns:
        1 feasible, 0 missed by this method, -1 infeasible, -2 singular W. Tensions that are not
        feasible are what the method came to (0), those of least slack (-1, `slack_relaxed`), or
        without meaning.
    """
    code = MISSED
    if kernel != 0:
        code = _call(kernel, work, W, w, lower, upper, reference, row_scale, t)
    return finish(code, exact, work, W, w, lower, upper, reference, t)


@njit(cache=True)
def judged(
    code: int, relaxes: bool, W: Array, w: Array, lower: Array, upper: Array, t: Array
) -> int:
    """The verdict on a code's tensions, by looking at them as `problem.judge_tensions` does.

    Args:
        code: What `solve_one` returned.
        relaxes: Whether tensions count where the method found the problem infeasible.
        W: Wrench matrix, shape (n, m); with the following four as `TensionMethod.kernel`.
        w: Wrench, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        t: Tensions, shape (m,) [N]; by rounding out of bounds they are put on them.

    Returns:
        1 where they are within the bounds and balance the wrench; else the code, and 0 for 1.
    """
    if code == SINGULAR or (code == INFEASIBLE and not relaxes):
        return code
    n, m = W.shape
    otherwise = code if code == INFEASIBLE else MISSED
    highest = 1.0
    for i in range(m):
        highest = max(highest, upper[i])
    rounding = VERDICT_ROUNDING * highest
    for i in range(m):
        if not (lower[i] - rounding <= t[i] <= upper[i] + rounding):  # NaN is in no bounds
            return otherwise
    for i in range(m):
        t[i] = min(max(t[i], lower[i]), upper[i])
    off = weight = own = able = 0.0
    for j in range(n):
        left, share, most = w[j], 0.0, 0.0
        for i in range(m):
            left += W[j, i] * t[i]
            share += abs(W[j, i]) * t[i]
            most += abs(W[j, i]) * upper[i]
        off += left * left
        weight += w[j] * w[j]
        own += share * share
        able += most * most
    scale = max(np.sqrt(weight) + np.sqrt(own), LEAST_FORCE_SHARE * np.sqrt(able))
    balanced = np.sqrt(off) <= RESIDUAL_TOLERANCE * max(scale, 1e-300)
    return FEASIBLE if balanced else otherwise
