"""Study: what a lens costs a visual servo, known, ignored, and beside other wrong intrinsics.

ACROBOT's approach with a projected camera, through a pinhole, a barrel lens and a fisheye, by three
schemes: where the platform comes to rest, beside where it should be, by ground truth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.palette import nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.vision.target import PointTarget

SCENARIO = "acrobot_pbvs"
SCHEMES = ("pbvs", "ibvs", "2.5d")
SEEDS, QUICK_SEEDS = 6, 1

DURATION = 12.0
"""How long a run takes [s], whether it has arrived or not."""

REST = 2.0
"""Time at the end over which errors are averaged [s]."""

BARREL = "camera.distortion={kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}"
"""Of a wide lens: at the corners of the image a twelfth of the radius is missing."""

FISHEYE = "camera.distortion={kind: fisheye, k1: -0.02, k2: 0.005}"
IGNORED = "perturbations.camera_distortion={kind: none}"
HALF = "perturbations.camera_distortion={kind: brown_conrady, k1: -0.125, k2: 0.03}"

VARIANTS: dict[str, tuple[str, ...]] = {
    "ideal": (),
    "barrel, known": (BARREL,),
    "fisheye, known": (FISHEYE,),
    "barrel, half known": (BARREL, HALF),
    "barrel, ignored": (BARREL, IGNORED),
    "fisheye, ignored": (FISHEYE, IGNORED),
    "principal point 5 px off": ("perturbations.image_bias=[4, -3]",),
}
"""What differs from the scenario, by name."""

KNOWN, UNKNOWN = ("barrel, known", "fisheye, known"), ("barrel, ignored", "fisheye, ignored")

MOST_COST = 1.1
"""Times the final error without a lens that a known lens may cost."""

MOST_BEYOND = 1.02
"""Times what noise costs that a known lens may cost."""

PIXEL_STEP = 0.01
"""Of derivatives [px]."""

SHOWS = 5.0
"""Times that error from which on an ignored lens counts as seen."""


def cases(form: Form) -> Iterator[Case]:
    """Each scheme with each lens; in the quick form one scheme."""
    for scheme in SCHEMES[:1] if form.quick else SCHEMES:
        for variant in VARIANTS:
            yield Case(name=f"{scheme} {variant}", keys={"scheme": scheme, "lens": variant})


def measure(case: Case, seed: int) -> dict[str, Any]:
    """An approach with noise of its own.

    Returns:
        final_m, final_deg: root mean square of distance and angle to where the platform should be
        at rest, from ground truth; outcome; lost: whether the target was lost; noise_cost: see
        `noise_cost`.
    """
    scheme, variant = case.keys["scheme"], case.keys["lens"]
    run = run_scenario(
        load_scenario(SCENARIO, [
            f"controller.scheme={scheme}", *VARIANTS[variant], f"seed={seed}",
            f"duration={DURATION}", f"stop.hold={2.0 * DURATION}", "camera.kind=projected",
            "integration.engine=compiled", "integration.loop=compiled", "log_rate=25",
        ])
    )  # fmt: skip
    goal = run.servo.desired_platform_pose()
    rest = run.log["time"] >= run.log["time"][-1] - REST
    errors = [pose_error(pose_from_row(row), goal) for row in run.log["X_WP"][rest]]
    distance, angle = np.sqrt(np.mean(np.square(errors), axis=0))
    return {
        "final_m": float(distance),
        "final_deg": float(np.degrees(angle)),
        "outcome": Outcome(run.outcome).name.lower(),
        "lost": bool(run.outcome != Outcome.TIMEOUT),
        "noise_cost": noise_cost(run.servo),
    }


def noise_cost(servo: ServoModel) -> float:
    """Standard deviation of the camera's place before the target as desired, by the same noise of
    pixels, over that without a lens [-].

    A lens that shows a wider field has less of it in a pixel.
    """
    target = servo.target
    assert isinstance(target, PointTarget)
    deviations = []
    for camera in (replace(servo.pinhole, believed=None), servo.pinhole.ideal):
        marks = camera.project(servo.X_CdO @ target.points)
        total = 0.0
        for k in range(marks.size):
            ends = []
            for step in (PIXEL_STEP, -PIXEL_STEP):
                moved = marks.copy()
                moved.flat[k] += step
                X_CO = target.solve(camera.read(moved).T.ravel(), camera.ideal)
                assert X_CO is not None
                ends.append(X_CO.inverse().translation())
            total += float(np.sum(((ends[0] - ends[1]) / (2.0 * PIXEL_STEP)) ** 2))
        deviations.append(np.sqrt(total))
    return float(deviations[0] / deviations[1])


def _ratios(runs: Runs, variants: tuple[str, ...]) -> dict[str, float]:
    """Root mean squares of final distances over those without a lens, by scheme and variant."""
    found: dict[str, float] = {}
    for scheme in SCHEMES:
        if runs.has(scheme=scheme, lens="ideal"):
            ideal = _rms(runs, scheme, "ideal")
            found |= {f"{scheme} {one}": _rms(runs, scheme, one) / ideal for one in variants}
    return found


def _rms(runs: Runs, scheme: str, variant: str) -> float:
    values = runs(scheme=scheme, lens=variant)["final_m"]
    return float(np.sqrt(np.mean(np.square(values))))


@statement(
    "A known lens costs the servo little accuracy.",
    "",
    rule=f"final distance at most {MOST_COST:g} times that without a lens, mean of squares",
    basis=OURS,
)
def known(runs: Runs) -> Finding:
    """Ratios of final distances with a known lens to those without."""
    ratios = _ratios(runs, KNOWN)
    return Finding(
        found=", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios.items()),
        held=[ratio <= MOST_COST for ratio in ratios.values()],
        why="A lens with the same scale on its axis shows a wider field, and so less of it in a "
        "pixel: the same noise of pixels is more in space.",
    )


@statement(
    "What a known lens costs is the noise of its pixels, which show more of the scene.",
    "",
    rule=f"final distance at most {MOST_BEYOND:g} times what the same noise of pixels makes of it",
    basis=OURS,
)
def noise(runs: Runs) -> Finding:
    """Ratios of final distances over what noise alone costs."""
    held, words = [], []
    for name, ratio in _ratios(runs, KNOWN).items():
        scheme, lens = name.split(" ", 1)
        cost = float(np.mean(runs(scheme=scheme, lens=lens)["noise_cost"]))
        held.append(ratio <= MOST_BEYOND * cost)
        words.append(f"{name} {ratio:.3f} where noise costs {cost:.3f}")
    return Finding(found=", ".join(words), held=held)


@statement(
    "A lens that is ignored shows in where the platform comes to rest.",
    "",
    rule=f"final distance at least {SHOWS:g} times that without a lens",
    basis=OURS,
)
def ignored(runs: Runs) -> Finding:
    """Ratios and distances with an ignored lens."""
    ratios = _ratios(runs, UNKNOWN)
    return Finding(
        found=", ".join(f"{name} {ratio:.1f} times" for name, ratio in ratios.items()),
        held=[ratio >= SHOWS for ratio in ratios.values()],
    )


def figure(runs: Runs) -> Figure:
    """Final distances by lens and scheme."""
    drawn, axes = new_figure(1, 1, (11.0, 5.0), "What a lens costs a visual servo")
    schemes = [scheme for scheme in SCHEMES if runs.has(scheme=scheme, lens="ideal")]
    places = np.arange(len(VARIANTS))
    for k, scheme in enumerate(schemes):
        heights = [1e3 * _rms(runs, scheme, variant) for variant in VARIANTS]
        offset = (k - 0.5 * (len(schemes) - 1)) * 0.25
        axes.bar(places + offset, heights, 0.25, label=scheme, **bar_style(nth_look(k)))
    axes.set_xticks(places, list(VARIANTS), rotation=20, ha="right")
    axes.set(yscale="log", ylabel="final distance [mm]", title="root mean square at rest")
    axes.legend()
    return drawn


STUDY = Study(
    name="lenses",
    title="What a lens costs a visual servo, known and ignored",
    cases=cases,
    measure=measure,
    seeds=(SEEDS, QUICK_SEEDS),
    checks=(known, noise, ignored),
    tables=[
        Summary(
            "Where the platform came to rest, ground truth",
            ("scheme", "lens"),
            {
                "runs": Cell("runs"),
                "lost": Cell("total", "lost"),
                "mean [mm]": Cell("mean", "final_m", ".4f"),
                "worst [mm]": Cell("largest", "final_m", ".4f"),
                "mean [deg]": Cell("mean", "final_deg", ".4f"),
            },
        )
    ],
    figures={"lenses": figure},
)
