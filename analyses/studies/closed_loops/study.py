"""Study: does a servo converge from every pose of its control stability workspace?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.closed_loops.figures import error_figure, way_figure
from cdpr_drake.analyses.studies.closed_loops.loops import (
    MANAGED,
    MANAGEMENT,
    MODES,
    OPTIONS,
    PLAIN,
    ROBOT,
    SEED,
    SETTINGS,
    TILT_DEG,
    VERDICT,
    YAW_DEG,
    loop_setup,
    measure,
    stable_starts,
)
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    OURS,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.stability_case import SCHEMES
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop

STARTS, QUICK_STARTS = 200, 2

NAME = "stability-closed-loop"

CONVERGED, TARGET_LOST = "converged", "target_lost"


def closed_loop_study(scheme: str) -> Study:
    """The study of a visual servoing scheme."""
    return Study(
        name=NAME if scheme == "pbvs" else f"{NAME}-{scheme}",
        title=f"Closed loops from poses of the control stability workspace, {scheme}",
        source="servoing thesis 3.3, 3.4; 5.1, 5.2.1",
        cases=partial(cases, scheme),
        measure=measure,
        seeds=(STARTS, QUICK_STARTS),
        before="drawing starts",
        unit="loops",
        parameters=partial(parameters, scheme),
        numbers=lambda runs: {"modes": {mode: mode_counts(some) for mode, some in runs.by("mode")}},
        stated="What the criterion promises",
        checks=(_reached(scheme), _managed(scheme)),
        tables=[
            Summary(f"{ROBOT}, {scheme}: loops from poses of SZ", ("mode",), COLUMNS),
            not_converged_table,
        ],
        figures={"errors": error_figure, "ways": way_figure},
    )


def cases(scheme: str, form: Form) -> Iterator[Case]:
    """The modes; their seeds are numbers of starts."""
    starts = stable_starts(scheme, _count(form)).poses.tolist()
    for mode, words in MODES.items():
        yield Case(name=mode, keys={"mode": mode, "scheme": scheme}, label=words, data=starts)


def _count(form: Form) -> int:
    return form.asked_seeds or (QUICK_STARTS if form.quick else STARTS)


def parameters(scheme: str, form: Form) -> Mapping[str, Any]:
    """What all loops have in common."""
    setup, starts = loop_setup(scheme), stable_starts(scheme, _count(form))
    return {
        "robot": ROBOT, "scheme": scheme, "verdict": VERDICT, "options": OPTIONS, "seed": SEED,
        "bounds": setup.bounds.as_dict(), "settings": SETTINGS, "management": MANAGEMENT,
        "loop": choose_compiled_loop(setup.scenario).integration.loop,
        "scenario": setup.scenario, "case": setup.case,
        "starts": {
            "count": len(starts.poses), "drawn": starts.drawn, "not_held": starts.not_held,
            "not_seen": starts.not_seen, "not_stable": starts.not_stable,
            "largest_tilt_deg": TILT_DEG, "largest_yaw_deg": YAW_DEG,
        },
    }  # fmt: skip


def mode_counts(runs: Runs) -> dict[str, Any]:
    """Counts and extremes of the runs of one mode."""
    good, inside = runs["outcome"] == CONVERGED, runs["poses_outside_z"] == 0
    lost = runs["outcome"] == TARGET_LOST
    return {
        "runs": len(runs), "converged": int(np.sum(good)), "target_lost": int(np.sum(lost)),
        "otherwise": int(np.sum(~good & ~lost)),
        "ways_inside_z": int(np.sum(inside)),
        "ways_inside_z_converged": int(np.sum(inside & good)),
        "poses_checked": runs.total("poses_checked"),
        "poses_outside_z": runs.total("poses_outside_z"),
        "least_margin": runs.smallest("least_margin"),
        **{
            f"largest_{name}": runs.largest(name)
            for name in ("error_growth", "error_peak", "estimate_error_m", "estimate_error_rad")
        },
        "largest_position_error_m": float(np.max(runs["position_error_m"][good], initial=0.0)),
    }  # fmt: skip


def _of(part: str, whole: str) -> Any:
    return lambda runs: "{} of {}".format(*(mode_counts(runs)[name] for name in (part, whole)))


COLUMNS = {
    "runs": Cell("runs"),
    "converged": Cell("runs", where={"outcome": CONVERGED}),
    "tag left image": Cell("runs", where={"outcome": TARGET_LOST}),
    "converged of ways inside Z": _of("ways_inside_z_converged", "ways_inside_z"),
    "least margin": Cell("smallest", "least_margin", ".3f"),
    "largest |e| / |e| at start": Cell("largest", "error_peak", ".2f"),
    "estimate off by [mm]": Cell("largest", "estimate_error_m", ".1f"),
    "by [deg]": Cell("largest", "estimate_error_rad", ".2f"),
}
"""Of the table of modes."""


def not_converged_table(runs: Runs) -> list[Table]:
    """Runs that did not converge, where there are some."""
    table = new_table(
        "Not converged", ("loop", "start", "outcome"),
        ("x, y, z [m]", "time [s]", "way outside Z", "taut cables at the end"),
    )  # fmt: skip
    for run in runs:
        if run["outcome"] != CONVERGED:
            table.add_row(
                run["mode"], str(run.seed), run["outcome"],
                ", ".join(f"{x:.2f}" for x in run["start_pose"][4:]), f"{run['time_s']:.1f}",
                f"{run['poses_outside_z']} of {run['poses_checked']} poses",
                str(run["taut_at_end"]),
            )  # fmt: skip
    return [table] if table.row_count else []


def _reached(scheme: str) -> Check:
    @statement(
        f"From any pose of the control stability workspace the servo reaches its goal ({ROBOT}, "
        f"{scheme}).",
        "(3.27), 3.4",
        name="reached",
        source="servoing thesis (3.27), 3.4",
        rule="every loop of each mode converges; in part: all whose way stays inside do",
        cause=SOURCE,
    )
    def check(runs: Runs) -> Finding:
        """(3.27), of loops whose way stays inside, and of all."""
        modes = {mode: mode_counts(some) for mode, some in runs.by("mode")}
        modes.pop(MANAGED, None)  # the criterion takes every cable as taut
        if not modes:
            raise MissingRuns("all modes")
        return Finding(
            found="; ".join(
                f"{mode}: {s['converged']} of {s['runs']} converge, of those whose way stays "
                f"inside {s['ways_inside_z_converged']} of {s['ways_inside_z']}"
                for mode, s in modes.items()
            ),
            held=[s["runs"] == s["converged"] for s in modes.values()],
            some=all(s["ways_inside_z"] == s["ways_inside_z_converged"] for s in modes.values()),
            why="The criterion says nothing of the tag's leaving the image, nor of ways that leave "
            "the workspace.",
        )

    return check


def _managed(scheme: str) -> Check:
    @statement(
        "Loops that end elsewhere, on slack cables, reach their goal when tensions are managed "
        f"({ROBOT}, {scheme}).",
        "5.1, 5.2.1",
        name="managed",
        source="servoing thesis 5.1, 5.2.1",
        rule="each that ends so without tension management converges with it",
        basis=OURS,
    )
    def check(runs: Runs) -> Finding:
        """5.1: what ends with slack cables without tension management, and how it ends with it."""
        modes = dict(runs.by("mode"))
        if not {PLAIN, MANAGED} <= set(modes):
            raise MissingRuns(f"mode {PLAIN} or {MANAGED}")
        alone, ends = modes[PLAIN], modes[MANAGED].list("outcome")
        cables = len(load_robot(ROBOT).cables)
        good = alone["outcome"] == CONVERGED
        arrived = np.array(ends) == CONVERGED
        hung = np.flatnonzero(~good & (alone["taut_at_end"] < cables))
        places = "; ".join(
            f"start {k} at ({', '.join(f'{x:.2f}' for x in alone['start_pose'][k, 4:])}) m on "
            f"{alone['taut_at_end'][k]} cables, with it {ends[k]}"
            for k in hung[:5]
        )
        return Finding(
            found=f"{places or 'no loop ends so'}; {np.sum(good)} and {np.sum(arrived)} of "
            f"{len(ends)} converge without and with it, {np.sum(good & ~arrived)} without it alone",
            held=arrived[hung].tolist(),
            why="Worst errors that a search finds, a constantly wrong estimate; 1 N, "
            "0.003 m/(N s).",
        )

    return check


STUDIES = tuple(map(closed_loop_study, SCHEMES))
"""One of each scheme."""
