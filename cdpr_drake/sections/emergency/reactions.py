"""Verb: the same break of a cable in runs that react differently."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import new_figure
from cdpr_drake.analyses.frame.folder import Folder, results_folder, write_result
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    Names,
    OutFolder,
    Overrides,
    ScenarioWord,
    Switch,
    whole,
)
from cdpr_drake.analyses.runs.breaks import (
    BRAKE,
    BRAKING,
    CONTINUE,
    DESCEND,
    FOUND,
    NONE,
    REDISTRIBUTE,
    RETREAT,
    STOP,
    after_break,
)
from cdpr_drake.analyses.runs.scenarios import scenario_with
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.simulate import Camera
from cdpr_drake.errors import ScenarioError, StoppedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

REACTIONS = {
    NONE: "null",
    STOP: f"{{reaction: stop, delay: {BRAKE:g}}}",
    REDISTRIBUTE: "{reaction: redistribute}",
    FOUND: "{reaction: redistribute, known: found}",
    CONTINUE: "{reaction: redistribute, motion: continue}",
    BRAKING: "{reaction: brake}",
    RETREAT: "{reaction: retreat}",
    DESCEND: "{reaction: descend}",
}
"""Section `emergency` of each reaction."""

RESULTS = "results.json"
"""File of the numbers in a results folder."""

ROWS = 500.0
"""Rows of a run per second, of which the largest numbers are taken [Hz]."""


@dataclass(frozen=True, eq=False, repr=False)
class BreakReactions(Result):
    """What one break of a cable led to, by reaction.

    Attributes:
        scenario: Name of the scenario.
        cable: Name of the cable that broke.
        time: Time of the break [s].
        rows: By reaction the outcome of its run, and the numbers of `after_break`.
        geometry: Geometry of the simulated cables, as `Robot.geometry_words`.
        folder: The results folder; None: nothing is kept.
        failed: Files that could not be written, and why.
    """

    scenario: str
    cable: str
    time: float
    rows: dict[str, dict[str, Any]]
    geometry: str = ""
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        return {
            "scenario": self.scenario, "cable": self.cable, "time_s": self.time,
            "geometry": self.geometry, "reactions": self.rows,
        }  # fmt: skip

    def columns(self) -> dict[str, Any]:
        """A row a reaction."""
        names = next(iter(self.rows.values()))
        columns = {name: [row[name] for row in self.rows.values()] for name in names}
        return {"reaction": list(self.rows), **columns}

    def tables(self) -> list[Table]:
        """A row a reaction."""
        headings = (
            "reaction", "excursion [mm]", "turn [deg]", "speed [m/s]", "tension [N]", "slack [s]",
            "at rest [s]", "ends",
        )  # fmt: skip
        rows = []
        for reaction, row in self.rows.items():
            end = row["outcome"]
            if row["leaves"]:
                end += f", leaves the frame at {row['impact_m_s']:.2f} m/s"
            rows.append((
                reaction, f"{1e3 * row['excursion_m']:.1f}", f"{np.degrees(row['turn_rad']):.1f}",
                f"{row['largest_speed_m_s']:.3f}", f"{row['tension_n']:.1f}",
                f"{row['slack_s']:.2f}", f"{row['rest_s']:.2f}", end,
            ))  # fmt: skip
        title = f"{self.scenario}: {self.cable} breaks at {self.time:g} s, {self.geometry}"
        return [Table(title, headings, rows)]

    def lines(self) -> list[str]:
        """The folder."""
        return [] if self.folder is None else [f"results: {self.folder}"]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Largest excursions and speeds."""
        return {"reactions": self._figure}

    def _figure(self) -> Figure:
        title = f"{self.cable} breaks at {self.time:g} s, {self.geometry}"
        figure, panels = new_figure(1, 2, (10.0, 4.0), title)
        for panel, name, factor, label in (
            (panels[0], "excursion_m", 1e3, "largest excursion [mm]"),
            (panels[1], "largest_speed_m_s", 1.0, "largest speed [m/s]"),
        ):
            values = [factor * row[name] for row in self.rows.values()]
            panel.barh(list(self.rows), values, color="0.6", edgecolor="black")
            panel.invert_yaxis()
            panel.set_xlabel(label)
        return figure

    def write(self, folder: Folder) -> None:
        """Writes `results.json`."""
        folder.write_json(RESULTS, self.as_dict())


