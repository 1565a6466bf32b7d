"""Experiments E1 to E10 of cases IX and X: more and more slack at the start, and its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.servo import Configuration
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.problem import TensionProblem

Curves = Mapping[str, Array]

SLACKS_CM = (0, 2, 4, 6, 8)
"""Surplus of two cables at the start of E1 and E2, E3 and E4, ... [cm]."""

PLAIN = tuple(f"E{2 * k + 1}" for k in range(len(SLACKS_CM)))
CORRECTED = tuple(f"E{2 * k + 2}" for k in range(len(SLACKS_CM)))
"""Names of the experiments without and with correction, by slack."""

OFF = "tension_management=null"


def slack_change(centimetres: float, cables: Sequence[int], count: int = 8) -> str:
    """Pays out some cables, by their numbers from 1, at the start."""
    lengths = [centimetres / 100.0 if k + 1 in cables else 0 for k in range(count)]
    return f"perturbations.slack=[{', '.join(str(x) for x in lengths)}]"


def experiments(cables: Sequence[int], correction: str) -> tuple[Configuration, ...]:
    """E1 to E10, with the cables that are slack and the change that takes slack up."""
    return tuple(
        Configuration(
            name, f"{name}: {slack} cm{words}", (slack_change(slack, cables), change), "experiments"
        )
        for one, other, slack in zip(PLAIN, CORRECTED, SLACKS_CM, strict=True)
        for name, words, change in ((one, "", OFF), (other, ", corrected", correction))
    )


def time_to_taut(curves: Curves, threshold: float) -> float:
    """Time at which the last of the cables pulls that were slack at the start [s]: from `threshold`
    [N] on; infinity if one never does, 0 where none was slack."""
    slack = np.flatnonzero(curves["tensions"][0] < threshold)
    pulls = curves["tensions"][:, slack] >= threshold
    if not np.all(np.any(pulls, axis=0)):
        return float("inf")
    return float(np.max(curves["time"][np.argmax(pulls, axis=0)], initial=0.0))


def underactuated(curves: Curves) -> float:
    """Time with a Jacobian of too small a rank, slack cables left out [s]."""
    return float(np.sum(np.diff(curves["stability_time"]) * (curves["jacobian_rank"][:-1] < 6)))


def least_after(
    curves: Curves, name: str, time: float | None = None, threshold: float = 0.0
) -> float:
    """Least value of a curve of stability after a time [s], or once all cables that were slack have
    pulled; NaN for a run that ended before."""
    begin = time_to_taut(curves, threshold) if time is None else time
    late = curves[name][curves["stability_time"] >= begin]
    return float(np.min(late)) if len(late) else float("nan")


def winch_work(curves: Curves) -> float:
    """Work of all winches, pulled and held back alike: integral of |t dl0/dt| [J]."""
    wound = np.abs(np.diff(curves["unstrained_lengths"], axis=0))
    return float(np.sum(wound * 0.5 * (curves["tensions"][1:] + curves["tensions"][:-1])))


def cable_power(curves: Curves) -> float:
    """That work per time, the mean over the run [W]."""
    return winch_work(curves) / float(curves["time"][-1] - curves["time"][0])


def last_value(curves: Curves, name: str) -> float:
    """The last one of a curve."""
    return float(curves[name][-1])


def chatter(curves: Curves) -> float:
    """Root mean square of the tensions about their means in the last second [N]."""
    late = curves["tensions"][curves["time"] >= curves["time"][-1] - 1.0]
    return float(np.sqrt(np.mean((late - late.mean(axis=0)) ** 2)))


def correction_travel(curves: Curves) -> float:
    """Length that the correction wound up in all, over all cables [m]; 0 without."""
    if "tension_corrections" not in curves:
        return 0.0
    return float(-np.sum(np.diff(curves["time"])[:, None] * curves["tension_corrections"][:-1]))


def slack_numbers(curves: Curves, threshold: float) -> dict[str, float]:
    """What is reported of slack; a cable is taut from a tension of `threshold` [N] on.

    Slack of the start should be gone after 2 s.
    """
    return {
        "time_to_taut_s": time_to_taut(curves, threshold),
        "underactuated_s": underactuated(curves),
        "least_rank_late": least_after(curves, "jacobian_rank", 2.0),
        "least_margin_late": least_after(curves, "stability_margin", 2.0),
        "least_margin_taut": least_after(curves, "stability_margin", threshold=threshold),
        "estimate_end_m": last_value(curves, "estimate_distance"),
        "estimate_end_rad": last_value(curves, "estimate_angle"),
        "winch_work_j": winch_work(curves), "cable_power_w": cable_power(curves),
        "chatter_n": chatter(curves), "correction_m": correction_travel(curves),
    }  # fmt: skip


THRESHOLD = 1.0
"""Tension below which the thesis counts a cable as slack [N]."""

TENSIONS = {
    1: (9.4, 7.3, 4.8, 6.1, 2.8, 3.7, 5.7, 5.9), 2: (10.0, 7.8, 3.9, 5.4, 3.1, 4.0, 5.9, 6.1),
    3: (7.2, 4.5, 7.1, 9.6, 0.0, 0.0, 8.0, 9.4), 4: (9.2, 6.5, 4.6, 6.6, 2.9, 3.0, 6.2, 6.9),
    5: (7.2, 4.8, 7.6, 9.2, 0.0, 0.0, 7.8, 9.4), 6: (9.4, 6.8, 4.8, 6.6, 2.5, 2.2, 6.4, 7.2),
    7: (6.8, 4.5, 7.0, 9.5, 0.0, 0.0, 8.1, 9.4), 8: (9.5, 6.1, 5.3, 7.9, 2.8, 2.3, 7.5, 8.4),
    9: (7.4, 4.8, 7.6, 9.3, 0.0, 0.0, 8.8, 9.5), 10: (8.3, 5.9, 5.2, 7.0, 1.8, 2.1, 6.8, 7.6),
}  # fmt: skip
"""Tensions at the end of E1 to E10, table 5.1 [N]."""


def holding_problem(row: Array) -> TensionProblem:
    """Holding the platform at a pose above the threshold, without pulleys, as in the thesis."""
    robot = load_robot("acrobot_large")
    cables = robot.cable_set(pulleys=False)
    return tension_problem(robot, pose_from_row(row), limits=(THRESHOLD, 60.0), cables=cables)


def mean_tensions(rows: Frame, name: str) -> Array:
    """Tensions at the end, means over the runs of a configuration, shape (m,) [N].

    Raises:
        MissingRuns: It was not run.
    """
    tensions = [list(one.values()) for one in rows[rows["configuration"] == name]["end_tension_n"]]
    if not tensions:
        raise MissingRuns(name)
    return np.asarray(np.mean(tensions, axis=0))
