"""Study: exit and anchor points that are learnt while a visual servo runs.

ACROBOT with its large platform approaches a tag while all exit and anchor points are believed some
way off, each in a random direction; camera, encoders and tension sensors have their noise. Models:

* true: what is believed is right, and nothing is learnt;
* wrong: it is wrong, and stays;
* learnt: it is wrong, and section `adaptation` learns.

Besides, wrong measurements: an encoder that freezes, a camera that is knocked, points that are much
farther off than they are said to be, and none of these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_adaptation"

TRUE, WRONG, LEARNT = "true", "wrong", "learnt"
MODELS = (TRUE, WRONG, LEARNT)

DISTANCES = (0.01, 0.02)
"""How far each point is off [m]."""

SEEDS = (20, 2)

NOTHING, FROZEN, KNOCKED, FAR = "nothing", "encoder freezes", "camera knocked", "points far off"

FLAWS = {
    NOTHING: [],
    FROZEN: [
        "sensors.log=[encoder]",
        "failures.events=[{kind: sensor_freezes, sensor: encoder, cable: 3, time: 1.0}]",
    ],
    KNOCKED: ["camera.fault={kind: 'off', start: 2.0, duration: 2.0, offset: [0.01, 0.0, 0.0]}"],
    FAR: ["perturbations.exit_points=0.08", "perturbations.anchor_points=0.08"],
}  # fmt: skip
"""What is wrong besides, and what it changes in the scenario, of points `DISTANCES[0]` off."""

TOO_MUCH, NO_WORSE = 1.2, 1.05
"""Ratios to the true model and to the wrong one that are accepted."""

SIGMAS = 3.0

STOPPED = 3e-4
"""Where the servo stops [m]: errors below are what the images' noise leaves."""


def cases(form: Form) -> Iterator[Case]:
    """Models and distances, then flaws."""
    for distance in DISTANCES:
        for model in MODELS:
            keys = {"distance_m": distance, "model": model, "flaw": NOTHING}
            yield Case(name=f"{1e3 * distance:g} mm {model}", keys=keys)
    for flaw in FLAWS:
        if flaw != NOTHING:
            keys = {"distance_m": DISTANCES[0], "model": LEARNT, "flaw": flaw}
            yield Case(name=flaw, keys=keys)


def overrides(keys: Mapping[str, Any], seed: int) -> list[str]:
    """What differs from the scenario in a run."""
    wrong = 0.0 if keys["model"] == TRUE else keys["distance_m"]
    sigma = keys["distance_m"] / np.sqrt(3.0)
    learns = f"{{exit_points: {sigma:g}, anchor_points: {sigma:g}, slack_below: 0.5}}"
    return [
        f"seed={seed}", f"perturbations.exit_points={wrong:g}",
        f"perturbations.anchor_points={wrong:g}", "integration.engine=compiled",
        f"adaptation={learns if keys['model'] == LEARNT else 'null'}", *FLAWS[keys["flaw"]],
    ]  # fmt: skip


def path_of(run: RunResult) -> Array:
    """Positions of the platform, shape (n, 3) [m]."""
    return np.asarray(run.log["X_WP"])[:, 4:]


@lru_cache(maxsize=64)
def true_path(seed: int) -> Array:
    """The path of the true model with the noise of a seed, shape (n, 3) [m]."""
    keys = {"distance_m": DISTANCES[0], "model": TRUE, "flaw": NOTHING}
    return path_of(run_scenario(load_scenario(SCENARIO, overrides(keys, seed))))


