"""Study: servoing on textured squares without tags beside tags of the same size.

ACROBOT's approach in rendered images from starts that are drawn, on a tag and on each texture, by
three schemes: where the platform comes to rest, beside where it should be.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Check, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.texture_pictures import TEXTURES

SCENARIO = "acrobot_pbvs"
"""Its target, a tag of 60 mm, is that of all others."""

TAG = "tag"
TARGETS = (TAG, *TEXTURES)
SCHEMES = ("pbvs", "ibvs", "2.5d")

STARTS, QUICK_STARTS = 20, 1
OTHER_STARTS = 5
"""Starts of the schemes beside pose-based servoing."""

DURATION = 12.0
"""How long a run takes [s], whether it has arrived or not: by a rule that ends runs within 0.3 mm
all would end there."""

REST = 1.0
"""Time at the end over which errors are averaged [s]."""

RATE = 25.0
"""Images and rows of the log per second [Hz]."""

ARRIVED = 5e-3
"""Final distance beyond which a run counts as lost, whatever it saw [m]."""

PLACE, ANGLE = 0.03, 4.0
"""By how much starts differ from the scenario's along and about each axis [m, deg]."""

RIM = 1.25
"""Edge of a tag's plate over that of its black square, all of which must be in view."""

SEED = 11

WITHIN = 3.0
"""Times the final error with a tag that a textured square may have."""


def cases(form: Form) -> Iterator[Case]:
    """Each scheme on each target; in the quick form one scheme."""
    for scheme in SCHEMES[:1] if form.quick else SCHEMES:
        for target in TARGETS:
            yield Case(
                name=f"{scheme} {target}",
                keys={"scheme": scheme, "target": target},
                most=None if scheme == SCHEMES[0] else OTHER_STARTS,
            )


def measure(case: Case, seed: int) -> dict[str, Any]:
    """An approach from a start.

    Returns:
        final_m, final_deg: root mean square of distance and angle to where the platform should be
        at rest, from ground truth; outcome; lost: whether the target was lost for good or the goal
        not reached; without_target: images after the first in which the target was not found;
        by_features: those in which it was found by features in all of the image; start_m; curves
        distance_m, angle_rad, shape (rows,), NaN after the run's end.
    """
    scheme, target = case.keys["scheme"], case.keys["target"]
    run = run_scenario(load_scenario(SCENARIO, overrides(scheme, target, seed)))
    log, rows = run.log, round(DURATION * RATE) + 1
    curves = np.full((2, rows), np.nan)
    for curve, values in zip(curves, errors(run), strict=True):
        curve[: len(values)] = values[:rows]
    rest = log["time"] >= log["time"][-1] - REST
    distance, angle = (np.sqrt(np.mean(np.square(one[rest]))) for one in errors(run))
    seen = log["found"][:, 0] != 0.0
    features = seen & (log["quality"][:, -1] == 0.0) if "quality" in log else np.zeros(1)
    return {
        "final_m": distance,
        "final_deg": np.degrees(angle),
        "outcome": Outcome(run.outcome).name.lower(),
        "lost": bool(run.outcome != Outcome.TIMEOUT or not distance <= ARRIVED),
        "without_target": int(np.sum((np.cumsum(seen) > 0) & ~seen)),
        "by_features": int(np.sum(features)),
        "start_m": errors(run)[0][0],
        "distance_m": curves[0],
        "angle_rad": curves[1],
    }


def overrides(scheme: str, target: str, start: int) -> list[str]:
    """What differs from the scenario in a run."""
    place, angles = starts(start + 1)[start]
    texture = [] if target == TAG else ["target.kind=textured", f"target.texture={target}"]
    return [
        *texture, f"controller.scheme={scheme}", f"duration={DURATION}",
        f"stop.hold={2.0 * DURATION}", f"log_rate={RATE}", f"camera.rate={RATE}",
        "camera.region=target", "integration.engine=compiled", f"seed={start}",
        f"initial_pose.position={place.tolist()}", f"initial_pose.angles_deg={angles.tolist()}",
    ]  # fmt: skip


