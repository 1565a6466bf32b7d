"""How a run is run: who looks, who may stop it, where its log goes, which process outside joins."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

from cdpr_drake.analyses.simulation.checkpoints import run_arguments
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper, Restorable, Rows
from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.remote.remote_place import Remote

Connect = Callable[[Remote], None]
"""Brings a process to its place: sets the `commander` of a `Remote`."""


def check_connected(scenario: Any, connect: Connect | None) -> None:
    """Refuses a run whose loop nobody closes, or that has no place for who should.

    Raises:
        ScenarioError: See above.
    """
    remote = getattr(scenario, "remote", None)  # mechanisms have no such section
    if remote is not None and connect is None:
        raise ScenarioError(
            f"{scenario.name}: remote: found a section, so a process outside closes the loop; "
            "accepted: cdpr serve, or remote: null"
        )
    if remote is None and connect is not None:
        raise ScenarioError(
            f"{scenario.name}: remote: found null; accepted: a section with a place"
        )


def resting(remote: Remote | None) -> AbstractContextManager[None]:
    """Nobody is asked inside the block."""
    return nullcontext() if remote is None else remote.resting()


@dataclass(frozen=True)
class Progress:
    """Where a run stands.

    Attributes:
        sim_time: Simulated time [s].
        wall_time: Time since the run began, without pauses of one that was continued [s].
        position_error: True distance of the tag from its desired position in the camera [m].
        rotation_error: The same as an angle [rad].
    """

    sim_time: float
    wall_time: float
    position_error: float
    rotation_error: float


@dataclass(frozen=True)
class RunSession:
    """How a run is run; its numbers do not depend on it.

    Attributes:
        on_progress: Called every `REPORT_PERIOD` of simulated time.
        should_stop: Asked as often; True ends the run with outcome INTERRUPTED. A
            KeyboardInterrupt does the same.
        log_folder: A folder to be made, where the log grows while the run goes on, which then
            takes no more memory for being long, and where checkpoints are kept; None: the log is
            kept in memory.
        prepare: Gets the simulator before it starts, and the diagram.
        resume: Goes on from the checkpoint that an earlier program left in `log_folder`.
        connect: Brings a process outside to its place before the run starts, where the scenario
            has the section remote.
    """

    on_progress: Callable[[Progress], None] | None = None
    should_stop: Callable[[], bool] | None = None
    log_folder: Path | None = None
    prepare: Callable[[Simulator, Diagram], None] | None = None
    resume: bool = False
    connect: Connect | None = None

    def keeper(
        self,
        log: Rows,
        context: Any,
        read: Callable[[Any], dict[str, Array]],
        scenario: Any,
        *,
        remote: Remote | None = None,
        state: Restorable | None = None,
    ) -> LogKeeper:
        """What puts a run's log away; a run that is resumed stands where its checkpoint is then.

        Args:
            log: As for `LogKeeper`, and so are `context`, `read` and `state`.
            context: See log.
            read: See log.
            scenario: What is run.
            remote: Where a process outside stands: its state nobody keeps, so there are no
                checkpoints.
            state: See log.

        Raises:
            CheckpointError: There is no checkpoint of this run.
        """
        asked = None if self.log_folder is None or remote is not None else run_arguments(scenario)
        keeper = LogKeeper(log, context, read, self.log_folder, asked, state)
        if self.resume:
            keeper.restore()
        return keeper

    def having(self, how: dict[str, Any]) -> RunSession:
        """The same with some fields by their names.

        Raises:
            TypeError: There is no such field.
        """
        return replace(self, **how) if how else self

    def begin(self, simulator: Simulator, diagram: Diagram, remote: Remote | None = None) -> None:
        """Lets who looks or takes part come in, before the run starts."""
        if self.prepare is not None:
            self.prepare(simulator, diagram)
        self.join(remote)

    def join(self, remote: Remote | None) -> None:
        """Brings the process outside to its place, where there is one."""
        if self.connect is not None and remote is not None:
            self.connect(remote)


DEFAULT_SESSION = RunSession()
"""Nobody looks, and nothing is kept."""
