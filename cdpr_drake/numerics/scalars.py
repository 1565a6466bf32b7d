"""Runs the source of numba kernels on other scalars, such as AutoDiffXd."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any


def any_scalar(kernel: Any, replace: dict[str, Callable[..., Any]] | None = None) -> Any:
    """The Python function of a kernel, bound to the Python functions of the kernels it calls.

    So one source serves the fast path and the differentiable one. The kernel may use what NumPy
    offers object arrays: arithmetic, comparison, sqrt, log, sin, cos, arctan2.

    Args:
        kernel: A function compiled by numba.njit.
        replace: Functions to call instead of kernels of that name, wherever they are called.
    """
    replace = replace or {}
    function = kernel.py_func
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name in replace:
            names[name] = replace[name]
        elif hasattr(names.get(name), "py_func"):
            names[name] = any_scalar(names[name], replace)
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__)
