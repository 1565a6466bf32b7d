"""`cdpr study planning`: time-optimal along ten paths, without swing, and with foresight.

A plan that is optimal has a limit that is reached at every instant, and takes as long as a fine
convex program of another author says; a plan that is worth something is kept by the simulated
robot, with feedback, at every step of its control. Input shaping is measured by what is left of
the swing on the simulated robot, with cables of rubber and of steel, and on few cables. Predictive
control tracks a quintic motion beside computed torque, at three horizons.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.planning.robot_path_task import RESERVE
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.planning.motions import (
    PathMotion,
    SwingMotion,
    TrackMotion,
    curves_of,
    words_of,
)
from cdpr_drake.analyses.studies.planning.paths import PATHS, REACHED, PathResult
from cdpr_drake.analyses.studies.planning.predictions import FAST, HORIZONS, SLOW, TrackResult
from cdpr_drake.analyses.studies.planning.swings import CASES, SHOTS, SwingResult
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, DISTANCE
from cdpr_drake.planning.input_shaping import SHAPERS

INTERVALS, QUICK_INTERVALS = 600, 120
"""Of the convex program."""

STATIONS, QUICK_STATIONS = 2000, 500
"""Of the plans. Within the interval of two stations in which a motion switches, no limit need be
reached: the finer, the shorter these are."""

QUICK_PATHS = 2
"""Paths of the quick form."""

QUICK_SWINGS = 1
"""Motions that may swing, of the quick form."""

TRACKS = tuple((duration, steps) for duration in (FAST, SLOW) for steps in (0, *HORIZONS))
QUICK_TRACKS = 2
"""Motions tracked by computed torque (0 steps) and predictive control, and those of the quick
form."""

SWING_SHARE = 0.1
"""Of the swing, what input shaping may leave."""

AGREEMENT = 0.01
"""Largest difference of times."""

MOSTLY = 0.97
"""Share of the instants at which a limit must be reached; the others lie within the interval of
two stations in which the motion switches from one limit to another."""


@dataclass(frozen=True, eq=False)
class PlanningStudy(DrawnStudy, StoppableStudy):
    """Result of the study.

    Attributes:
        quick: Whether it was the quick form.
        stations: Of the plans.
        intervals: Of the convex program.
        paths: What was found along each path.
        curves: Of each path, for figures.
        swings: What was left of the swing of each motion from rest to rest.
        tracks: How computed torque and predictive control tracked a quintic motion.
        progress: Where it stood at the end, and what earlier sessions had left of it.
    """

    quick: bool
    stations: int
    intervals: int
    paths: tuple[PathResult, ...]
    curves: tuple[dict[str, Array], ...] = field(repr=False)
    swings: tuple[SwingResult, ...]
    tracks: tuple[TrackResult, ...]
    progress: WorkProgress

    def statements(self) -> list[Statement]:
        """What is said of time-optimal motions, and what was found."""
        if not self.paths:
            return []
        kept = [path.tracked["keeps_limits"] for path in self.paths]
        shares = [max(p.tracked["largest_share_of_limits"].values()) for p in self.paths]
        reached = [path.reached for path in self.paths]
        apart = [abs(path.difference) for path in self.paths]
        some = len(self.paths)
        found = [
            Statement(
                "the simulated robot keeps every limit at every step of control (1 kHz)",
                f"{some} of {some}",
                f"{sum(kept)} of {some}; largest share of a limit {max(shares):.4f}",
                verdict(all(kept), any(kept)),
            ),
            Statement(
                "a limit is reached at every instant but where it switches",
                f">= {MOSTLY:.0%} of all instants",
                f"{min(reached):.1%} to {max(reached):.1%}",
                verdict(min(reached) >= MOSTLY, max(reached) >= MOSTLY),
                f"reached: from {REACHED:.0%} of a limit on",
            ),
            Statement(
                "the time is that of a convex program (Verscheure et al., 2009)",
                f"within {AGREEMENT:.0%}",
                f"within {max(apart):.3%}",
                verdict(max(apart) <= AGREEMENT, min(apart) <= AGREEMENT),
                f"{self.intervals} intervals; {self.stations} stations",
            ),
        ]
        if self.swings:
            shares = [swing.left["ZVD"] / swing.left["none"] for swing in self.swings]
            found.append(
                Statement(
                    "input shaping (ZVD) takes the swing away, on the simulated robot",
                    f"at most {SWING_SHARE:.0%} left",
                    f"{min(shares):.2%} to {max(shares):.2%} left of {len(shares)}",
                    verdict(max(shares) <= SWING_SHARE, min(shares) <= SWING_SHARE),
                )
            )
            found.append(self._shots())
        if self.tracks:
            found.append(self._foresight())
        return found

    def _shots(self) -> Statement:
        """Multiple shooting beside input shaping: swing and time."""
        rows, better, there = [], [], 0
        for swing in self.swings:
            if "shooting" not in swing.left:
                rows.append(
                    f"{swing.name}: none, {swing.refused['shooting'].rpartition(', in')[2]}"
                )
                better.append(False)
                continue
            there += 1
            ends = {name: swing.end_times[name] for name in ("shooting", "ZVD")}
            less = swing.left["shooting"] < swing.left["ZVD"]
            better.append(less and ends["shooting"] < ends["ZVD"])
            off = {
                k: swing.off[k] for k in ("shooting", "robust shooting", "ZVD") if k in swing.off
            }
            rows.append(
                f"{swing.name}: {1e3 * swing.left['shooting']:.2g} mm after "
                f"{ends['shooting']:.3g} s, ZVD {1e3 * swing.left['ZVD']:.2g} mm after "
                f"{ends['ZVD']:.3g} s; stiffness 10 % off: "
                + ", ".join(f"{name} {1e3 * value:.2g} mm" for name, value in off.items())
            )
        return Statement(
            "multiple shooting through the compiled engine leaves less swing than ZVD, and sooner, "
            "on the stiffness that it was planned with",
            "in every case",
            "; ".join(rows),
            verdict(all(better), any(better)),
            "a cable that gets slack on the way is no motion that differences can follow",
        )

    def _foresight(self) -> Statement:
        """Where the cables cannot give a motion, predictive control stays nearer to it."""
        fast = {track.steps: track for track in self.tracks if track.duration == FAST}
        ahead = [track for steps, track in fast.items() if steps]
        nearer = [track.rms < fast[0].rms and track.failures == 0 for track in ahead]
        return Statement(
            "where the cables cannot give a quintic motion, predictive control stays nearer to it "
            "than computed torque, with tensions at every step",
            "at every horizon",
            f"rms {1e3 * fast[0].rms:.3g} mm, {fast[0].failures} steps without tensions; "
            + ", ".join(f"{track.steps} steps ahead {1e3 * track.rms:.3g} mm" for track in ahead),
            verdict(bool(ahead) and all(nearer), any(nearer)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        told: dict[str, Any] = {
            "study": "planning",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.progress.wall_time,
            "parameters": {
                "stations": self.stations,
                "intervals": self.intervals,
                "reserve": RESERVE,
                "seeds": [spec.seed for spec in PATHS[: len(self.paths)]],
                "tension_limits_n": [list(spec.tensions) for spec in PATHS[: len(self.paths)]],
                "cable_acceleration_m_s2": [
                    spec.cable_acceleration for spec in PATHS[: len(self.paths)]
                ],
            },
            "versions": package_versions(),
            "paths": [path.as_dict() for path in self.paths],
            "swings": [swing.as_dict() for swing in self.swings],
            "tracks": [track.as_dict() for track in self.tracks],
            "statements": [statement.as_dict() for statement in self.statements()],
        }
        cleaned: dict[str, Any] = finite(told)
        return cleaned

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        table = new_table(
            "Time-optimal motions along paths",
            ("path",),
            ("time [s]", "convex [s]", "difference", "at a limit", "tracked: share", "error [mm]"),
        )
        for path in self.paths:
            most = max(path.tracked["largest_share_of_limits"].values())
            table.add_row(
                path.name, f"{path.duration:.4f}", f"{path.convex:.4f}", f"{path.difference:+.3%}",
                f"{path.reached:.1%}", f"{most:.4f}",
                f"{1e3 * path.tracked['largest_position_error_m']:.3f}",
            )  # fmt: skip
        swings = new_table(
            "Rest to rest: largest distance of Po after the command, and when this ends",
            ("robot",),
            ("slowest [Hz]", "way [mm]", "none", *SHAPERS, *SHOTS, "slow [mm]"),
        )
        for swing in self.swings:
            cells = [
                f"{1e3 * swing.left[name]:.3g} ({1e3 * swing.off[name]:.3g}) mm, "
                f"{swing.end_times[name]:.3g} s"
                if name in swing.left
                else "-"
                for name in ("none", *SHAPERS, *SHOTS)
            ]
            slow = f"{1e3 * swing.slow:.3g}"
            way = f"{1e3 * swing.way:.1f}"
            swings.add_row(swing.name, f"{swing.slowest:.3g}", way, *cells, slow)
        swings.caption = "in brackets: the stiffness 10 % off; slow: not shaped, in the time of ZVD"
        tracks = new_table(
            "A quintic motion of acrobot_large: distance from it",
            ("controller",),
            ("steps ahead", "time [s]", "rms [mm]", "largest [mm]", "without tensions"),
        )
        for track in self.tracks:
            tracks.add_row(
                track.controller, str(track.steps), f"{track.duration:g}", f"{1e3 * track.rms:.3g}",
                f"{1e3 * track.largest:.3g}", str(track.failures),
            )  # fmt: skip
        return [table, swings, tracks, statement_table("Planning", self.statements())]

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """The paths' phase planes."""
        return {"phase_planes": partial(phase_figure, self)} if self.paths else {}