def errors(run: RunResult) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] of the true platform to where it should be, by row."""
    desired = run.servo.desired_platform_pose(float(run.log["time"][-1]))
    row = [*desired.rotation().ToQuaternion().wxyz(), *desired.translation()]
    count = len(run.log["time"])
    return pose_rows_distance(run.log["X_WP"], np.tile(np.array(row), (count, 1)))


@cache
def starts(count: int) -> list[tuple[Array, Array]]:
    """The first starts, positions [m] and angles [deg], from which a camera sees all of the target.

    They are the same for all targets and schemes.
    """
    servo = build_visual_servo(load_scenario(SCENARIO, ["camera.kind=projected"]))
    nominal = servo.scenario.initial_pose
    plate = TagTarget(0, RIM * servo.scenario.target.size)
    random = np.random.default_rng(SEED)
    found: list[tuple[Array, Array]] = []
    while len(found) < count:
        place = np.round(nominal.position + random.uniform(-PLACE, PLACE, 3), 4)
        angles = np.round(nominal.angles_deg + random.uniform(-ANGLE, ANGLE, 3), 2)
        X_WP: RigidTransform = Pose(position=place, angles_deg=angles).transform()
        if plate.in_view(servo.X_CO(X_WP, 0.0), servo.pinhole):
            found.append((place, angles))
    return found


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    count = form.asked_seeds or (QUICK_STARTS if form.quick else STARTS)
    drawn = [[place.tolist(), angles.tolist()] for place, angles in starts(count)]
    return {
        "scenario": SCENARIO, "duration_s": DURATION, "rest_s": REST, "rate_hz": RATE,
        "arrived_m": ARRIVED, "place_m": PLACE, "angle_deg": ANGLE, "rim": RIM, "seed": SEED,
        "within": WITHIN, "starts": drawn,
    }  # fmt: skip


def medians(runs: Runs) -> Array:
    """Median final distance [m] and angle [deg] of the runs that were not lost, shape (2,);
    infinite where all were."""
    arrived = runs(lost=False)
    if not len(arrived):
        return np.full(2, np.inf)
    return np.array([arrived.median("final_m"), arrived.median("final_deg")])


def _accuracy(scheme: str, name: str) -> Check:
    @statement(
        f"Without tags, {scheme}: final errors as with a tag of the same size.",
        f"median distance and angle at most {WITHIN:g} times",
        basis=OURS,
        name=name,
    )
    def check(runs: Runs) -> Finding:
        tag = medians(runs(scheme=scheme, target=TAG))
        ratios = {name: medians(runs(scheme=scheme, target=name)) / tag for name in TEXTURES}
        count = len(runs(scheme=scheme, target=TAG))
        words = "; ".join(f"{name} {r[0]:.2f} and {r[1]:.2f}" for name, r in ratios.items())
        return Finding(
            found=f"{words} times those of the tag, {1e3 * tag[0]:.3g} mm and {tag[1]:.3g} deg; "
            f"{count} starts",
            held=[bool(np.all(ratio <= WITHIN)) for ratio in ratios.values()],
        )

    return check


@statement(
    "Without tags no more runs lose their target or do not arrive.",
    "as many as with the tag at most",
    basis=OURS,
)
def losses(runs: Runs) -> Finding:
    """Runs that are lost, by target."""
    lost = {
        name: [runs.total("lost", scheme=scheme, target=name) for scheme in SCHEMES]
        for name in TARGETS
    }
    words = "; ".join(
        f"{name} {' + '.join(map(str, counts))} runs, "
        f"{runs.total('without_target', target=name)} images"
        for name, counts in lost.items()
    )
    return Finding(
        found=f"{words} ({' + '.join(SCHEMES)})",
        held=[sum(lost[name]) <= sum(lost[TAG]) for name in TEXTURES],
    )


def figure(runs: Runs) -> Figure:
    """Distances over time, and where runs come to rest."""
    drawn, axes = new_figure(1, 3, (16.0, 5.0), "Textured squares beside a tag")
    _draw_approach(axes[0], runs)
    for axis, column, scale, unit in (
        (axes[1], "final_m", 1e3, "mm"),
        (axes[2], "final_deg", 1.0, "deg"),
    ):
        _draw_ends(axis, runs, column, scale)
        axis.set(ylabel=f"final {'distance' if unit == 'mm' else 'angle'} [{unit}]",
                 yscale="log", title="each start, and medians")  # fmt: skip
    return drawn


def _draw_approach(axis: Axes, runs: Runs) -> None:
    """Distances over time, medians of all starts of pose-based servoing; a run that ended
    early, as its target was lost, counts as far away."""
    for k, target in enumerate(TARGETS):
        if runs.has(scheme=SCHEMES[0], target=target):
            known = np.nan_to_num(runs(scheme=SCHEMES[0], target=target)["distance_m"], nan=np.inf)
            distance = 1e3 * np.median(known, axis=0)
            times = np.arange(len(distance)) / RATE
            axis.semilogy(times, distance, label=target, **line_style(nth_look(k)))
    axis.set(xlabel="time [s]", ylabel="distance to the goal [mm]",
             title=f"{SCHEMES[0]}, medians of all starts")  # fmt: skip
    if axis.get_legend_handles_labels()[0]:
        axis.legend()


def _draw_ends(axis: Axes, runs: Runs, column: str, scale: float) -> None:
    """Final errors of all runs, side by side."""
    groups = dict(runs.by("scheme", "target"))
    for place, ((_, target), some) in enumerate(groups.items()):
        look, ends = nth_look(TARGETS.index(target)), scale * some[column]
        spread = place + np.linspace(-0.25, 0.25, len(ends)) if len(ends) > 1 else [place]
        axis.plot(spread, ends, look.marker, color=look.color, markersize=4)
        middle = scale * medians(some)[0 if column == "final_m" else 1]
        axis.plot([place - 0.35, place + 0.35], [middle] * 2, color=look.color)
    axis.set_xticks(
        range(len(groups)), [f"{scheme} {target}" for scheme, target in groups],
        rotation=60, ha="right", rotation_mode="anchor",
    )  # fmt: skip


KEPT = {"lost": False}

STUDY = Study(
    name="tagless",
    title="Servoing on textured squares without tags, beside tags of the same size",
    cases=cases,
    measure=measure,
    seeds=(STARTS, QUICK_STARTS),
    parameters=parameters,
    checks=(
        _accuracy("pbvs", "pbvs"), _accuracy("ibvs", "ibvs"), _accuracy("2.5d", "hybrid"), losses,
    ),
    tables=[
        Summary(
            "Where the platform came to rest, ground truth",
            ("scheme", "target"),
            {
                "runs": Cell("runs"),
                "lost": Cell("total", "lost"),
                "median [mm]": Cell("median", "final_m", ".4f", KEPT),
                "worst [mm]": Cell("largest", "final_m", ".4f"),
                "median [deg]": Cell("median", "final_deg", ".4f", KEPT),
                "worst [deg]": Cell("largest", "final_deg", ".4f"),
                "images without": Cell("total", "without_target"),
            },
        )
    ],
    figures={"tagless": figure},
)  # fmt: skip