@verb()
def compare_reactions(
    scenario: ScenarioWord = "acrobot_broken_redistributed", overrides: Overrides = (), *,
    cable: Annotated[int, whole(0, metavar="CABLE")] = 2, time: float = 1.0, after: float = 2.0,
    reactions: Names = tuple(REACTIONS), camera: Camera = None, seed: int | None = None,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> BreakReactions:  # fmt: skip
    """Breaks a cable of a visual servo by motor torques, once for each reaction.

    Args:
        scenario: Scenario by name or path; its own failures and emergency are left out.
        overrides: Key and value of the scenario, such as integration.engine=plant.
        cable: Number of the cable that breaks, from 0.
        time: Time of the break [s].
        after: Time simulated after the break [s].
        reactions: None, stop, redistribute, found, continue, brake, retreat, descend, or several.
        camera: Images of a renderer, or the target's corners by projection.
        seed: Seed of noise and random directions.
        folder: Results folder; default: a new one below runs/; in Python nothing is kept.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figure in the folder.
        follow: Who follows.

    Raises:
        ScenarioError: A reaction is unknown, there is no such cable, or the scenario cannot react.
        CdprError: It cannot be built.
        OutputFolderError: The folder holds other results or files, or cannot be written.
        StoppedError: Somebody stopped it; finished reactions are kept in the folder.
    """
    unknown = [name for name in reactions if name not in REACTIONS]
    if unknown or not reactions:
        words = ", ".join(map(repr, unknown)) or "none"
        raise ScenarioError(f"reactions: found {words}; accepted: {', '.join(REACTIONS)}")
    for key, value in (("time", time), ("after", after)):
        if not 0.0 < value < math.inf:
            raise ScenarioError(f"{key}: found {value:g}; accepted: a number > 0 [s]")
    base = scenario_with(scenario, overrides, camera=camera, seed=seed)
    if not isinstance(base, Scenario):
        raise ScenarioError(f"{base.name}: found kind {base.kind}; accepted: a visual servo")
    robot = load_robot(base.robot)
    if cable >= len(robot.cables):
        last = len(robot.cables) - 1
        raise ScenarioError(f"cable: found {cable}; accepted: 0 to {last} of {robot.name}")
    broken = f"failures.events=[{{kind: cable_breaks, time: {time!r}, cable: {cable}}}]"
    runs = {  # all before the first run: a scenario may not know a reaction
        reaction: ServoRun(scenario_with(
            scenario, [*overrides, broken, f"emergency={REACTIONS[reaction]}"],
            camera=camera, seed=seed, duration=time + after, log_rate=ROWS,
        ))
        for reaction in reactions
    }  # fmt: skip
    arguments = {name: run.arguments() for name, run in runs.items()}
    kept = f"runs/{base.name}-reactions"
    again = folder is not None
    with results_folder(kept, arguments, folder, overwrite, follow.results, again) as results:
        rows: dict[str, dict[str, Any]] = {}
        if results is not None and (results.path / RESULTS).is_file():
            rows = load_json((results.path / RESULTS).read_text(encoding="utf-8"))["reactions"]
        geometry = robot.geometry_words(base.cables.pulleys)
        result = BreakReactions(
            base.name, robot.cables[cable].name, time, rows, geometry,
            None if results is None else results.path,
        )  # fmt: skip
        count = Count(follow, len(runs), len(rows))
        for reaction, run in runs.items():
            if reaction in rows:
                continue
            run.simulate(follow=Follow(stop=follow.stop))
            if run.outcome == Outcome.INTERRUPTED:
                raise StoppedError(f"stopped after {len(rows)} of {len(runs)} reactions")
            if run.sim_time <= time:
                raise ScenarioError(
                    f"time: found {time:g}; accepted: before the run of {base.name} ends, "
                    f"{run.sim_time:g} s"
                )
            numbers = after_break(run.log, robot, cable, time, base.cables.pulleys)
            rows[reaction] = {"outcome": run.outcome.name.lower(), **numbers}
            if results is not None:
                result.write(results)
            count.add(1.0, reaction)
        if results is not None:
            write_result(result, results, formats, follow)
    return result
