"""Runs the study, and what it leaves: numbers, tables, a figure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession
from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, new_table
from cdpr_drake.analyses.studies.framework.seeded_study import SeededStudy
from cdpr_drake.analyses.studies.fusion.configurations import (
    QUICK_SEEDS,
    SEEDS,
    Configuration,
    configurations,
)
from cdpr_drake.analyses.studies.fusion.figures import fusion_figure
from cdpr_drake.analyses.studies.fusion.slack_trials import SLACK_COLUMNS, slack_trials
from cdpr_drake.analyses.studies.fusion.statements import CHECKS, column
from cdpr_drake.analyses.studies.fusion.trials import COLUMNS, SCENARIO
from cdpr_drake.analyses.sweeps.workers import SweepTask

ASSUMPTIONS = (
    "Nothing of this is printed but that it could be done. Where the tag on the platform is, its "
    "size, the noise of 0.3 px and that the camera in the world is one image late are chosen.",
    "What is believed wrongly is drawn normally for each seed, by what the filter is told: the "
    "start by 5 mm and 0.5 deg on each axis, the camera on board by 3 mm and 0.3 deg, that in the "
    "world by 3 mm and 0.2 deg, the target's place by 10 mm and 1 deg. A camera that is wrong by 2 "
    "cm and 1 deg is so in a drawn direction on top of that; the filter is not told, unless a "
    "configuration says so: then that camera is worse with probability 0.5, by 12 mm and 0.6 deg "
    "on each axis; where both are doubted, each with 0.05, by 20 mm and 1 deg.",
    "Encoders and tension sensors are ideal and read by every configuration.",
    "Slack is that of case study IX, E3, E5 and E9, on cables 1 and 2, with a projected camera; "
    "believed wrongly are exit points by 2 mm, anchor points by 1 mm, the start by 2 mm and 0.2 "
    "deg. A cable in the image is 15 points with a noise of 0.5 px; nothing hides it.",
    "The IMU is the ADIS16448, the depth camera in the world a Kinect.",
)


@dataclass(frozen=True, eq=False)
class FusionStudy(SeededStudy):
    """What the study found, see `run_trial`."""

    name = "fusion"
    source = "servoing thesis, perspectives"
    judges = CHECKS
    stated = "What is stated"

    def shown(self) -> list[Configuration]:
        """The configurations that are finished."""
        return [c for c in configurations(self.quick) if c.name in self.found]

    def statements(self) -> list[Statement]:
        """What is stated, and whether it is so; the quick form's runs end under way and tell
        nothing."""
        told = {} if self.quick else self.found
        return evaluate_checks(self.judges, told, self.quick and not self.interrupted)

    def details(self) -> dict[str, Any]:
        """Parameters, versions, numbers of all runs, but no rows of logs."""
        return {
            **self.setup_dict(SCENARIO, ASSUMPTIONS),
            "configurations": [
                {
                    "name": c.name,
                    "label": c.words,
                    "changes": list(c.changes),
                    "nis": self.found[c.name]["nis"].tolist(),
                    **{key: column(self.found, c.name, key).tolist() for key in COLUMNS},
                }
                for c in self.shown()
            ],
            "slack": [
                {
                    "name": name,
                    **{
                        key: self.found[name]["numbers"][:, k].tolist()
                        for k, key in enumerate(SLACK_COLUMNS)
                    },
                }
                for name in slack_trials(self.quick)
                if name in self.found
            ],
        }

    def number_tables(self) -> list[Table]:
        """Errors by configuration, and of the ways to take up slack."""
        table = new_table(
            "Fusion of sensors, means over seeds and in brackets the worst",
            ("sources",),
            ("at the target [mm]", "estimate at the end [mm]", "mean [mm]", "mean [deg]",
             "largest [mm]", "NEES", "world left out"),
        )  # fmt: skip
        for c in self.shown():
            table.add_row(
                c.words, self._words(c, "servo_m", 1e3, 2), self._words(c, "final_m", 1e3, 1),
                self._words(c, "mean_m", 1e3, 1), self._words(c, "mean_rad", 180.0 / np.pi, 2),
                self._words(c, "largest_m", 1e3, 1), self._words(c, "nees", 1.0, 1),
                f"{np.mean(column(self.found, c.name, 'external_left_out')):.0%}",
            )  # fmt: skip
        return [table, *self._slack_tables()]

    def _slack_tables(self) -> list[Table]:
        """Of the ways to take up slack that are finished; none where none is."""
        names = [name for name in slack_trials(self.quick) if name in self.found]
        if not names:
            return []
        table = new_table(
            "Two cables slack at the start, means over seeds",
            ("way",),
            ("taut after [s]", "fastest [m/s]", "estimate [mm]", "seen slack wrong by [mm]",
             "its bias [mm]", "seen"),
        )  # fmt: skip
        for name in names:
            taut, fastest, estimate, error, bias, share = np.mean(
                self.found[name]["numbers"], axis=0
            )
            table.add_row(
                name, f"{taut:.2f}", f"{fastest:.2f}", f"{1e3 * estimate:.1f}",
                f"{1e3 * error:.1f}", f"{1e3 * bias:+.1f}", f"{share:.0%}",
            )  # fmt: skip
        return [table]

    def _words(self, c: Configuration, key: str, scale: float, digits: int) -> str:
        values = scale * column(self.found, c.name, key)
        return f"{np.mean(values):.{digits}f} ({np.max(values):.{digits}f})"

    def drawings(self) -> dict[str, Callable[[], Figure]]:
        """The figure `fusion`."""
        shown = self.shown()
        return {"fusion": partial(fusion_figure, self.found, shown)} if shown else {}


def study_fusion(quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION) -> FusionStudy:
    """Runs all configurations over their seeds; each run is an item of a sweep.

    Args:
        quick: Three configurations for a second and one start with slack, once each, to see that
            everything works.
        session: How it is run, and how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    tasks: dict[str, tuple[SweepTask, int]] = {
        **{c.name: (c.trial(quick), seeds) for c in configurations(quick)},
        **{name: (trial, seeds) for name, trial in slack_trials(quick).items()},
    }
    return FusionStudy.run(tasks, quick, seeds, session)
