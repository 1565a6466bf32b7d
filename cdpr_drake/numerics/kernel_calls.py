"""Calls of kernels by the address of their machine code, from other kernels.

What calls a kernel by its address is compiled, and cached on disk, once for all of them. As an
argument a kernel would make its caller another function in every process; its position in a chain
of comparisons would make all of them wait for all others.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit


@njit(cache=True, inline="always")
def as_number(k: int) -> int:
    """k, for a kernel that is to be compiled once for all whole numbers.

    numba compiles a kernel anew for each number that is written out where it is called.
    """
    return k + 0


@cache
def kernel_address(kernel: Any, signature: Any) -> int:
    """Where the machine code of a kernel, compiled by numba for a signature, begins."""
    kernel.compile(signature.args)  # as for a call from Python, which would be compiled once more
    compiled = kernel.get_compile_result(signature)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def call_at_address(signature: Any) -> Callable[..., Any]:
    """The code of a `numba.extending.intrinsic` whose first argument is such an address.

    Its other arguments are those of the signature; errors of the kernel go on to the caller.
    """

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        convention, given = context.call_conv, (signature.return_type, signature.args)
        kind = convention.get_function_type(*given).as_pointer()
        kernel = builder.inttoptr(arguments[0], kind)
        status, result = convention.call_function(builder, kernel, *given, arguments[1:])
        with builder.if_then(status.is_error, likely=False):
            convention.return_status_propagate(builder, status)
        return result

    return generate
