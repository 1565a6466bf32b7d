"""What the compiled engine has to show beside the plant, and whether it does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.engines.pairs import COLUMNS, METHODS
from cdpr_drake.arrays import Array
from cdpr_drake.systems.monitoring.run_monitor import Outcome

Arrays = Mapping[str, Mapping[str, Array]]

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

ORDERS = {"runge_kutta2": 2.0, "runge_kutta3": 3.0, "semi_implicit": 2.0}
LEAST_ORDER = 0.35
"""By how much a measured order may be below the method's, cables taut."""

CATCHING_ORDER = 1.0
"""Least order where cables catch: their law has a kink there."""

ENERGY_GAIN = 0.01
"""Largest gain of energy by impacts at the largest step, over that of the fall: five seconds."""

ENERGY_LOSS = 0.02
"""Largest loss at the smallest step."""


def column(pairs: Array, name: str) -> Array:
    """A column of pairs of runs, shape (n,)."""
    return np.asarray(pairs[:, COLUMNS.index(name)])


def orders(distance: Array) -> Array:
    """Orders of convergence between the first step and the last, by method, shape (3,).

    Args:
        distance: Errors by step, each half of the one before, and method, shape (n, 3).
    """
    return np.asarray(np.log2(distance[0] / distance[-1]) / (len(distance) - 1), float)


def scenario_names_in(found: Arrays) -> list[str]:
    """Names of the scenarios that were run."""
    return [name.removeprefix("scenario ") for name in found if name.startswith("scenario ")]


def _taut(found: Arrays) -> Statement:
    taut = found["taut motions"]["taut"]
    distance, angle, energy = (float(np.max(taut[:, k])) for k in range(3))
    held = float(np.min(taut[:, 3]))
    good = distance <= TAUT_DISTANCE and angle <= TAUT_ANGLE and energy <= TAUT_ENERGY
    return Statement(
        "While cables stay taut the engines take the same path.",
        f"{TAUT_DISTANCE:g} m, {TAUT_ANGLE:g} rad, energy {TAUT_ENERGY:g} in 10 s",
        f"{distance:.2g} m, {angle:.2g} rad, energy {energy:.2g}; {len(taut)} robots that were "
        f"drawn, tensions from {held:.2g} N",
        verdict(good and held > 0.0, good),
    )


def _shipped(found: Arrays) -> Statement:
    names = scenario_names_in(found)
    pairs = np.array([found[f"scenario {name}"]["pairs"][0] for name in names])
    if not names:
        raise KeyError("scenarios")
    same = column(pairs, "outcome_plant") == column(pairs, "outcome_compiled")
    time = np.abs(column(pairs, "time_plant_s") - column(pairs, "time_compiled_s"))
    ends = np.abs(column(pairs, "final_error_plant_m") - column(pairs, "final_error_compiled_m"))
    good = same & (time <= SAME_TIME) & (ends <= SAME_END)
    worst = names[int(np.argmax(ends))]
    return Statement(
        "Every scenario that ships ends the same way, at the same time, as near to its goal.",
        f"all, {SAME_END:g} m",
        f"{int(np.sum(good))} of {len(names)}; at most {np.max(ends):.2g} m, {worst}; paths part "
        f"by up to {1e3 * np.max(column(pairs, 'distance_m')):.2g} mm while cables catch",
        verdict(bool(np.all(good)), bool(np.any(good))),
    )


def _impacts(found: Arrays) -> Statement:
    pairs = found["impacts"]["pairs"]
    same = column(pairs, "outcome_plant") == column(pairs, "outcome_compiled")
    ends = np.abs(column(pairs, "final_error_plant_m") - column(pairs, "final_error_compiled_m"))
    good = same & (ends <= CATCHING_END)
    names = {Outcome(int(code)).name.lower() for code in np.unique(column(pairs, "outcome_plant"))}
    return Statement(
        "With cables that go slack and catch, a servo has the same outcome and final error.",
        f"all, {CATCHING_END:g} m",
        f"{int(np.sum(good))} of {len(pairs)} ({', '.join(sorted(names))}), at most "
        f"{np.max(ends):.2g} m; paths part by up to {np.max(column(pairs, 'distance_m')):.2g} m",
        verdict(bool(np.all(good)), bool(np.any(good))),
    )


def _orders(found: Arrays) -> Statement:
    measured = orders(found["order taut"]["distance"][0])
    good = [p >= ORDERS[m] - LEAST_ORDER for p, m in zip(measured, METHODS, strict=True)]
    return Statement(
        "Methods have their orders against the plant at a small step, cables taut.",
        ", ".join(f"{m} {ORDERS[m]:g}" for m in METHODS),
        _by_method(measured, ".2f"),
        verdict(all(good), any(good)),
    )


def _impact_steps(found: Arrays) -> Statement:
    parts = {"soft": found["order catching"], "real": found["order catching real"]}
    measured = {name: orders(arrays["distance"][0]) for name, arrays in parts.items()}
    good = [bool(np.all(each >= CATCHING_ORDER)) for each in measured.values()]
    return Statement(
        "How far they part at impacts shrinks with the step, at least in proportion.",
        f"orders of at least {CATCHING_ORDER:g}",
        "; ".join(f"{name} cables: {_by_method(each, '.2f')}" for name, each in measured.items()),
        verdict(all(good), any(good)),
        "On real cables the first impacts only: what comes later is chaotic, and half the step "
        "gives another path by either engine.",
    )


def _by_method(values: Array, form: str) -> str:
    return ", ".join(f"{m} {x:{form}}" for m, x in zip(METHODS, values, strict=True))


def _energy(found: Arrays) -> Statement:
    rows = found["energy"]["energy"]
    gain, loss, semi = np.max(rows[:, 0]), float(np.min(rows[-1:, 1])), np.max(rows[:, 2])
    good = gain <= ENERGY_GAIN and -loss <= ENERGY_LOSS and semi <= ENERGY_GAIN
    return Statement(
        "At real stiffness, undamped, with slack cables, impacts put no energy in.",
        f"at most {ENERGY_GAIN:g} of the fall's; lost at the smallest step at most {ENERGY_LOSS:g}",
        f"explicit {gain:.2g}, semi-implicit {semi:.2g}; lost {-loss:.2g}; up to "
        f"{int(np.max(rows[:, 3]))} cables slack",
        verdict(bool(good and np.max(rows[:, 3]) > 0.0), bool(gain <= ENERGY_GAIN)),
    )


CHECKS = (_taut, _shipped, _impacts, _orders, _impact_steps, _energy)
"""All of them."""


def engine_statements(found: Arrays, quick: bool = False) -> list[Statement]:
    """What holds, of all that was run.

    Args:
        found: Arrays of the finished tasks, by the names that `study_engines` gives them.
        quick: Whether they are all that is coming, of the quick form.
    """
    return evaluate_checks(CHECKS, found, quick)
