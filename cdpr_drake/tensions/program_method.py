"""A program of Drake as the kernel of a tension method: called by address like any other.

So all that takes a method by name takes this one: single problems, batches, blocks, steps of
control that are compiled as a whole. Each set of bounds gets a program of its own, which is built
once; from step to step the wrench matrix and the wrench in it change, and the solver starts at the
tensions of the step before.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double, c_int64, c_size_t
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE

MOST_PROGRAMS = 16
"""Programs that a method keeps; beyond it the oldest is built again when it is asked for."""

PERIOD = 1e-3
"""Period of a loop whose rate is not said [s]."""

RAISED = -9
"""What the callback returns where Python raised."""


class StepProgram(Protocol):
    """What a method asks of a program; `tensions.TensionProgram` is one."""

    def update(self, W: Array, wrench: Array) -> None:
        """Puts another wrench matrix, shape (n, m), and wrench, shape (n,) [N m, N], into it."""

    def step(self, start: Array) -> Array | None:
        """Tensions, shape (m,) [N], found from a start; None: none that keep all constraints."""


Build = Callable[[TensionProblem], Any]
"""Makes a `StepProgram` with all own terms for a problem, in its first W and wrench."""


@dataclass
class StepTimes:
    """How long the steps of a program took.

    Attributes:
        period: What a step should not last longer than [s].
        steps: Steps.
        total: Time of all of them [s].
        worst: Longest of them [s].
        late: Steps that lasted longer than the period.
        missed: Steps without tensions.
    """

    period: float = PERIOD
    steps: int = 0
    total: float = 0.0
    worst: float = 0.0
    late: int = 0
    missed: int = 0

    @property
    def mean(self) -> float:
        """Time of a step [s]; NaN before the first."""
        return self.total / self.steps if self.steps else float("nan")

    def restart(self, period: float = PERIOD) -> None:
        """Begins to count again, for a loop of this period [s]."""
        self.period, self.steps, self.late, self.missed = period, 0, 0, 0
        self.total = self.worst = 0.0

    def note(self, seconds: float, met: bool) -> None:
        """Counts a step."""
        self.steps, self.total = self.steps + 1, self.total + seconds
        self.worst = max(self.worst, seconds)
        self.late += seconds > self.period
        self.missed += not met

    def as_dict(self) -> dict[str, float | int]:
        """For JSON."""
        return {
            "steps": self.steps,
            "mean_s": self.mean,
            "worst_s": self.worst,
            "period_s": self.period,
            "steps_above_period": self.late,
            "missed_steps": self.missed,
        }

    def words(self) -> str:
        """In a line."""
        return (
            f"{1e6 * self.mean:.0f} us a step, the worst {1e6 * self.worst:.0f} us; {self.late} of "
            f"{self.steps} steps above {1e3 * self.period:g} ms"
        )


class ProgramKernel:
    """A kernel with the arguments of `TensionMethod.kernel` that asks programs.

    Attributes:
        kernel: The kernel, compiled by numba.
        times: How long its steps took.
    """

    def __init__(self, name: str, build: Build) -> None:
        """With the name of its method, for messages."""
        self._name, self._build, self.times = name, build, StepTimes()
        self._programs: dict[bytes, StepProgram] = {}
        self._last: tuple[bytes, StepProgram] | None = None
        double = CFUNCTYPE(c_int64, c_int64, c_int64, *[c_size_t] * 7)
        self._callback = call = double(self._answer)
        failed = f"{name}: its program raised an error, which stands above; accepted: own terms "
        failed += "that take every pose of the run"
        raised = RAISED

        @njit
        def kernel(
            work: Array, W: Array, w: Array, lower: Array, upper: Array, reference: Array,
            row_scale: Array, t: Array,
        ) -> int:  # fmt: skip
            code = call(
                W.shape[0], W.shape[1], W.ctypes.data, w.ctypes.data, lower.ctypes.data,
                upper.ctypes.data, reference.ctypes.data, row_scale.ctypes.data, t.ctypes.data,
            )  # fmt: skip
            if code == raised:
                raise TensionProblemError(failed)
            return code

        self.kernel = kernel

    def prepare(self, problem: TensionProblem) -> StepProgram:
        """The program for problems with these bounds, so that its faults show before a loop.

        Raises:
            TensionProblemError: Its own terms do not fit the problem.
        """
        key = _key(problem.lower, problem.upper, problem.scale_of_rows)
        if key not in self._programs:
            while len(self._programs) >= MOST_PROGRAMS:
                del self._programs[next(iter(self._programs))]
            made = self._build(problem)
            if not (callable(getattr(made, "update", None)) and callable(
                getattr(made, "step", None)
            )):  # fmt: skip
                raise TensionProblemError(
                    f"{self._name}: build: found {type(made).__name__}; accepted: a function that "
                    "gives a TensionProgram"
                )
            self._programs[key] = made
        return self._programs[key]

    def _answer(self, n: int, m: int, *addresses: int) -> int:
        W, w, lower, upper, reference, row_scale, t = addresses
        began = perf_counter()
        try:
            bounds = [_read(at, size) for at, size in ((lower, m), (upper, m), (row_scale, n))]
            matrix, wrench = _read(W, n * m).reshape(n, m), _read(w, n)
            key = _key(*bounds)
            if self._last is None or self._last[0] != key:
                if key not in self._programs:
                    low, high, scale = (array.copy() for array in bounds)
                    self.prepare(
                        TensionProblem(matrix.copy(), wrench.copy(), low, high, row_scale=scale)
                    )
                self._last = key, self._programs[key]
            program = self._last[1]
            program.update(matrix, wrench)
            found = program.step(_read(reference, m).copy())
        except BaseException:  # nothing may leave a function that compiled code calls
            traceback.print_exc()
            return RAISED
        if found is not None:
            _read(t, m)[:] = found
        self.times.note(perf_counter() - began, found is not None)
        return NOT_FOUND if found is None else FEASIBLE


def _read(address: int, size: int) -> Array:
    """The numbers at an address, shape (size,)."""
    buffer: Any = (c_double * size).from_address(address)
    return np.frombuffer(buffer, float)


def _key(lower: Array, upper: Array, row_scale: Array) -> bytes:
    return b"".join((lower.tobytes(), upper.tobytes(), row_scale.tobytes()))