def off_path(path: Array, other: Array) -> float:
    """The largest distance of a path's points from the points of another [m]."""
    return float(np.max(cKDTree(other).query(path)[0]))


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A run, beside one of the true model with the same noise.

    Returns:
        outcome; error_m, the last true distance from the goal; way_m, the path's length;
        deviation_m, its mean distance from the straight line; off_m, the largest from the path of
        the true model; slack_s, seconds of slack cables; and of models that are learnt, else None:
        before_m and after_m, rms errors of coordinates; largest_sigmas, the largest error of a
        coordinate or an offset; excited directions; believed and rejected models; doubts.
    """
    run = run_scenario(load_scenario(SCENARIO, overrides(case.keys, seed)))
    told = summarize(run)
    path, learnt = path_of(run), told.get("adaptation")
    row = {
        "outcome": Outcome(run.outcome).name.lower(),
        "error_m": told["final_position_error_m"],
        "way_m": float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1))),
        "deviation_m": told["camera_deviation_m"]["mean"],
        "off_m": off_path(path, true_path(seed)),
        "slack_s": told["slack_cable_seconds"],
    }
    names = {
        "before_m": "points_rms_before_m", "after_m": "points_rms_after_m",
        "largest_sigmas": "largest_error_in_sigmas", "excited": "excited",
        "believed": "models_believed", "rejected": "models_rejected",
    }  # fmt: skip
    for name, key in names.items():
        row[name] = None if learnt is None else learnt[key]
    row["doubts"] = [] if learnt is None else learnt["doubts"]
    row["doubted"] = bool(row["doubts"])
    return row


def _pairs(runs: Runs, other: str, column: str) -> Array:
    """Values of learnt models over those of others with the same seed and distance."""
    ratios = []
    for _, some in runs(flaw=NOTHING).by("distance_m", "seed"):
        pair = [[run[column] for run in some if run["model"] == model] for model in (LEARNT, other)]
        if all(len(one) == 1 for one in pair):
            ratios.append(pair[0][0] / pair[1][0])
    if not ratios:
        raise MissingRuns(f"{LEARNT} and {other}")
    return np.array(ratios)


def _ratio_words(ratios: Array, most: float) -> str:
    return (
        f"in {int(np.sum(ratios <= most))} of {len(ratios)} runs at most {most:g}; median "
        f"{np.median(ratios):.3f}, largest {np.max(ratios):.3f}"
    )


@statement("What is learnt is within three standard deviations of the truth.", basis=OURS)
def within(runs: Runs) -> Finding:
    """The largest error of 56 numbers of each run."""
    largest = runs(model=LEARNT, flaw=NOTHING)["largest_sigmas"]
    return Finding(
        found=f"largest of all numbers of a run: median {np.median(largest):.2f}, largest "
        f"{np.max(largest):.2f} standard deviations",
        held=[bool(x <= SIGMAS) for x in largest],
    )


@statement("Points are nearer to the truth afterwards.", basis=OURS)
def nearer(runs: Runs) -> Finding:
    """Root mean squares of coordinates."""
    some = runs(model=LEARNT, flaw=NOTHING)
    ratios = some["after_m"] / some["before_m"]
    return Finding(found=_ratio_words(ratios, 1.0), held=[bool(x <= 1.0) for x in ratios])


@statement("The path is no longer than with the true model by more than 20 %.", basis=OURS)
def way_beside_true(runs: Runs) -> Finding:
    """Ratios of lengths."""
    ratios = _pairs(runs, TRUE, "way_m")
    return Finding(found=_ratio_words(ratios, TOO_MUCH), held=[bool(x <= TOO_MUCH) for x in ratios])


@statement(
    "The path is no farther from the straight line than with the true model by more than 20 %.",
    basis=OURS,
)
def line_beside_true(runs: Runs) -> Finding:
    """Ratios of mean distances."""
    ratios = _pairs(runs, TRUE, "deviation_m")
    return Finding(found=_ratio_words(ratios, TOO_MUCH), held=[bool(x <= TOO_MUCH) for x in ratios])


@statement("The final error is no larger than with the true model by more than 20 %.", basis=OURS)
def error_beside_true(runs: Runs) -> Finding:
    """Ratios of errors."""
    ratios = _pairs(runs, TRUE, "error_m")
    largest = float(np.max(runs(model=LEARNT, flaw=NOTHING)["error_m"]))
    return Finding(
        found=_ratio_words(ratios, TOO_MUCH) + f"; largest error {1e3 * largest:.3f} mm",
        held=[bool(x <= TOO_MUCH) for x in ratios],
        why=f"Errors are what the noise of images leaves where the servo stops, at "
        f"{1e3 * STOPPED:g} mm: their ratio is that of two draws of it.",
    )


@statement("Learning makes no path longer by more than 5 %.", basis=OURS)
def way_beside_wrong(runs: Runs) -> Finding:
    """Ratios of lengths."""
    ratios = _pairs(runs, WRONG, "way_m")
    return Finding(found=_ratio_words(ratios, NO_WORSE), held=[bool(x <= NO_WORSE) for x in ratios])


@statement(
    "Learning takes no path farther from that of the true model by more than 5 %.", basis=OURS
)
def off_beside_wrong(runs: Runs) -> Finding:
    """Ratios of largest distances."""
    ratios = _pairs(runs, WRONG, "off_m")
    return Finding(found=_ratio_words(ratios, NO_WORSE), held=[bool(x <= NO_WORSE) for x in ratios])


@statement("Learning leaves cables slack for no longer by more than 5 %.", basis=OURS)
def slack_beside_wrong(runs: Runs) -> Finding:
    """Ratios of seconds."""
    ratios = _pairs(runs, WRONG, "slack_s")
    return Finding(found=_ratio_words(ratios, NO_WORSE), held=[bool(x <= NO_WORSE) for x in ratios])


@statement("Wrong measurements are doubted, good ones are not.", basis=OURS)
def doubted(runs: Runs) -> Finding:
    """Runs with doubts, flaw by flaw."""
    words, held = [], []
    for flaw, some in runs(model=LEARNT).by("flaw"):
        told = some["doubted"].astype(bool)
        words.append(f"{flaw}: {int(np.sum(told))} of {len(told)} doubted")
        held += [bool(x) == (flaw != NOTHING) for x in told]
    return Finding(found="; ".join(words), held=held)


def figure(runs: Runs) -> Figure:
    """What was learnt, and what it was worth for the path, run by run."""
    drawn, axes = new_figure(1, 3, (13.0, 4.6), "Points learnt on the way")
    some = runs(model=LEARNT, flaw=NOTHING)
    for k, (distance, each) in enumerate(some.by("distance_m")):
        look, words = nth_look(k), f"points {1e3 * distance:g} mm off"
        style = {"color": look.color, "markerfacecolor": "none", "label": words}
        marker = look.marker or "o"
        axes[0].plot(1e3 * each["before_m"], 1e3 * each["after_m"], marker, **style)
        axes[1].plot(each["seed"], each["largest_sigmas"], marker, **style)
        pairs = runs(flaw=NOTHING, distance_m=distance)
        if pairs.has(model=WRONG):
            before = {run["seed"]: run["off_m"] for run in pairs(model=WRONG)}
            points = [(before[r["seed"]], r["off_m"]) for r in each if r["seed"] in before]
            axes[2].plot(*(1e3 * np.array(points).T), marker, **style)
    axes[1].axhline(SIGMAS, color="0.4", linestyle="--", label="three standard deviations")
    for axis, what in (
        (axes[0], "rms error of points"),
        (axes[2], "farthest from true model's path"),
    ):
        end = max(axis.get_xlim()[1], axis.get_ylim()[1])
        axis.plot((0, end), (0, end), color="0.4", linestyle="--", label="equal")
        axis.set(xlabel=f"{what}, wrong model [mm]", ylabel=f"{what}, learnt [mm]")
    axes[1].set(xlabel="seed", ylabel="largest error in standard deviations [-]", ylim=(0, None))
    for axis in axes:
        axis.legend(loc="best")
    return drawn


def parameters(_form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    return {
        "scenario": SCENARIO, "distances_m": DISTANCES, "flaws": FLAWS, "too_much": TOO_MUCH,
        "no_worse": NO_WORSE, "sigmas": SIGMAS,
    }  # fmt: skip


STUDY = Study(
    name="adaptation",
    title="Exit and anchor points learnt while servoing: how well, and what it is worth",
    cases=cases,
    measure=measure,
    seeds=SEEDS,
    parameters=parameters,
    checks=(
        within,
        nearer,
        way_beside_true,
        line_beside_true,
        error_beside_true,
        way_beside_wrong,
        off_beside_wrong,
        slack_beside_wrong,
        doubted,
    ),
    tables=[
        Summary(
            "Runs by model, distance and what is wrong besides",
            ("distance_m", "model", "flaw"),
            {
                "runs": Cell("runs"),
                "final error [mm]": Cell("median", "error_m", ".3f"),
                "way [mm]": Cell("median", "way_m", ".1f"),
                "mean off the line [mm]": Cell("median", "deviation_m", ".2f"),
                "most off the true model's path [mm]": Cell("median", "off_m", ".2f"),
                "slack [s]": Cell("median", "slack_s", ".1f"),
                "points before [mm]": Cell("median", "before_m", ".2f"),
                "points after [mm]": Cell("median", "after_m", ".2f"),
                "largest in sigmas": Cell("largest", "largest_sigmas", ".2f"),
                "models rejected": Cell("total", "rejected"),
                "doubted": Cell("total", "doubted"),
            },
        )
    ],
    figures={"adaptation": figure},
)
