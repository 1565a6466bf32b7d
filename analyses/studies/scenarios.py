"""Study: every scenario that comes with the package, as it ships, beside what its file expects.

The full form takes each file as it stands, with rendered images where it says so; the quick form
projects targets and cuts what is long.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from cdpr_drake.analyses.reporting.statements import new_table
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, RENDERED
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop, set_loop, uses_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_kind, scenario_names
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd

QUICK_LOOP, QUICK_DIAGRAM = 100.0, 1.0
"""Simulated time of the quick form at most, of what the compiled loop does and of what only a
diagram can do [s]."""

LONGEST_MESSAGE = 300

OVER = ("timeout", "completed")
"""Outcomes of runs that last as long as they may."""

LEAST_SHARE = 1e-4
"""Smaller shares of what is expected are drawn there."""

APART = 0.14
"""Half of what lies between a scenario's two errors, of the distance of scenarios."""


def cases(form: Form) -> Iterator[Case]:
    """The scenarios that ship."""
    for name in scenario_names():
        yield Case(name=name, keys={"scenario": name, "short": form.quick})


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A scenario as its file says, or in short, see `ended`.

    A scenario that cannot be run counts as one that failed: it costs no other.
    """
    name, expected, length = case.keys["scenario"], None, np.nan
    kind = SCENARIO_KINDS[scenario_kind(name)]
    row: dict[str, Any] = {
        "outcome": "failed", "time_s": np.nan, "distance_m": np.nan, "angle_rad": np.nan,
        "duration_s": np.nan, "rendered": False,
    }  # fmt: skip
    try:
        shipped = load_scenario(name)
        expected, length = shipped.expected, shipped.duration
        scenario = as_run(name, case.keys["short"])
        kind.check(scenario)
        with TemporaryDirectory() as folder:  # the log of hours takes no memory there
            result = kind.run(scenario, RunSession(log_folder=Path(folder) / "log"))
            distance, angle = kind.end_error(result)
    except CdprError as problem:
        return ended(row | {"message": str(problem)[:LONGEST_MESSAGE]}, expected, length)
    row = {
        "outcome": Outcome(result.outcome).name.lower(), "time_s": result.sim_time,
        "distance_m": distance, "angle_rad": angle, "duration_s": scenario.duration,
        "rendered": hasattr(scenario, "camera") and scenario.camera.kind == RENDERED,
        "message": result.message[:LONGEST_MESSAGE],
    }  # fmt: skip
    return ended(row, expected, length)


def as_run(name: str, short: bool) -> Any:
    """A scenario as it is run.

    Args:
        name: Its name.
        short: Whether targets are projected where they can be, and what is long is cut.

    Raises:
        CdprError: It cannot be.
    """
    if not short:
        return set_loop(load_scenario(name))[0]
    asked = load_scenario(name, quick_overrides(name))
    is_servo = SCENARIO_KINDS[asked.kind].is_servo
    scenario: Any = choose_compiled_loop(asked) if is_servo else set_loop(asked, repeated=True)[0]
    longest = QUICK_LOOP if uses_compiled_loop(scenario) else QUICK_DIAGRAM
    return replace(scenario, duration=min(scenario.duration, longest))


def quick_overrides(name: str) -> list[str]:
    """What the quick form changes of a scenario beside its duration: a projected camera, where the
    target can be projected."""
    scenario = load_scenario(name)
    if getattr(getattr(scenario, "camera", None), "kind", None) != RENDERED:
        return []
    override = [f"camera.kind={PROJECTED}"]
    try:
        load_scenario(name, override)
    except CdprError:
        return []
    return override


def ended(row: Mapping[str, Any], expected: ExpectedEnd | None, length: float) -> dict[str, Any]:
    """How a scenario ended, beside what it expects.

    Args:
        row: outcome, message: as `summary.json` names it, and what more there is to say; time_s:
            when; distance_m, angle_rad: true errors at the end; duration_s: how long it might have
            run; rendered: whether it had rendered images.
        expected: What its file expects; None: nothing.
        length: How long it runs by its file [s].

    Returns:
        The row, and expected; whole: whether it might run as long as its file says; cut: whether
        it was cut before anything had ended it; as_expected: whether the outcome is the expected
        one, or nothing had ended it before it was cut; distance_share, angle_share: of what is
        expected at most, None where nothing is; close_enough: whether errors that the file bounds
        are within that, which one that is not known is not, None where none can be held against
        the file, as those of a run that was cut.
    """
    whole = bool(row["duration_s"] >= length)
    cut = not whole and row["outcome"] in OVER
    most: tuple[float | None, float | None] = (
        (None, None) if expected is None else (expected.position, expected.rotation_deg)
    )
    errors = row["distance_m"], float(np.degrees(row["angle_rad"]))
    shares = [None if m is None else e / m for e, m in zip(errors, most, strict=True)]
    known = [share for share in shares if share is not None and not cut]
    return {
        **row,
        "expected": None if expected is None else asdict(expected),
        "whole": whole,
        "cut": cut,
        "as_expected": expected is not None and (cut or row["outcome"] == expected.outcome),
        "distance_share": shares[0],
        "angle_share": shares[1],
        "close_enough": all(share <= 1.0 for share in known) if known else None,
    }


def largest_share(run: Run) -> float:
    """The larger share of what the file bounds; infinite where an error is not known."""
    shares = [run["distance_share"], run["angle_share"]]
    return float(max(np.nan_to_num(one, nan=np.inf) for one in shares if one is not None))


@statement("Every scenario that ships says how it ends.", "outcome, distance and angle", basis=OURS)
def scenarios_expect_an_end(runs: Runs) -> Finding:
    """Whether every file says how it ends."""
    without = [run.case for run in _some(runs) if run["expected"] is None]
    return Finding(
        found=f"{len(runs) - len(without)} of {len(runs)}"
        + (f"; not {', '.join(without)}" * bool(without)),
        held=[run["expected"] is not None for run in runs],
    )


@statement(
    "Every scenario that ships ends as its file says.",
    rule="the outcome is the expected one, or nothing had ended the run before it was cut",
    basis=OURS,
)
def scenarios_end_as_expected(runs: Runs) -> Finding:
    """Whether every scenario ends with the outcome that its file expects."""
    good, cut = _some(runs).total("as_expected"), runs.total("cut")
    words = f"{good} of {len(runs)}, {runs.total('rendered')} with rendered images"
    if cut:
        words += f", {cut} cut short before anything ended them"
    if good < len(runs):
        words += f"; not {', '.join(map(_told_end, runs(as_expected=False)))}"
    return Finding(found=words, held=runs["as_expected"].tolist())


def _told_end(run: Run) -> str:
    wanted = "nothing" if run["expected"] is None else run["expected"]["outcome"]
    more = f": {run['message']}" if run["message"] else ""
    return f"{run.case} ({run['outcome']}, {wanted} expected{more})"


@statement("True errors at the end are within what the files expect.", basis=OURS)
def scenarios_end_close_enough(runs: Runs) -> Finding:
    """Whether true errors at the end are within what files expect."""
    told = _some(runs)(close_enough=(True, False))
    if not len(told):
        raise MissingRuns("all runs were cut")
    largest = max(told, key=largest_share)
    words = (
        f"{told.total('close_enough')} of {len(told)}; the largest share of it "
        f"{largest_share(largest):.2g}, {largest.case}"
    )
    if wrong := [run.case for run in told(close_enough=False)]:
        words += f"; not {', '.join(wrong)}"
    return Finding(found=words, held=told["close_enough"].tolist())


def _some(runs: Runs) -> Runs:
    """The runs.

    Raises:
        MissingRuns: There are none.
    """
    if not len(runs):
        raise MissingRuns("no scenario is finished")
    return runs


def table(runs: Runs) -> Table:
    """How each ended, beside what its file expects."""
    short = _some(runs).rows[0]["short"]
    told = new_table(
        "Scenarios that ship" + (", in short" if short else ""),
        ("scenario", "camera", "ends", "expected"),
        ("at [s]", "distance [mm]", "at most", "angle [deg]", "at most"),
    )
    for run in runs:
        expected = run["expected"] or {"outcome": "-", "position": None, "rotation_deg": None}
        told.add_row(
            run.case,
            "rendered" if run["rendered"] else "not rendered",
            ("cut" if run["cut"] else run["outcome"].replace("_", " "))
            + ("" if run["as_expected"] else " (!)"),
            expected["outcome"].replace("_", " "),
            f"{run['time_s']:.2f}",
            f"{1e3 * run['distance_m']:.3f}" + (" (!)" if run["close_enough"] is False else ""),
            _most(expected["position"], 1e3),
            f"{np.degrees(run['angle_rad']):.3f}",
            _most(expected["rotation_deg"]),
        )
    return told


def _most(value: float | None, scale: float = 1.0) -> str:
    return "-" if value is None else f"{scale * value:g}"


def figure(runs: Runs) -> Figure:
    """True errors at the end of each scenario as shares of what its file expects at most."""
    drawn, panel = new_figure(
        1, 1, (11.0, 1.6 + 0.24 * len(runs)),
        "How scenarios end beside what their files expect"
        + (", short runs" if runs.rows[0]["short"] else ""),
    )  # fmt: skip
    places, cut = np.arange(len(runs)), runs["cut"]
    for column, label in enumerate(("distance", "angle")):
        look, apart = nth_look(column), APART * (2 * column - 1)
        shares = np.maximum(runs[f"{label}_share"].astype(float), LEAST_SHARE)
        style = {"marker": look.marker, "linestyle": "none", "color": look.color}
        panel.plot(shares[~cut], places[~cut] + apart, label=label, **style)
        panel.plot(
            shares[cut], places[cut] + apart, fillstyle="none",
            label=f"{label}, run cut short" if np.any(cut) else None, **style,
        )  # fmt: skip
    panel.axvline(1.0, color="#303030", linewidth=1.0, linestyle="--", label="largest expected")
    wrong = ~runs["as_expected"]
    panel.plot(
        np.ones(int(wrong.sum())), places[wrong], marker="x", markersize=12, linestyle="none",
        color=nth_look(7).color, label="another outcome" if wrong.any() else None,
    )  # fmt: skip
    panel.set_xscale("log")
    panel.set_yticks(places, list(map(_row_label, runs)))
    panel.set_ylim(-1.0, len(runs))
    panel.tick_params(axis="y", labelsize=8)
    panel.invert_yaxis()
    panel.set_xlabel("error at the end, per largest expected one [-]")
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return drawn


def _row_label(run: Run) -> str:
    if run["cut"]:
        return f"{run.case}: cut at {run['time_s']:g} s"
    any_error = ", any error" if run["close_enough"] is None else ""
    return f"{run.case}: {run['outcome'].replace('_', ' ')}{any_error}"


STUDY = Study(
    name="scenarios",
    title="Every scenario that ships, beside what its file expects",
    cases=cases,
    measure=measure,
    checks=(scenarios_expect_an_end, scenarios_end_as_expected, scenarios_end_close_enough),
    stated="What scenarios have to show",
    tables=[table],
    figures={"endings": figure},
    unit="scenarios",
)
