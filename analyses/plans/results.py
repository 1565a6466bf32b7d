"""A planned motion with all that is told of it: numbers, a table of the motion, its stretches."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.plans.tracking import RATE, TrackedPlan
from cdpr_drake.analyses.reporting import finite, package_versions, write_columns, write_json
from cdpr_drake.arrays import Array
from cdpr_drake.models import Robot
from cdpr_drake.planning import MotionLimits, MotionSamples, PathPlan

SUMMARY, MOTION = "summary.json", "motion.csv"

REACHED = 0.99
"""A limit counts as reached from this share of it on."""


@dataclass(frozen=True, eq=False)
class PlanRun:
    """A plan of a robot.

    Attributes:
        robot: The robot.
        plan: The plan.
        limits: Limits of the robot, without reserve.
        source: What the path is, in words.
        arguments: What was asked, for JSON.
        planning_time: Time that planning took, with what it loads at its first use [s].
        tracked: What the simulated robot did; None where it was not simulated.
    """

    robot: Robot
    plan: PathPlan
    limits: MotionLimits
    source: str
    arguments: dict[str, Any]
    planning_time: float
    tracked: TrackedPlan | None = None

    @cached_property
    def samples(self) -> MotionSamples:
        """The plan, as often as it is controlled."""
        return self.plan.samples(RATE)

    def reached_share(self) -> float:
        """Share of the instants at which a limit is reached, see `REACHED`."""
        return float(np.mean(np.max(self.samples.uses, axis=1) >= REACHED))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        plan, lim = self.plan, self.plan.task.limits
        samples = self.samples
        told: dict[str, Any] = {
            "robot": self.robot.name,
            "arguments": self.arguments,
            "duration_s": plan.duration,
            "path_length_m": plan.path.length,
            "stations": len(plan.trajectory.stations),
            "rests": len(plan.path.rests),
            "planning_time_s": self.planning_time,
            "limits_of_the_plan": {
                "tension_n": [lim.lower, lim.upper],
                "cable_speed_m_s": lim.cable_speed,
                "cable_acceleration_m_s2": lim.cable_acceleration,
                "torque_nm": lim.torque,
                "speed_m_s": lim.speed,
            },
            "largest_share_of_limits": float(np.max(samples.uses)),
            "instants_at_a_limit": self.reached_share(),
            "reached": {
                name: int(np.sum(np.any(holds, axis=1)))
                for name, holds in samples.active().items()
                if np.any(holds)
            },
            "tracked": None if self.tracked is None else self.tracked.as_dict(),
            "versions": package_versions(),
        }
        cleaned: dict[str, Any] = finite(told)
        return cleaned

    def columns(self) -> dict[str, Array]:
        """The motion as a table: pose, velocity, acceleration, and what it asks of the cables."""
        samples, motion = self.samples, self.plan.trajectory
        rows = np.array([motion.motion(t) for t in samples.times])
        names = [
            "qw", "qx", "qy", "qz", "x_m", "y_m", "z_m",
            "wx_rad_s", "wy_rad_s", "wz_rad_s", "vx_m_s", "vy_m_s", "vz_m_s",
            "alphax_rad_s2", "alphay_rad_s2", "alphaz_rad_s2", "ax_m_s2", "ay_m_s2", "az_m_s2",
        ]  # fmt: skip
        table = {"time_s": samples.times, "s_m": samples.parameters, "ds_dt_m_s": samples.speeds}
        table |= {name: rows[:, k] for k, name in enumerate(names)}
        for quantity, unit, values in (
            ("tension", "n", samples.tensions),
            ("cable_speed", "m_s", samples.cable_speeds),
            ("cable_acceleration", "m_s2", samples.cable_accelerations),
            ("torque", "nm", samples.torques),
        ):
            for k, cable in enumerate(self.robot.cables):
                table[f"{quantity}_{cable.name}_{unit}"] = values[:, k]
        table["largest_share_of_limits"] = np.max(samples.uses, axis=1)
        return table

    def write(self, folder: Path) -> dict[str, Any]:
        """Writes summary and motion into an existing folder; returns the summary."""
        told = self.as_dict()
        write_columns(folder / MOTION, self.columns())
        write_json(folder / SUMMARY, told)
        return told
