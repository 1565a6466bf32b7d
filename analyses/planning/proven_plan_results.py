"""A motion in proven sets with all that is told of it: what is proven, and what is not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.runs_in_sets import RunInSets
from cdpr_drake.planning.box_timing import BoxTiming
from cdpr_drake.planning.path_in_sets import ProvenMotion
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.workspaces.proven_sets import PoseSets

PLATFORM_KIND = "collision-free"
"""The kind that keeps the platform off obstacles."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ProvenRun(RunInSets):
    """A motion of a robot in proven sets.

    Attributes:
        found: The motion.
    """

    found: ProvenMotion

    @property
    def plan(self) -> PathPlan:
        """The motion as one of the robot."""
        return self.found.plan

    @property
    def sets(self) -> PoseSets:
        """The sets."""
        return self.found.path.sets

    @property
    def kinds(self) -> tuple[str, ...]:
        """What holds everywhere in the sets."""
        return tuple(self.sets.about["kinds"])

    @property
    def about(self) -> str:
        """What it is, in words for titles."""
        what = "motion" if self.motion_proven else "path" if self.path_proven else "cables only"
        return (
            f"{self.robot.name}, {self.geometry}, proven {what}, least {self.found.cost}: "
            f"{self.found.path.path.length:.4g} m, {self.found.plan.duration:.4g} s"
        )

    @property
    def path_proven(self) -> bool:
        """Whether all that a path needs is proven at every instant.

        With obstacles that needs the platform to be proven clear of them, too.
        """
        return PLATFORM_KIND in self.kinds or not self.sets.about["obstacles"]

    @property
    def motion_proven(self) -> bool:
        """Whether tensions within the limits are proven at every instant of the motion, too."""
        return self.path_proven and self.found.box is not None

    def proven(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""
        about, lim = self.sets.about, self.task.limits
        least, most = about["tension_limits_n"]
        tensions = f"tensions from {least:g} to {most:g} N"
        yes, no = [], []
        if self.found.box is not None:
            what = "its acceleration and any other in the box"
            if self.found.box.moments is not None:
                what = (
                    "its accelerations, angular and gyroscopic terms with them, and any others in "
                    "the boxes of accelerations and moments"
                )
            yes.append(f"{tensions} give the motion, {what}")
            if np.isfinite(lim.cable_speed):
                yes.append(f"cables are not faster than {lim.cable_speed:.4g} m/s")
        else:
            yes.append(f"{tensions} hold the platform at rest")
            why = "no accelerations were asked for"
            if self.found.turns:
                why = "angles vary, and no angular accelerations were asked for"
            no.append(f"tensions of the motion, looked at between stations by samples: {why}")
        words = {
            "interference-free": "cables touch neither each other, platform, frame nor obstacles",
            PLATFORM_KIND: "the platform touches neither frame nor obstacles",
        }
        yes += [words[kind] for kind in self.kinds if kind in words]
        if not self.path_proven:
            no.append("the platform stays off the obstacles")
        no += self.kept_at_samples()
        return yes, no

    def details(self) -> dict[str, Any]:
        """As the base class says."""
        path, plan, box = self.found.path, self.found.plan, self.found.box
        yes, no = self.proven()
        time = self.found.cost == "time"
        return {
            "duration_s": plan.duration,
            "path_length_m": path.path.length,
            "proven": {
                "path": self.path_proven, "motion": self.motion_proven, "of": yes, "not_of": no,
            },
            "least": self.found.cost,
            "method": path.method,
            "cost": plan.duration if time else path.length,
            "lower_bound": self.found.time_bound() if time else path.lower_bound,
            "straight_m": path.straight,
            "shortest_polyline_m": path.length,
            "curve_at_most_m": path.curve.polygon,
            "largest_accelerations_m_s2": None if box is None else box.accelerations.tolist(),
            **_moments_told(box),
            "largest_speed_m_s": None if box is None else box.speed,
            "stretches": [
                {"from_m": a, "to_m": b, "set": int(n)} for a, b, n in path.stretches()
            ],
            "sequences": [
                {"length_m": length, "sets": [int(n) for n in sets]}
                for length, sets in path.looked_at
            ],
            "sets": {"count": len(self.sets), "overlaps": len(self.sets.graph), **self.sets.about},
            "judged_samples": self.judged[0],
            "judged_infeasible": dict(self.judged[1]),
            "stations": len(plan.trajectory.stations),
            "sets_time_s": self.sets_time,
            "planning_time_s": self.planning_time,
        }  # fmt: skip


def _moments_told(box: BoxTiming | None) -> dict[str, list[float]]:
    """Bounds of moments of a motion that turns, for JSON."""
    return (
        {} if box is None or box.moments is None else {"largest_moments_n_m": box.moments.tolist()}
    )
