"""What reactions to a broken cable are worth: the same break in runs that react differently."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.figures import figure_writers
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.reporting.deferred_figures import drawing, write_pictures
from cdpr_drake.analyses.reporting.left_folders import RESULTS
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.analyses.runs.breaks import REACTIONS, after_break
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError, StoppedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Tabulated
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.models.robot_schema import Robot


KEPT = ("folder", "overwrite", "formats")

ROWS = 500.0
"""Rows of a run per second, of which the largest numbers are taken [Hz]."""


@dataclass(frozen=True, eq=False, repr=False)
class BreakReactions(Tabulated):
    """What one break of a cable led to, by reaction.

    Attributes:
        scenario: Name of the scenario.
        cable: Name of the cable that broke.
        time: Time of the break [s].
        rows: By reaction the outcome of its run, and what `after_break` says.
        geometry: Geometry of the simulated cables, as `Robot.geometry_words`.
        failed: Of each picture that could not be written, the file and why.
    """

    scenario: str
    cable: str
    time: float
    rows: dict[str, dict[str, Any]]
    geometry: str = ""
    failed: Mapping[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        told = {
            "scenario": self.scenario, "cable": self.cable, "time_s": self.time,
            "geometry": self.geometry,
        }  # fmt: skip
        return {**told, "reactions": self.rows}

    def columns(self) -> dict[str, Any]:
        """A row a reaction."""
        names = list(next(iter(self.rows.values())))
        found = {name: [row[name] for row in self.rows.values()] for name in names}
        return {"reaction": list(self.rows), **found}

    def plot(self) -> Figure:
        """How far the platform went and how fast it was at most."""
        from cdpr_drake.analyses.frame.figures import new_figure

        title = f"{self.cable} breaks at {self.time:g} s, {self.geometry}"
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
        return (f"{self.cable} breaks at {self.time:g} s in {self.scenario}, {self.geometry}", rows)


@verb()
def compare_reactions(
    scenario: str | Path = "acrobot_broken_redistributed",
    cable: int = 2,
    time: float = 1.0,
    *,
    reactions: Sequence[str] = tuple(REACTIONS),
    after: float = 2.0,
    overrides: Sequence[str] = (),
    session: Session | None = None,
    **kept: Any,
) -> BreakReactions:
    """Breaks a cable of a visual servo by motor torques, once for each reaction.

    Args:
        scenario: Name or path of the scenario; its own failures and emergency are left out.
        cable: Number of the cable that breaks, from 0.
        time: Time of the break [s].
        reactions: Names of `REACTIONS`.
        after: Time simulated after the break [s].
        overrides: Further items "key.subkey=value" that replace what the file says.
        session: Who follows the runs and may stop them; None: nobody.
        kept: `folder`: for `results.json` and the figure; None: nothing is written. `overwrite`:
            whether results in the folder may be replaced. `formats`: endings of the figure's file.

    Raises:
        OutputFolderError: The folder holds something, or cannot be written.
        ScenarioError: A reaction is unknown, there is no such cable, or the scenario cannot react.
        CdprError: It cannot be built.
        StoppedError: The session asked to stop.
    """
    told = session or Session()
    for option in kept:
        if option not in KEPT:
            raise ScenarioError(f"{option!r} is unknown; {closest(option, KEPT)}")
    _check(reactions, {"time": time, "after": after})
    folder, formats = kept.get("folder"), kept.get("formats", DEFAULT_FORMATS)
    with (
        nullcontext() if folder is None
        else results_folder(Path(folder), kept.get("overwrite", False), redo=True)
    ) as results:  # fmt: skip
        if results is not None:
            told.opened(results)
        rows: dict[str, dict[str, Any]] = {}
        robot = _robot(str(scenario), overrides, cable)
        scenes = {  # all of them before the first run: a scenario may not know a reaction
            reaction: _scene(str(scenario), overrides, cable, (time, after), reaction)
            for reaction in reactions
        }
        name, loaded = robot.cables[cable].name, ""
        for reaction, scene in scenes.items():
            loaded = scene.name
            told.say(f"{name} breaks: {reaction}")
            run = run_scenario(scene, RunSession(should_stop=told.stop))
            if run.outcome == Outcome.INTERRUPTED:
                raise StoppedError(f"stopped after {len(rows)} of {len(reactions)} reactions")
            end = float(run.log["time"][-1])
            if end <= time:
                raise ScenarioError(
                    f"time: found {time:g}; accepted: before the run of {loaded} ends, {end:g} s"
                )
            told_of = after_break(run.log, robot, cable, time, scene.cables.pulleys)
            rows[reaction] = {"outcome": Outcome(run.outcome).name.lower(), **told_of}
        words = robot.geometry_words(scene.cables.pulleys)
        found = BreakReactions(loaded, name, time, rows, words)
        if results is None:
            return found
        write_json(results.path / RESULTS, found.as_dict())
        pictures = figure_writers({"reactions": found.plot}, formats)
        with drawing(results.publish()):
            failed = write_pictures(results.path, dict(pictures))
        return replace(found, failed=failed)


def _check(reactions: Sequence[str], numbers: Mapping[str, float]) -> None:
    """Refuses reactions that there are not, and times that make no sense."""
    unknown = [name for name in reactions if name not in REACTIONS]
    if unknown or not reactions:
        found = ", ".join(map(repr, unknown)) or "none"
        raise ScenarioError(f"reactions: found {found}; accepted: {', '.join(REACTIONS)}")
    for key, value in numbers.items():
        if not 0.0 < value < float("inf"):
            raise ScenarioError(f"{key}: found {value:g}; accepted: a number > 0 [s]")


def _robot(name: str, overrides: Sequence[str], cable: int) -> Robot:
    """The robot of a visual servo, which has such a cable."""
    plain = load_scenario(name, overrides)
    if not isinstance(plain, Scenario):
        raise ScenarioError(f"{plain.name}: found kind {plain.kind}; accepted: a visual servo")
    robot = load_robot(plain.robot)
    last = len(robot.cables) - 1
    if not 0 <= cable <= last:
        raise ScenarioError(f"cable: found {cable}; accepted: 0 to {last} of {robot.name}")
    return robot


def _scene(
    name: str, overrides: Sequence[str], cable: int, times: tuple[float, float], reaction: str
) -> Scenario:
    """A scenario in which a cable breaks, after the first time, for the second one [s]."""
    time, after = times
    loaded = load_scenario(name, [
        *overrides,
        f"failures.events=[{{kind: cable_breaks, time: {time!r}, cable: {cable}}}]",
        f"emergency={REACTIONS[reaction]}",
        f"duration={time + after!r}", f"log_rate={ROWS:g}",
    ])  # fmt: skip
    assert isinstance(loaded, Scenario)
    return loaded
