"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed
from rich.table import Table

from cdpr_drake.analyses.pictures import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting import (
    ALONE,
    Statement,
    StoppableStudy,
    StudySession,
    WorkProgress,
    code_version,
    finite,
    new_table,
    package_versions,
    statement_table,
    write_json,
)
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    QUICK_SEEDS,
    SEEDS,
    Configuration,
    configurations,
)
from cdpr_drake.analyses.studies.mobile_robot.figures import write_mobile_robot_figures
from cdpr_drake.analyses.studies.mobile_robot.judges import mobile_robot_statements
from cdpr_drake.analyses.studies.mobile_robot.laps import COLUMNS, SCENARIO, failed
from cdpr_drake.analyses.studies.mobile_robot.statements import (
    column,
    laps_words,
)
from cdpr_drake.analyses.sweeps import run_study_sweep
from cdpr_drake.arrays import Array
from cdpr_drake.systems.diagrams import load_scenario

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
class MobileRobotStudy(StoppableStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        seeds: Runs of each configuration.
        found: Arrays of the finished configurations, see `run_laps`, with the runs as first axis.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    seeds: int
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    def shown(self) -> list[Configuration]:
        """The configurations that are finished."""
        return [c for c in configurations(self.quick) if c.name in self.found]

    def statements(self) -> list[Statement]:
        """What the thesis states, and whether it is so."""
        return mobile_robot_statements(self.found, self.quick and not self.interrupted)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON but single laps: parameters, versions, runs, statements."""
        return {
            "study": "mobile-robot",
            "source": "servoing thesis 2.3.7, 5.3.1",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "seeds": list(range(self.seeds)),
            "versions": package_versions(),
            "assumptions": list(ASSUMPTIONS),
            "scenario": yaml_dump_typed(load_scenario(SCENARIO)),
            "columns": list(COLUMNS),
            "configurations": [
                finite(
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
                )
                for c in self.shown()
            ],
            "statements": [statement.as_dict() for statement in self.statements()],
        }

    def _extreme(self, name: str, key: str) -> float:
        """The worst of a column over all laps and runs."""
        values = column(self.found, name, key)
        there = values[np.isfinite(values)]
        if len(there) == 0:
            return float("nan")
        return float(np.min(there) if key == "seen" else np.max(there))

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
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
        tables = [table]
        statements = self.statements()
        if statements:
            tables.append(statement_table("What the thesis states", statements))
        return tables

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> None:
        """Writes `results.json` and the figures; all laps are in the study's `parts.npz`."""
        write_json(folder / "results.json", self.as_dict())
        write_mobile_robot_figures(folder, self.found, self.shown(), formats)


def study_mobile_robot(quick: bool = False, session: StudySession = ALONE) -> MobileRobotStudy:
    """Runs all configurations over their seeds; each run is an item of a sweep.

    Args:
        quick: Few configurations, once each, two laps, to see that everything works.
        session: How it is run, and how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    chosen = configurations(quick)
    tasks = {c.name: (c.task, seeds) for c in chosen}
    arguments = {
        "cdpr_drake": code_version(),
        "study": "mobile-robot",
        "quick": quick,
        "seeds": seeds,
        "tasks": {c.name: asdict(c.task) for c in chosen},
    }
    result = run_study_sweep(tasks, 1, "runs", arguments, session)
    return MobileRobotStudy(quick, seeds, result.finished, result.progress)
