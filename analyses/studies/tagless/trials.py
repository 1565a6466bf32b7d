"""What the study runs: one approach from one start on one target by one scheme."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.texture_pictures import TEXTURES

SCENARIO = "acrobot_pbvs"
"""Its target, a tag of 60 mm, is that of all others."""

TAG = "tag"
TARGETS = (TAG, *TEXTURES)
SCHEMES = ("pbvs", "ibvs", "2.5d")

DURATION = 12.0
"""How long a run takes [s], whether it has arrived or not: by a rule that ends runs within 0.3 mm
all would end there."""

REST = 1.0
"""Time at the end over which errors are averaged [s]."""

RATE = 25.0
"""Images and rows of the log per second [Hz]."""

ARRIVED = 5e-3
"""Final distance beyond which a run counts as lost, whatever it saw [m]."""

PLACE, ANGLE = 0.03, 4.0
"""By how much starts differ from the scenario's along and about each axis [m, deg]."""

RIM = 1.25
"""Edge of a tag's plate over that of its black square, all of which must be in view."""

SEED = 11

COLUMNS = ("distance_m", "angle_deg", "outcome", "without_target", "by_features", "start_m")
"""Numbers of a run: root mean square of distance and angle to where the platform should be at rest,
from ground truth; how it ended; images after the first in which the target was not found; those in
which it was found by features in all of the image; distance at the start."""


@dataclass(frozen=True)
class ApproachTask:
    """Approaches from the starts by their numbers, which are the items.

    Attributes:
        scheme: Name of the scheme.
        target: "tag" or a texture.
    """

    scheme: str
    target: str

    def overrides(self, start: int) -> list[str]:
        """What differs from the scenario."""
        place, angles = starts(start + 1)[start]
        target = [] if self.target == TAG else [
            "target.kind=textured", f"target.texture={self.target}"
        ]  # fmt: skip
        return [
            *target, f"controller.scheme={self.scheme}", f"duration={DURATION}",
            f"stop.hold={2.0 * DURATION}", f"log_rate={RATE}", f"camera.rate={RATE}",
            "camera.region=target", "integration.engine=compiled", f"seed={start}",
            f"initial_pose.position={place.tolist()}", f"initial_pose.angles_deg={angles.tolist()}",
        ]  # fmt: skip

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`COLUMNS` of the runs, shape (n, 6), and distances [m] and angles [rad] by row of the
        log, shapes (n, rows); NaN after a run's end."""
        return approaches(self, start, stop)


def approaches(task: ApproachTask, start: int, stop: int) -> dict[str, Array]:
    """As `ApproachTask` says."""
    rows = round(DURATION * RATE) + 1
    numbers = []
    distances, angles = np.full((2, stop - start, rows), np.nan)
    for k, item in enumerate(range(start, stop)):
        run = run_scenario(load_scenario(SCENARIO, task.overrides(item)))
        distance, angle = errors(run)
        count = min(rows, len(distance))
        distances[k, :count], angles[k, :count] = distance[:count], angle[:count]
        numbers.append(_numbers(run, distance, angle))
    return {"runs": np.array(numbers), "distance": distances, "angle": angles}


def errors(run: RunResult) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] of the true platform to where it should be, by row."""
    desired = run.servo.desired_platform_pose(float(run.log["time"][-1]))
    row = [*desired.rotation().ToQuaternion().wxyz(), *desired.translation()]
    count = len(run.log["time"])
    return pose_rows_distance(run.log["X_WP"], np.tile(np.array(row), (count, 1)))


def _numbers(run: RunResult, distance: Array, angle: Array) -> list[float]:
    log = run.log
    rest = log["time"] >= log["time"][-1] - REST
    seen = log["found"][:, 0] != 0.0
    begun = np.cumsum(seen) > 0
    features = 0.0
    if "quality" in log:
        features = float(np.sum(seen & (log["quality"][:, -1] == 0.0)))
    return [
        float(np.sqrt(np.mean(np.square(distance[rest])))),
        float(np.degrees(np.sqrt(np.mean(np.square(angle[rest]))))),
        float(run.outcome),
        float(np.sum(begun & ~seen)),
        features,
        float(distance[0]),
    ]


def is_lost(runs: Array) -> NDArray[np.bool_]:
    """Which runs lost the target for good or did not arrive, shape (n,), from `COLUMNS`."""
    ended = runs[:, COLUMNS.index("outcome")] != float(Outcome.TIMEOUT)
    return np.asarray(ended | ~(runs[:, 0] <= ARRIVED))


@cache
def starts(count: int) -> list[tuple[Array, Array]]:
    """The first starts, positions [m] and angles [deg], from which a camera sees all of the target.

    They are the same for all targets and schemes.
    """
    servo = build_visual_servo(load_scenario(SCENARIO, ["camera.kind=projected"]))
    nominal = servo.scenario.initial_pose
    plate = TagTarget(0, RIM * servo.scenario.target.size)
    random = np.random.default_rng(SEED)
    found: list[tuple[Array, Array]] = []
    while len(found) < count:
        place = np.round(nominal.position + random.uniform(-PLACE, PLACE, 3), 4)
        angles = np.round(nominal.angles_deg + random.uniform(-ANGLE, ANGLE, 3), 2)
        X_WP: RigidTransform = Pose(position=place, angles_deg=angles).transform()
        if plate.in_view(servo.X_CO(X_WP, 0.0), servo.pinhole):
            found.append((place, angles))
    return found
