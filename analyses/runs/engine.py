"""What steps a run: a diagram in Drake's simulator, or a loop without one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from pydrake.systems.analysis import InitializeParams, ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.log import Log
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, DivergedError
from cdpr_drake.systems.monitoring.context_state import has_arrays_only, restore_state, state_arrays
from cdpr_drake.systems.monitoring.run_monitor import Outcome

if TYPE_CHECKING:
    from cdpr_drake.analyses.runs.run import Run

LONGEST_WARM_UP = 1.0
"""Simulated time at most in which kernels are loaded [s]; a camera of a frame an hour is not waited
for."""

BEYOND = 1e9
"""Metres, radians and their rates that no platform has, but one whose run has diverged."""


class Place(Protocol):
    """The place of a process outside in a loop, which a block offers as its attribute `outside`."""

    def resting(self) -> AbstractContextManager[None]:
        """Nobody is asked inside the block."""


class Engine(ABC):
    """What steps a run.

    Attributes:
        outside: Place of a process outside; None without one.
    """

    outside: Place | None = None

    @abstractmethod
    def start(self, resumed: bool, follow: Follow, run: Run) -> None:
        """Begins, or goes on where a checkpoint has put it."""

    @abstractmethod
    def now(self) -> float:
        """Its time [s]."""

    @abstractmethod
    def step(self, until: float) -> Outcome:
        """Steps to a time [s]; returns RUNNING if the run goes on."""

    @abstractmethod
    def errors(self) -> tuple[float, float]:
        """Distance [m] and angle [rad] from the goal."""

    def is_lost(self) -> bool:
        """True if no number of the state makes sense any more."""
        return False

    @abstractmethod
    def rows(self) -> int:
        """Number of rows of the log in memory."""

    @abstractmethod
    def take_rows(self) -> Log:
        """Returns these rows, and forgets them."""

    def state_arrays(self) -> dict[str, Array] | None:
        """The whole state by names; None if it is more than arrays."""
        return None

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        """Replaces the state; raises ValueError if the arrays are of another engine."""
        raise ValueError("its state is not arrays")


def resting(place: Place | None) -> AbstractContextManager[None]:
    """No process outside takes part inside the block."""
    return nullcontext() if place is None else place.resting()


def fixed_step_simulator(diagram: Any, context: Any, method: str, step: float) -> Simulator:
    """A simulator by one of Drake's integrators, such as runge_kutta3, at steps of a length [s]."""
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)
    return simulator


class DiagramEngine(Engine):
    """A diagram in Drake's simulator, at fixed steps.

    Attributes:
        context: The root context.
    """

    def __init__(
        self, built: Any, method: str, step: float, duration: float, warm_up: float,
        outcome: Callable[[Any, Any], Outcome], errors: Callable[[Any], tuple[float, float]],
    ) -> None:  # fmt: skip
        """Loads kernels and renderer by a short simulation, then makes the context.

        Args:
            built: Has `diagram`, `make_context`, `log`, and perhaps `outside` and `read_log`.
            method: Drake's integrator.
            step: Its step [s].
            duration: Longest simulated time [s].
            warm_up: Simulated time in which all kernels are loaded [s].
            outcome: Of context and the simulator's status, after each piece.
            errors: Of the context, see `Engine.errors`.
        """
        self._built, self._method, self._step, self._duration = built, method, step, duration
        self._outcome, self._errors = outcome, errors
        self.outside = getattr(built, "outside", None)
        self._read = getattr(built, "read_log", built.log.read)
        with suppress(CableGeometryError, DivergedError, RuntimeError), resting(self.outside):
            warm = self._simulator(built.make_context())
            warm.AdvanceTo(min(warm_up, duration, LONGEST_WARM_UP))
        self.context = built.make_context()

    def _simulator(self, context: Any) -> Simulator:
        return fixed_step_simulator(self._built.diagram, context, self._method, self._step)

    def start(self, resumed: bool, follow: Follow, run: Run) -> None:
        self._drake = self._simulator(self.context)
        if follow.prepare is not None:
            follow.prepare(run, self._drake, self._built.diagram)
        parameters = InitializeParams()
        parameters.suppress_initialization_events = resumed  # they were at the start
        self._drake.Initialize(parameters)

    def now(self) -> float:
        return float(self.context.get_time())

    def step(self, until: float) -> Outcome:
        return self._outcome(self.context, self._drake.AdvanceTo(min(until, self._duration)))

    def errors(self) -> tuple[float, float]:
        return self._errors(self.context)

    def is_lost(self) -> bool:
        state = self.context.get_continuous_state_vector().CopyToVector()
        return not np.all(np.abs(state) < BEYOND)

    def rows(self) -> int:
        return int(self._built.log.rows(self.context))

    def take_rows(self) -> Log:
        rows: Log = self._read(self.context)
        self._built.log.clear(self.context)
        return rows

    def state_arrays(self) -> dict[str, Array] | None:
        return state_arrays(self.context) if has_arrays_only(self.context) else None

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        restore_state(self.context, arrays)


class LoopEngine(Engine):
    """A loop without a diagram.

    Attributes:
        loop: It has `time` and `advance_to`, and perhaps `start` and a state of arrays.
    """

    def __init__(
        self, loop: Any, log: Any, read: Callable[[Any], Log], duration: float,
        outcome: Callable[[], Outcome], errors: Callable[[], tuple[float, float]],
        outside: Place | None = None,
    ) -> None:  # fmt: skip
        """Of a loop.

        Args:
            loop: The loop.
            log: Has `rows` and `clear`.
            read: Reads its rows.
            duration: Longest simulated time [s].
            outcome: After each piece.
            errors: See `Engine.errors`.
            outside: Place of a process outside.
        """
        self.loop, self._log, self._read, self._duration = loop, log, read, duration
        self._outcome, self._errors, self.outside = outcome, errors, outside

    def start(self, resumed: bool, follow: Follow, run: Run) -> None:
        if not resumed and hasattr(self.loop, "start"):
            self.loop.start()

    def now(self) -> float:
        return float(self.loop.time)

    def step(self, until: float) -> Outcome:
        self.loop.advance_to(min(until, self._duration))
        return self._outcome()

    def errors(self) -> tuple[float, float]:
        return self._errors()

    def rows(self) -> int:
        return int(self._log.rows(None))

    def take_rows(self) -> Log:
        rows = self._read(None)
        self._log.clear(None)
        return rows

    def state_arrays(self) -> dict[str, Array] | None:
        return self.loop.state_arrays() if hasattr(self.loop, "state_arrays") else None

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        self.loop.restore_state(arrays)