def study_planning(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> PlanningStudy:
    """Runs the study; each motion is an item of a sweep.

    Args:
        quick: Two paths, a coarser convex program, one motion from rest to rest, and one horizon.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    stations = QUICK_STATIONS if quick else STATIONS
    intervals = QUICK_INTERVALS if quick else INTERVALS
    motions: list[PathMotion | SwingMotion | TrackMotion] = [
        *(PathMotion(s, stations, intervals) for s in (PATHS[:QUICK_PATHS] if quick else PATHS)),
        *(SwingMotion(k) for k in range(QUICK_SWINGS if quick else len(CASES))),
        *(TrackMotion(*track) for track in (TRACKS[:QUICK_TRACKS] if quick else TRACKS)),
    ]
    arguments = {
        "cdpr_drake": code_version(),
        "study": "planning",
        "quick": quick,
        "stations": stations,
        "intervals": intervals,
        "motions": [motion.name for motion in motions],
    }
    result = run_study_sweep({m.name: (m, 1) for m in motions}, 1, "motions", arguments, session)
    there = [(motion, result.finished.get(motion.name)) for motion in motions]
    found = [(m, words_of(a), curves_of(a)) for m, a in there if a is not None]
    return PlanningStudy(
        quick,
        stations,
        intervals,
        tuple(PathResult(**told) for m, told, _ in found if isinstance(m, PathMotion)),
        tuple(curves for m, _, curves in found if isinstance(m, PathMotion)),
        tuple(SwingResult(**told) for m, told, _ in found if isinstance(m, SwingMotion)),
        tuple(TrackResult(**told) for m, told, _ in found if isinstance(m, TrackMotion)),
        result.progress,
    )


def phase_figure(study: PlanningStudy) -> Figure:
    """Speeds along all paths below the largest ones."""
    count = len(study.paths)
    columns = min(count, 5)
    rows = -(-count // columns)
    size = (3.2 * columns + 1.0, 3.0 * rows + 1.2)
    figure, axes = new_figure(rows, columns, size, "Speed along the paths of the study")
    places = np.atleast_1d(axes).ravel()
    for place, path, curve in zip(places, study.paths, study.curves, strict=False):
        most = float(np.max(curve["speed"]))
        place.plot(curve["s"], curve["largest"], label="largest by itself", **line_style(BOUND))
        place.plot(curve["s"], curve["speed"], label="plan", **line_style(DISTANCE))
        place.set_ylim(0.0, 2.0 * most)
        place.set_title(f"{path.name}\n{path.duration:.3g} s", fontsize=10)
        place.set(xlabel="s [m]", ylabel="ds/dt [m/s]")
    for place in places[count:]:
        place.set_axis_off()
    places[0].legend(loc="upper right", fontsize=8)
    return figure
