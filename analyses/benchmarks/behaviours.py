"""Benchmarks of what cables and platforms do beside the elastic law: swings with and without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import CableBehaviour, behaving_cables
from cdpr_drake.cables.models import KELVIN_VOIGT
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.dynamics.free_run_kernel import free_run
from cdpr_drake.dynamics.robot_arrays import CREEPING, RUBBING, Drive, RobotArrays, pack_robot
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform

ROBOT, STEP, LARGEST = "irma4u", 0.02, 1e-3
"""A platform on four cables, between instants, and of the method [s]."""

DOES = {
    "cables that stiffen": CableBehaviour(stiffening=5e-3),
    "cables that creep": CableBehaviour(creep_stiffness=0.3, creep_time=0.3),
}


def behaviour_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` repeats less and swings shorter."""
    repeats, count = (3, 25) if quick else (7, 250)
    plain = _swing(CableBehaviour(), count)
    swings = {name: _swing(does, count) for name, does in DOES.items()}
    swings["a platform that rubs as it turns"] = _swing(CableBehaviour(), count, True)
    rows = []
    for name, work in swings.items():
        works = [lambda w=one: 1e3 * processor_seconds(w) for one in (work, plain)]
        own, other = interleaved(works, repeats)
        rows.append(
            TimingRow(
                f"{ROBOT}: swing of {count * STEP:g} s, {name}", own, "ms",
                "elastic, damped cables alone", other, own / other, ratio_means="times as long",
            )
        )  # fmt: skip
    return rows


def _swing(does: CableBehaviour, count: int, rubs: bool = False) -> Callable[[], None]:
    """A swing from a push, of so many instants; run once, so that it is compiled."""
    robot = load_robot(ROBOT)
    cables = robot.cable_set()
    X_WP = pose_from_angles(np.array([0.0, 0.0, 0.45]), np.zeros(3))
    lengths, m = cable_paths(X_WP, cables).lengths, cables.count
    cables = behaving_cables(replace(cables, stiffness=np.full(m, 9e4)), does)
    l0 = lengths * (1.0 - 5e-4)
    contacts = ContactHysteresis(tilt=5.0, turn=5.0, slip=0.08) if rubs else None
    packed = pack_robot(
        rigid_platform(robot), cables, KELVIN_VOIGT, Drive(), home=l0, contacts=contacts
    )
    first = np.zeros(13 + m)
    first[:7], first[7:10], first[13:] = pose_row(X_WP), [1.0, -1.0, 2.0], l0
    if packed.kinds[CREEPING] > 0:
        first = np.concatenate([first, lengths / l0 - 1.0])
    first = np.concatenate([first, np.zeros(packed.kinds[RUBBING])])

    def work() -> None:
        _run(packed, first.copy(), count)

    work()
    return work


def _run(robot: RobotArrays, state: Array, count: int) -> None:
    m = robot.cables.shape[0]
    states, tensions = np.empty((count, len(state))), np.empty((count, m))
    free_run(robot, state, np.zeros(m), STEP, LARGEST, states, tensions, np.zeros(4))
