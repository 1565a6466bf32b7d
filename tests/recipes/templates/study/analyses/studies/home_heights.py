"""How high the robots hang at home."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.models.robot_loader import load_robot


@dataclass(frozen=True)
class HomeHeights:
    """What the study found.

    Attributes:
        heights: By robot, of Po above the origin of W [m].
        interrupted: Whether it was stopped before the end.
    """

    heights: dict[str, float]
    interrupted: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {"study": "home-heights", "heights_m": self.heights}

    def tables(self) -> list[Table]:
        """One row a robot."""
        table = Table("robot", "height [m]", title="home heights")
        for name, height in self.heights.items():
            table.add_row(name, f"{height:.3f}")
        return [table]

    def write(self, folder: Path, formats: Sequence[str] = ()) -> None:
        """Writes the numbers."""
        folder.mkdir(exist_ok=True)
        (folder / "results.json").write_text(json.dumps(self.as_dict()), encoding="utf-8")


def study_home_heights(quick: bool, session: StudySession) -> HomeHeights:
    """Reads the robots' files; the quick form one."""
    names = ("acrobot_large",) if quick else ("acrobot_large", "caroca")
    heights = {name: float(load_robot(name).home.transform().translation()[2]) for name in names}
    stopped = session.should_stop is not None and session.should_stop()
    return HomeHeights(heights, stopped)
