"""What reactions to a broken cable are worth: the same break in runs that react differently."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.simulation.break_report import REACTIONS, after_break
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError, StoppedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.summaries import Tabulated
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure


ROWS = 500.0
"""Rows of a run per second, of which the largest numbers are taken [Hz]."""


@dataclass(frozen=True, eq=False, repr=False)
class BreakReactions(Tabulated):
    """What one break of a cable led to, by reaction.

    Attributes:
        scenario: Name of the scenario.
        cable: Name of the cable that broke.
        time: When [s].
        rows: By reaction the outcome of its run, and what `after_break` says.
    """

    scenario: str
    cable: str
    time: float
    rows: dict[str, dict[str, Any]]

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        told = {"scenario": self.scenario, "cable": self.cable, "time_s": self.time}
        return {**told, "reactions": self.rows}

    def columns(self) -> dict[str, Any]:
        """A row a reaction."""
        names = list(next(iter(self.rows.values())))
        found = {name: [row[name] for row in self.rows.values()] for name in names}
        return {"reaction": list(self.rows), **found}

    def plot(self) -> Figure:
        """How far the platform went and how fast it was at most."""
        from cdpr_drake.analyses.visualization.figure_style import new_figure

        title = f"{self.cable} breaks at {self.time:g} s"
        drawn, axes = new_figure(1, 2, (10.0, 4.0), title)
        for axis, name, factor, label in (
            (axes[0], "excursion_m", 1e3, "largest excursion [mm]"),
            (axes[1], "largest_speed_m_s", 1.0, "largest speed [m/s]"),
        ):
            values = [factor * row[name] for row in self.rows.values()]
            axis.barh(list(self.rows), values, color="0.6", edgecolor="black")
            axis.invert_yaxis()
            axis.set_xlabel(label)
        return drawn

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        rows = []
        for reaction, row in self.rows.items():
            words = (
                f"{1e3 * row['excursion_m']:.1f} mm, {row['largest_speed_m_s']:.3f} m/s, largest "
                f"tension {row['tension_n']:.1f} N"
            )
            rows.append((reaction, words + (", leaves the frame" if row["leaves"] else "")))
        return f"{self.cable} breaks at {self.time:g} s in {self.scenario}", rows


def compare_reactions(
    scenario: str | Path = "acrobot_broken_redistributed",
    cable: int = 2,
    time: float = 1.0,
    *,
    reactions: Sequence[str] = tuple(REACTIONS),
    after: float = 2.0,
    overrides: Sequence[str] = (),
    session: Session | None = None,
) -> BreakReactions:
    """Breaks a cable of a visual servo by motor torques, once for each reaction.

    Args:
        scenario: Name or path of the scenario; its own failures and emergency are left out.
        cable: Number of the cable that breaks, from 0.
        time: When [s].
        reactions: Names of `REACTIONS`.
        after: For how long runs go on after the break [s].
        overrides: Further items "key.subkey=value" that replace what the file says.
        session: Who follows the runs and may stop them; None: nobody.

    Raises:
        ScenarioError: A reaction is unknown, there is no such cable, or the scenario cannot react.
        CdprError: It cannot be built.
        StoppedError: The session asked to stop.
    """
    told = session or Session()
    unknown = [name for name in reactions if name not in REACTIONS]
    if unknown or not reactions:
        found = ", ".join(map(repr, unknown)) or "none"
        raise ScenarioError(f"reactions: found {found}; accepted: {', '.join(REACTIONS)}")
    for key, value in (("time", time), ("after", after)):
        if not 0.0 < value < float("inf"):
            raise ScenarioError(f"{key}: found {value:g}; accepted: a number > 0 [s]")
    name = str(scenario)
    plain = load_scenario(name, overrides)
    if not isinstance(plain, Scenario):
        raise ScenarioError(f"{plain.name}: found kind {plain.kind}; accepted: a visual servo")
    rows: dict[str, dict[str, Any]] = {}
    for reaction in reactions:
        loaded = load_scenario(name, [
            *overrides,
            f"failures.events=[{{kind: cable_breaks, time: {time!r}, cable: {cable}}}]",
            f"emergency={REACTIONS[reaction]}",
            f"duration={time + after!r}", f"log_rate={ROWS:g}",
        ])  # fmt: skip
        assert isinstance(loaded, Scenario)
        robot = load_robot(loaded.robot)
        names = [one.name for one in robot.cables]
        told.say(f"{names[cable]} breaks: {reaction}")
        run = run_scenario(loaded, RunSession(should_stop=told.stop))
        if run.outcome == Outcome.INTERRUPTED:
            raise StoppedError(f"stopped after {len(rows)} of {len(reactions)} reactions")
        if float(run.log["time"][-1]) <= time:
            raise ScenarioError(
                f"time: found {time:g}; accepted: before the run of {loaded.name} ends, "
                f"{float(run.log['time'][-1]):g} s"
            )
        told_of = after_break(run.log, robot, cable, time)
        rows[reaction] = {"outcome": Outcome(run.outcome).name.lower(), **told_of}
    return BreakReactions(loaded.name, names[cable], time, rows)
