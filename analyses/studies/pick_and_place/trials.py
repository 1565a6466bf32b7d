"""One run of picking and placing as numbers, as an item of a sweep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.handling import PickAndPlaceRun, run_pick_and_place, unseen
from cdpr_drake.arrays import Array
from cdpr_drake.spatial import pose_error, pose_from_row
from cdpr_drake.systems.diagrams import load_scenario
from cdpr_drake.systems.handling import Phase
from cdpr_drake.systems.monitoring import Outcome

SCENARIO = "acrobot_pick_and_place"

HIDDEN = 3.0
"""Time for which the tag is hidden [s]."""

CONDITIONS: dict[str, tuple[str, ...]] = {
    "in view": ("cover=null",),
    "hidden while carried": (f"cover={{phase: carry, delay: 0.5, duration: {HIDDEN}}}",),
    "hidden while lowered": (f"cover={{phase: lower, delay: 0.5, duration: {HIDDEN}}}",),
    "one camera": ("goal_camera=null",),
}
"""What is changed in the scenario, by what the camera sees of the goal's tag on the way."""

CLEAR, ON_THE_WAY, LOWERED, ONE_CAMERA = CONDITIONS

COLUMNS = (
    "outcome",
    "failed_in",
    "failure",
    "distance_m",
    "angle_rad",
    "offset_x_m",
    "offset_y_m",
    "offset_z_m",
    "time_s",
    "losses",
    "unseen_s",
    "hidden_s",
    "dead_reckoning_m",
)
"""Numbers of a run: how it ended, in which phase and why it failed, how far the box is from the
goal and where from there, how long it took, views that were lost, time without the tag that was
needed, time for which a tag was hidden, and the largest error of dead reckoning after the start."""


@dataclass(frozen=True)
class HandlingTrial:
    """Runs of one condition; the seed is the number of the run.

    Attributes:
        condition: One of `CONDITIONS`.
        camera: Kind of the cameras.
        overrides: What else is changed in the scenario.
    """

    condition: str
    camera: str
    overrides: tuple[str, ...] = ()

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Rows of `COLUMNS` for the seeds start to stop."""
        return {"runs": np.array([self.row(seed) for seed in range(start, stop)])}

    def row(self, seed: int) -> Array:
        """`COLUMNS` of one run."""
        settings = [*CONDITIONS[self.condition], f"camera.kind={self.camera}", f"seed={seed}"]
        return row_of(run_pick_and_place(load_scenario(SCENARIO, [*settings, *self.overrides])))


def row_of(run: PickAndPlaceRun) -> Array:
    """`COLUMNS` of a run."""
    log, goal = run.log, run.built.X_WG
    times, X_WB = np.asarray(log["time"]), pose_from_row(log["X_WB"][-1])
    distance, angle = pose_error(goal, X_WB)
    drift = np.linalg.norm(
        np.asarray(log["X_WP"])[:, 4:] - np.asarray(log["X_WP_estimated"])[:, 4:], axis=1
    )
    hidden = np.asarray(log["hidden"]) if "hidden" in log else np.zeros(1)
    state = run.state
    assert state is not None  # it was simulated here
    return np.array([
        run.outcome, state.failed_in, state.failure, distance, angle,
        *(goal.inverse() @ X_WB).translation(), run.sim_time, state.losses,
        np.mean(unseen(log)) * times[-1], np.mean(hidden) * times[-1], np.max(drift),
    ], float)  # fmt: skip


def column(runs: Array, name: str) -> Array:
    """One of `COLUMNS` of runs, shape (n,)."""
    return np.asarray(runs[:, COLUMNS.index(name)])


def placed(runs: Array) -> np.ndarray:
    """Which runs set the box down, shape (n,), bool."""
    return np.asarray(column(runs, "outcome") == Outcome.COMPLETED)


def failed_phase(row: Array) -> str:
    """The phase in which a run failed, in words."""
    return Phase(int(row[COLUMNS.index("failed_in")])).word
