"""What the compiled engine has to show beside the plant, and whether it does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.analyses.studies.engines.pairs import ENERGY_STEPS, METHODS
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.arrays import Array

TAUT_DISTANCE, TAUT_ANGLE = 1e-6, 1e-6
"""How far engines may part in ten seconds with taut cables [m, rad]; both take steps of the same
length, but not at the same times."""

TAUT_ENERGY = 1e-5
"""By how much their energies may differ, over that which lifts the platform by the motion."""

SAME_TIME = 0.04 + 1e-9
"""Runs that converge may end a frame of the camera apart [s]."""

SAME_END = 5e-5
"""How much further from its goal one run may end than the other [m]: a sixth of the 0.3 mm at which
ACROBOT counts as arrived. Winches stand still then, but friction, noise and the frame remain."""

CATCHING_END = 1e-5
"""The same for runs with impacts, which all come to rest [m]."""

METHOD_ORDERS = {"runge_kutta2": 2.0, "runge_kutta3": 3.0, "semi_implicit": 2.0}
LEAST_ORDER = 0.35
"""By how much a measured order may be below the method's, cables taut."""

CATCHING_ORDER = 1.0
"""Least order where cables catch: their law has a kink there."""

ENERGY_GAIN = 0.01
"""Largest gain of energy by impacts at the largest step, over that of the fall: five seconds."""

ENERGY_LOSS = 0.02
"""Largest loss at the smallest step."""


@statement(
    "While cables stay taut the engines take the same path.",
    f"{TAUT_DISTANCE:g} m, {TAUT_ANGLE:g} rad, energy {TAUT_ENERGY:g} in 10 s",
    basis=OURS,
    rule="the largest of all robots that are drawn, no cable of which goes slack",
)
def taut(runs: Runs) -> Finding:
    """Robots that are drawn, on slow loops."""
    some = runs(kind="taut")
    distance, angle, energy = (
        some.largest(name) for name in ("distance_m", "angle_rad", "energy_difference")
    )
    least = some.smallest("least_tension_n")
    good = [distance <= TAUT_DISTANCE, angle <= TAUT_ANGLE, energy <= TAUT_ENERGY]
    return Finding(
        found=f"{distance:.2g} m, {angle:.2g} rad, energy {energy:.2g}; {len(some)} robots that "
        f"were drawn, tensions from {least:.2g} N",
        held=[*good, least > 0.0],
        some=all(good),
    )


@statement(
    "Every scenario that ships ends the same way, at the same time, as near to its goal.",
    f"all, {SAME_END:g} m",
    basis=OURS,
    rule=f"the outcome, the time within {SAME_TIME:g} s, the error within {SAME_END:g} m",
)
def shipped(runs: Runs) -> Finding:
    """Scenarios."""
    some = runs(kind="scenario")
    time = np.abs(some["time_plant_s"] - some["time_compiled_s"])
    ends = _ends(some)
    good = _same_outcome(some) & (time <= SAME_TIME) & (ends <= SAME_END)
    worst = some.list("scenario")[int(np.argmax(ends))]
    return Finding(
        found=f"{int(np.sum(good))} of {len(some)}; at most {np.max(ends):.2g} m, {worst}; paths "
        f"part by up to {1e3 * some.largest('distance_m'):.2g} mm while cables catch",
        held=good.tolist(),
    )


@statement(
    "With cables that go slack and catch, a servo has the same outcome and final error.",
    f"all, {CATCHING_END:g} m",
    basis=OURS,
    rule=f"the outcome, the error within {CATCHING_END:g} m",
)
def impacts(runs: Runs) -> Finding:
    """Servos with cables paid out."""
    some = runs(kind="impacts")
    ends = _ends(some)
    good = _same_outcome(some) & (ends <= CATCHING_END)
    return Finding(
        found=f"{int(np.sum(good))} of {len(some)} "
        f"({', '.join(sorted(some.counts('outcome_plant')))}), at most {np.max(ends):.2g} m; "
        f"paths part by up to {some.largest('distance_m'):.2g} m",
        held=good.tolist(),
    )


def _ends(runs: Runs) -> Array:
    """How much further from its goal one engine ends than the other, shape (n,) [m]."""
    return np.asarray(np.abs(runs["final_error_plant_m"] - runs["final_error_compiled_m"]))


def _same_outcome(runs: Runs) -> Array:
    return np.asarray(runs["outcome_plant"] == runs["outcome_compiled"])


@statement(
    "Methods have their orders against the plant at a small step, cables taut.",
    ", ".join(f"{m} {METHOD_ORDERS[m]:g}" for m in METHODS),
    basis=OURS,
    rule=f"at most {LEAST_ORDER:g} below",
)
def orders(runs: Runs) -> Finding:
    """Taut cables."""
    measured = runs.one(order="taut")["orders"]
    return Finding(
        found=_by_method(measured),
        held=[measured[m] >= METHOD_ORDERS[m] - LEAST_ORDER for m in METHODS],
    )


@statement(
    "How far they part at impacts shrinks with the step, at least in proportion.",
    f"orders of at least {CATCHING_ORDER:g}",
    basis=OURS,
    rule="by all methods, on soft cables and on real ones",
)
def impact_steps(runs: Runs) -> Finding:
    """Cables that catch."""
    measured = {
        words: runs.one(order=name)["orders"]
        for words, name in (("soft", "catching"), ("real", "catching real"))
    }
    return Finding(
        found="; ".join(f"{name} cables: {_by_method(each)}" for name, each in measured.items()),
        held=[min(each.values()) >= CATCHING_ORDER for each in measured.values()],
        why="On real cables the first impacts only: what comes later is chaotic, and half the step "
        "gives another path by either engine.",
    )


def _by_method(orders: Mapping[str, float]) -> str:
    return ", ".join(f"{m} {orders[m]:.2f}" for m in METHODS)


@statement(
    "At real stiffness, undamped, with slack cables, impacts put no energy in.",
    f"at most {ENERGY_GAIN:g} of the fall's; lost at the smallest step at most {ENERGY_LOSS:g}",
    basis=OURS,
    rule="by explicit and semi-implicit methods at all steps; cables were slack",
)
def energy(runs: Runs) -> Finding:
    """A robot that bounces."""
    some = runs(step_s=ENERGY_STEPS)
    gain, semi = some.largest("largest_gain"), some.largest("semi_implicit_gain")
    loss = runs.one(step_s=ENERGY_STEPS[-1])["least_gain"]
    slack = some.largest("slack_cables")
    return Finding(
        found=f"explicit {gain:.2g}, semi-implicit {semi:.2g}; lost {-loss:.2g}; up to "
        f"{slack:.0f} cables slack",
        held=[gain <= ENERGY_GAIN, -loss <= ENERGY_LOSS, semi <= ENERGY_GAIN, slack > 0],
        some=gain <= ENERGY_GAIN,
    )


CHECKS = (taut, shipped, impacts, orders, impact_steps, energy)
"""All of them."""
