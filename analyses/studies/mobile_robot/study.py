"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.seeded_study import SeededStudy
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    QUICK_SEEDS,
    SEEDS,
    Configuration,
    configurations,
)
from cdpr_drake.analyses.studies.mobile_robot.figures import mobile_robot_drawings
from cdpr_drake.analyses.studies.mobile_robot.judges import CHECKS
from cdpr_drake.analyses.studies.mobile_robot.laps import COLUMNS, SCENARIO, failed
from cdpr_drake.analyses.studies.mobile_robot.statements import column, laps_words
from cdpr_drake.analyses.sweeps.workers import SweepTask

ASSUMPTIONS = (
    "The track is not printed: a rectangle of 0.26 x 0.16 m with rounded corners, as fast as the "
    "printed gains follow with the tag in view; a smaller and a larger one are run beside it.",
    "The tag turns with the mobile robot, all round once a lap, which the platform cannot: the "
    "rotation about the optical axis is left free, and the platform keeps its yaw in the estimate.",
    "Friction of the winches is not printed: that of the robot's file; none and three times as "
    "much are run beside it.",
    "By what winches run off their commands is not printed: 1 mm/s each, fitted to the printed "
    "drift of 0.3 m in 12 laps, and up to 0.2 mm/s more or less, fitted to 0.15 m of cable in 20; "
    "half and twice as much of each is run beside it. Without it nothing grows: lengths that "
    "follow the integral of the commands come back to what they were after each lap.",
    "Stiffness and damping of the cables as mounted are those fitted for case study IX.",
    "Believed wrongly, as in case study IX: exit points by 2 mm, anchor points by 1 mm, the camera "
    "by 5 mm and 1 deg, the first pose by 2 mm and 0.2 deg, in directions drawn for each seed.",
    "The estimator of 5.3.1 is that of 2.3.7 that lasts 210 s, control integration.",
    "A cable counts as slack below 0.24 N, the accuracy of the sensors.",
)


@dataclass(frozen=True, eq=False)
class MobileRobotStudy(SeededStudy):
    """What the study found, see `run_laps`."""

    name = "mobile-robot"
    source = "servoing thesis 2.3.7, 5.3.1"
    judges = CHECKS
    stated = "What the thesis states"

    def shown(self) -> list[Configuration]:
        """The configurations that are finished."""
        return [c for c in configurations(self.quick) if c.name in self.found]

    def details(self) -> dict[str, Any]:
        """Parameters, versions, the worst of all laps."""
        return {
            **self.setup_dict(SCENARIO, ASSUMPTIONS),
            "columns": list(COLUMNS),
            "configurations": [
                {
                    "name": c.name,
                    "label": c.words,
                    "changes": list(c.task.changes),
                    "friction": c.task.friction,
                    "laps": c.task.laps,
                    "published": c.published,
                    "laps_until_end": self.found[c.name]["end"][:, 1].tolist(),
                    "failed": failed(self.found[c.name]["end"]).tolist(),
                    **{key: self._extreme(c.name, key) for key in COLUMNS},
                }
                for c in self.shown()
            ],
        }

    def _extreme(self, name: str, key: str) -> float:
        """The worst of a column over all laps and runs."""
        values = column(self.found, name, key)
        there = values[np.isfinite(values)]
        if len(there) == 0:
            return float("nan")
        return float(np.min(there) if key == "seen" else np.max(there))

    def number_tables(self) -> list[Table]:
        """The worst of all laps, by configuration."""
        table = new_table(
            "A tag on a mobile robot",
            ("configuration", "published", "laps until failure"),
            ("most slack", "estimate [mm]", "estimate [deg]", "tension [N]"),
        )
        for c in self.shown():
            table.add_row(
                c.words, c.published, laps_words(self.found[c.name]["end"]),
                f"{self._extreme(c.name, 'most_slack'):.0f}",
                f"{1e3 * self._extreme(c.name, 'estimate_m'):.0f}",
                f"{np.degrees(self._extreme(c.name, 'estimate_rad')):.1f}",
                f"{self._extreme(c.name, 'tension_n'):.1f}",
            )  # fmt: skip
        return [table]

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """See `mobile_robot_drawings`."""
        return mobile_robot_drawings(self.found, self.shown())


def study_mobile_robot(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> MobileRobotStudy:
    """Runs all configurations over their seeds; each run is an item of a sweep.

    Args:
        quick: Few configurations, once each, two laps, to see that everything works.
        session: How it is run, and how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    tasks: dict[str, tuple[SweepTask, int]] = {
        c.name: (c.task, seeds) for c in configurations(quick)
    }
    return MobileRobotStudy.run(tasks, quick, seeds, session)
