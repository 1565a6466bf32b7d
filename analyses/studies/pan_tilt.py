"""Study: a camera on two joints beside a fixed one, from starts all over the workspace.

ACROBOT approaches a tag from 50 starts, by its camera as it is mounted, and by the same camera on
two joints that keep the tag in the middle of the image, with the errors of their encoders that the
scenario has. Starts are drawn evenly: positions in a box, angles about x and y up to `TILT`, about
z up to `TURN`. Nobody tells the joints where the tag is; what they do not see they look for. Of the
two pose-based schemes, pbvs takes the tag, pbvs-line the camera along a straight line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.simulation.pan_tilt_report import pan_tilt_summary
from cdpr_drake.analyses.simulation.run_summary import final_errors
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_pan_tilt"

FIXED, TURNED = "fixed", "pan-tilt"

SCHEMES = ("pbvs", "pbvs-line")

LOWER, UPPER = (-0.1, -0.15, 0.3), (0.25, 0.15, 0.5)
"""Corners of the box of starts [m]."""

TILT, TURN = 15.0, 30.0
"""Largest angles of starts about x and y, and about z [deg]."""

STARTS = (50, 2)

_STREAM = 401


def start(seed: int) -> tuple[list[float], list[float]]:
    """Position [m] and angles [deg] of the start of a seed."""
    random = np.random.default_rng([seed, _STREAM])
    position = random.uniform(LOWER, UPPER)
    angles = random.uniform(-1.0, 1.0, 3) * [TILT, TILT, TURN]
    return np.round(position, 4).tolist(), np.round(angles, 2).tolist()


def cases(_form: Form) -> Iterator[Case]:
    """Both cameras."""
    for scheme in SCHEMES:
        for view in (FIXED, TURNED):
            yield Case(name=f"{scheme} {view}", keys={"scheme": scheme, "camera": view})


def overrides(scheme: str, view: str, seed: int) -> list[str]:
    """What differs from the scenario in a run."""
    position, angles = start(seed)
    words = [
        f"seed={seed}", f"initial_pose={{position: {position}, angles_deg: {angles}}}",
        "integration.engine=compiled", f"controller.scheme={scheme}",
        "tension_management=null",  # of cameras alone
    ]  # fmt: skip
    return words if view == TURNED else [*words, "camera.pan_tilt=null"]


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A run.

    Returns:
        outcome; error_m and error_rad, the last true ones; seen_at_start, first_seen_s, unseen_s
        after it, kept: seen from its first sight to the end; and of joints, else None:
        median_off_px, largest_deg, the largest angle, and encoder_deg, the rms error of encoders.
    """
    view = case.keys["camera"]
    words = overrides(case.keys["scheme"], view, seed)
    run = run_scenario(choose_compiled_loop(load_scenario(SCENARIO, words)))
    log, turned = run.log, view == TURNED
    settings = run.servo.scenario.camera.pan_tilt
    found = np.asarray(log["turned_found" if turned else "found"])[:, 0] > 0.0
    times = np.asarray(log["time"])
    # The row of time 0 has what stood there before the first image.
    seen = np.flatnonzero(found)
    first = int(seen[0]) if len(seen) else None
    position, rotation = final_errors(run)
    unseen = None if first is None else float(np.sum((np.diff(times) * ~found[:-1])[first:]))
    row = {
        "outcome": Outcome(run.outcome).name.lower(),
        "error_m": position,
        "error_rad": rotation,
        "seen_at_start": first is not None and first <= 1,
        "first_seen_s": None if first is None else float(times[first]),
        "unseen_s": unseen,
        "kept": unseen == 0.0,
        "converged": run.outcome == Outcome.CONVERGED,
        "median_off_px": None,
        "largest_deg": None,
        "encoder_deg": None,
    }
    if settings is not None:
        told = pan_tilt_summary(log, settings, run.servo.pinhole)
        row["median_off_px"] = told["off_center_px"]["median"]
        row["largest_deg"] = float(max(told["largest_angles_deg"]))
        row["encoder_deg"] = float(max(told["encoder_error_deg"]))
    return row


