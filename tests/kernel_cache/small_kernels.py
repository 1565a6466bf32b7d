"""Kernels that compile in no time; tests give the module a name of the package's."""

from numba import njit


@njit(cache=True)
def half(number):
    """A kernel that another one calls."""
    return 0.5 * number


@njit(cache=True)
def quarter(number):
    """A kernel that calls another one."""
    return half(half(number))


@njit(cache=True)
def third(number):
    """A kernel on its own."""
    return number / 3.0
