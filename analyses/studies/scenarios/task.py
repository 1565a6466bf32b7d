"""What the study runs: one scenario, as its file says or in short."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop, set_loop, uses_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_kind

QUICK_LOOP, QUICK_DIAGRAM = 100.0, 1.0
"""Simulated time of the quick form at most, of what the compiled loop does and of what only a
diagram can do [s]."""

COLUMNS = ("outcome", "time_s", "distance_m", "angle_rad", "duration_s", "rendered")
"""Numbers of a run: how and when it ended, true errors at the end, how long it might have run, and
whether it had rendered images."""

LONGEST_MESSAGE = 300


@dataclass(frozen=True)
class ScenarioRun:
    """A scenario that ships; one item.

    Attributes:
        name: Its name.
        quick: Whether targets are projected where they can be, and what is long is cut.
    """

    name: str
    quick: bool = False

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`COLUMNS`, shape (n, len(COLUMNS)), and words of runs that ended otherwise, shape (n,).

        A scenario that cannot be run counts as one that failed: it costs no other.
        """
        rows, words = [], []
        for _ in range(start, stop):
            row, said = self._run()
            rows.append(row)
            words.append(said[:LONGEST_MESSAGE])
        return {"runs": np.array(rows), "messages": np.array(words, f"U{LONGEST_MESSAGE}")}

    def scenario(self) -> Any:
        """The scenario as it is run.

        Raises:
            CdprError: It cannot be.
        """
        if not self.quick:
            return set_loop(load_scenario(self.name))[0]
        asked = load_scenario(self.name, quick_overrides(self.name))
        is_servo = SCENARIO_KINDS[asked.kind].is_servo
        scenario: Any = (
            choose_compiled_loop(asked) if is_servo else set_loop(asked, repeated=True)[0]
        )
        longest = QUICK_LOOP if uses_compiled_loop(scenario) else QUICK_DIAGRAM
        return replace(scenario, duration=min(scenario.duration, longest))

    def _run(self) -> tuple[list[float], str]:
        kind = SCENARIO_KINDS[scenario_kind(self.name)]
        try:
            scenario = self.scenario()
            kind.check(scenario)
            with TemporaryDirectory() as folder:  # the log of hours takes no memory there
                result = kind.run(scenario, RunSession(log_folder=Path(folder) / "log"))
                distance, angle = kind.end_error(result)
        except CdprError as problem:
            return [float(Outcome.FAILED), *[np.nan] * (len(COLUMNS) - 1)], str(problem)
        camera = scenario.camera.kind if hasattr(scenario, "camera") else None
        row = [
            float(result.outcome), result.sim_time, distance, angle, scenario.duration,
            float(camera == RENDERED),
        ]  # fmt: skip
        return row, result.message


def quick_overrides(name: str) -> list[str]:
    """What the quick form changes of a scenario beside its duration: a projected camera, where the
    target can be projected."""
    scenario = load_scenario(name)
    if getattr(getattr(scenario, "camera", None), "kind", None) != RENDERED:
        return []
    override = [f"camera.kind={PROJECTED}"]
    try:
        load_scenario(name, override)
    except CdprError:
        return []
    return override