@statement("On joints the camera keeps the target in view from its first sight on.", basis=OURS)
def kept(runs: Runs) -> Finding:
    """Every start."""
    some = runs(camera=TURNED)
    late = float(np.max(some["first_seen_s"]))
    return Finding(
        found=f"kept in {int(np.sum(some['kept']))} of {len(some)} runs, found after at most "
        f"{late:.2f} s",
        held=[bool(x) for x in some["kept"]],
    )


@statement("On joints the servo converges from every start.", basis=OURS)
def converged(runs: Runs) -> Finding:
    """Every start."""
    some = runs(camera=TURNED)
    return Finding(
        found=f"{int(np.sum(some['converged']))} of {len(some)} starts, largest error "
        f"{1e3 * float(np.max(some['error_m'])):.2f} mm",
        held=[bool(x) for x in some["converged"]],
    )


@statement("The fixed camera loses or never sees the target from some of the starts.", basis=OURS)
def lost(runs: Runs) -> Finding:
    """Any start, scheme by scheme."""
    words, held = [], []
    for scheme, some in runs(camera=FIXED).by("scheme"):
        at_all = np.isfinite(some["first_seen_s"].astype(float))
        gone = at_all & ~some["kept"].astype(bool)
        words.append(
            f"{scheme}: of {len(some)} starts {int(np.sum(~at_all))} never seen, "
            f"{int(np.sum(gone))} lost on the way"
        )
        held.append(bool(np.any(~at_all | gone)))
    return Finding(found="; ".join(words), held=held)


def figure(runs: Runs) -> Figure:
    """Starts from above, by how the fixed camera ends, and when the joints have the target."""
    drawn, axes = new_figure(1, 2, (13.0, 5.4), "A camera on two joints beside a fixed one")
    fixed = runs(camera=FIXED, scheme=SCHEMES[-1])
    there = np.isfinite(fixed["first_seen_s"].astype(float))
    held = fixed["kept"].astype(bool)
    places = np.array([start(int(seed))[0] for seed in fixed["seed"]])
    words = (
        ("never sees it", ~there), ("keeps it", there & held), ("loses it", there & ~held)
    )  # fmt: skip
    for k, (label, which) in enumerate(words):
        look = nth_look(k)
        axes[0].plot(
            *places[which, :2].T, look.marker or "o", color=look.color, markerfacecolor="none",
            linestyle="none", label=f"fixed camera {label}: {int(np.sum(which))}",
        )  # fmt: skip
    axes[0].set(xlabel="x of the start [m]", ylabel="y of the start [m]", ylim=(-0.17, 0.27))
    axes[0].set_title(f"starts from above, {SCHEMES[-1]}", fontsize=11)
    if runs.has(camera=TURNED):
        for k, (scheme, some) in enumerate(runs(camera=TURNED).by("scheme")):
            look = nth_look(k)
            axes[1].plot(
                some["largest_deg"], some["first_seen_s"], look.marker or "o", color=look.color,
                markerfacecolor="none", linestyle="none", label=f"camera on joints, {scheme}",
            )  # fmt: skip
    axes[1].set(xlabel="largest angle of a joint [deg]", ylabel="first seen after [s]")
    for axis in axes:
        axis.legend(loc="best")
    return drawn


def parameters(_form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    return {
        "scenario": SCENARIO, "lower_m": LOWER, "upper_m": UPPER, "tilt_deg": TILT,
        "turn_deg": TURN,
    }  # fmt: skip


STUDY = Study(
    name="pan-tilt",
    title="A camera on two joints beside a fixed one: who keeps the target in view",
    cases=cases,
    measure=measure,
    seeds=STARTS,
    parameters=parameters,
    checks=(kept, converged, lost),
    tables=[
        Summary(
            "Starts by scheme and camera",
            ("scheme", "camera"),
            {
                "starts": Cell("runs"),
                "converged": Cell("total", "converged"),
                "seen at the start": Cell("total", "seen_at_start"),
                "kept in view": Cell("total", "kept"),
                "largest final error [mm]": Cell("largest", "error_m", ".3f"),
                "off the middle, median [px]": Cell("median", "median_off_px", ".1f"),
                "largest angle [deg]": Cell("largest", "largest_deg", ".1f"),
            },
        )
    ],
    figures={"pan_tilt": figure},
)
