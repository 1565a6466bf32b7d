"""Study: the cycle of slack in which stiff cables can leave a visual servo, and where it begins.

A controller that knows no pulleys winds cables in and out by lengths that do not fit together. At
the goal some cables are left nearly without tension, and the platform can swing where they held it.
The servo integrates what the camera sees, so it feeds that swing. With x the small displacement of
the platform from its goal (turn, translation), q what the controller believes to have commanded,
and dl = J_c q the lengths that it winds by its Jacobian J_c, about the rest that the servo seeks

    M x'' + (D + C) x' + K x = B dl + B_t dl',      q' = -lambda x(t_k)  for t_k <= t < t_k + T_s,

with the stiffness K, the damping C of the cables' material and that of the platform D, and the
wrenches B, B_t per length and per length's rate, all of the cables' model at that rest. From sample
to sample the state (x, x', q) is multiplied by a constant matrix Phi(lambda, D, T_s). **The servo
comes to rest where the spectral radius of Phi is below 1, and else cycles:** growth ends where a
gain that adapts to the error falls, or where cables that were slack become taut. For one mode of
circular frequency omega that follows its commands, small rates of growth are about

    lambda / 2 cos(omega T_s / 2) - (D / m + T omega^2) / 2,

so that the cycle begins at lambda cos(omega T_s / 2) > D / m + T omega^2: taut cables are fast, and
their retardation time T damps them; slack makes one mode slow, which T does not reach any more.

The rest is found by statics: the belief from which the straight model's lengths put the platform at
its goal. Nothing is fitted, and the grid was set before a run of it was looked at.

Scenario: approach of section 2.3.4 of the servoing thesis, whose gain grows from 0.1 1/s far away
to lambda at the goal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import scipy.linalg
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import cable_derivatives, cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.stiffness import natural_modes
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "caroca_pbvs"

CABLES: dict[str, str] = {
    "stiff": "cables={model: kelvin_voigt, pulleys: true}",
    "soft": "cables={model: kelvin_voigt, pulleys: true, stiffness_ratio: 0.05}",
    "sagging": "cables={pulleys: true, model: catenary}",
    "matched": "cables={model: kelvin_voigt, pulleys: false}",
}
"""The simulated cables by name: massless of steel, massless of a twentieth of its stiffness, heavy
ones that sag; and massless of steel without the pulleys that the controller does not know."""

MATCHED = "matched"

TITLES = {
    "stiff": "stiff: massless steel",
    "soft": "soft: massless, a twentieth of steel's stiffness",
    "sagging": "sagging: steel with its weight",
    "matched": "matched: massless steel, no pulleys",
}
"""The same in words."""

DAMPINGS = (40.0, 110.0, 180.0, 250.0, 320.0)
GAINS = (0.75, 1.5, 2.25)
"""The grid: damping of the platform [N s/m], gain lambda at the goal [1/s]."""

QUICK = ((40.0, 1.5), (320.0, 0.75))
"""Points of the quick form."""

GYRATION = 0.0184
"""Damping of turns per that of translations: mean moment of inertia about the centre of mass, per
mass [m^2]."""

DURATION, WINDOW = 80.0, 15.0
"""How long a run takes, and its end in which it is looked at [s]."""

CYCLE = 1e-3
"""Amplitude from which a run cycles: the scenario's distance at which a servo has arrived [m]."""

AGREE = 0.9
"""Share of the points at which prediction and run have to agree."""

SAME_HZ = 0.2
"""Relative difference up to which frequencies are the same."""

SETTLED = 1e-7
"""Within this of its goal the platform rests there [m, rad]."""


@dataclass(frozen=True, eq=False)
class Rest:
    """The platform at rest at its goal, on lengths that a controller with another model wound.

    Attributes:
        robot: The robot.
        cables: Its cables as simulated.
        model: Their model.
        X_WP: Pose of the platform.
        X_believed: Where the controller believes it to be.
        l0: Unstrained lengths, shape (m,) [m].
    """

    robot: Robot
    cables: CableSet
    model: str
    X_WP: RigidTransform
    X_believed: RigidTransform
    l0: Array


def rest_at_goal(
    robot: Robot, cables: CableSet, model: str, start: RigidTransform, goal: RigidTransform
) -> Rest:
    """Where a servo comes to rest that integrates lengths of straight cables without pulleys.

    The belief is moved by what the platform is away from its goal, as a slow servo does.

    Raises:
        RuntimeError: That does not end at the goal.
    """
    held = hold_robot(robot, start, cables, model)
    straight, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    first = cable_paths(start, straight).lengths
    believed, guess = goal, goal
    for _ in range(100):
        l0 = held.unstrained_lengths + cable_paths(believed, straight).lengths - first
        X_WP = equilibrium_near(cables, model, platform, l0, guess, soften=True).X_WP
        turn = rotation_vector(goal.rotation() @ X_WP.rotation().inverse())
        away = goal.translation() - X_WP.translation()
        if np.hypot(np.linalg.norm(turn), np.linalg.norm(away)) < SETTLED:
            return Rest(robot, cables, model, X_WP, believed, l0)
        R = believed.rotation().matrix() @ X_WP.rotation().matrix().T
        believed = RigidTransform(
            rotation_from_vector(R @ turn) @ believed.rotation(), believed.translation() + R @ away
        )
        guess = X_WP
    raise RuntimeError(f"{robot.name}: no lengths of straight cables put it at its goal")


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """The servo about its rest, without the platform's damping and the gain.

    Attributes:
        M: Inertia, shape (6, 6).
        K: Stiffness, shape (6, 6).
        C: Damping of the cables, shape (6, 6).
        per_command: Wrench per q, shape (6, 6).
        per_rate: Wrench per q', shape (6, 6).
        slowest_hz: Lowest natural frequency [Hz].
    """

    M: Array
    K: Array
    C: Array
    per_command: Array
    per_rate: Array
    slowest_hz: float

    def growth(self, damping: float, gain: float, rate: float) -> complex:
        """Fastest growing pole of the sampled loop, log(z) / T_s with |z| the spectral radius of
        Phi [1/s].

        Args:
            damping: Of the platform [N s/m].
            gain: lambda [1/s].
            rate: Samples per second [Hz].
        """
        D = np.diag([damping * GYRATION] * 3 + [damping] * 3)
        A, inverse = np.zeros((24, 24)), np.linalg.inv(self.M)
        A[:6, 6:12] = np.eye(6)
        A[6:12] = inverse @ np.hstack([-self.K, -self.C - D, self.per_command, self.per_rate])
        A[12:18, 18:] = np.eye(6)
        E = scipy.linalg.expm(A / rate)
        step = E[:18, :18].copy()
        step[:, :6] -= gain * E[:18, 18:]
        poles = np.linalg.eigvals(step)
        return complex(np.log(complex(poles[np.argmax(np.abs(poles))])) * rate)

    def boundary(self, gain: float, rate: float, most: float = 1e4) -> float:
        """Damping from which the servo comes to rest [N s/m]; 0 where it needs none."""
        low, high = 0.0, most
        if self.growth(low, gain, rate).real < 0.0:
            return low
        while high - low > 0.1:
            middle = 0.5 * (low + high)
            grows = self.growth(middle, gain, rate).real > 0.0
            low, high = (middle, high) if grows else (low, middle)
        return high


def linear_loop(rest: Rest) -> LinearLoop:
    """The servo about a rest; of straight cables, slack ones do not count."""
    robot, X_WP, cables = rest.robot, rest.X_WP, rest.cables
    change = cable_derivatives(cables, rest.model, X_WP, rest.l0)
    state = cable_state(cables, rest.model, X_WP, rest.l0)
    R = X_WP.rotation().matrix()
    turned, platform = np.kron(np.eye(2), R), rigid_platform(robot)
    # Wrench of each cable per tension, and what the damping adds to its tension.
    pulls = state.forces / np.where(state.tensions > 0.0, state.tensions, 1.0)
    W = np.vstack([np.cross((R @ cables.p_PB).T, pulls.T).T, pulls])
    T = cables.retardation
    K = platform.weight_stiffness(X_WP) - change.wrench_by_pose
    # The controller's twist in the platform's frame, turned into the frame that it believes in.
    R_believed = rest.X_believed.rotation().matrix() @ R.T
    straight = robot.cable_set().without_pulleys()
    J_c = cable_paths(rest.X_believed, straight).J @ np.kron(np.eye(2), R_believed)
    return LinearLoop(
        M=turned @ platform_inertia(robot).CopyToFullMatrix6() @ turned.T,
        K=K,
        C=-W @ (T[:, np.newaxis] * change.tensions_by_pose),
        per_command=change.wrench_by_length @ J_c,
        per_rate=W @ ((T * change.tensions_by_length)[:, np.newaxis] * J_c),
        slowest_hz=float(natural_modes(K, platform, X_WP).frequencies[0]),
    )


@cache
def loop_of(cables: str) -> LinearLoop:
    """The scenario's loop with cables of a name."""
    scenario = load_scenario(SCENARIO, overrides(cables, DAMPINGS[0], GAINS[0]))
    robot = load_robot(scenario.robot)
    start = scenario.initial_pose.transform()
    goal = servo_model(scenario, robot).desired_platform_pose()
    simulated = scenario.cables.cable_set(robot)
    model = scenario.cables.model_of(robot)
    return linear_loop(rest_at_goal(robot, simulated, model, start, goal))


def overrides(cables: str, damping: float, gain: float) -> list[str]:
    """What differs from the scenario in a run, which goes on when it has arrived."""
    return [
        CABLES[cables], f"damping={{translation: {damping:g}, rotation: {damping * GYRATION:g}}}",
        f"controller.lambda_0={gain:g}", f"duration={DURATION:g}", f"stop.hold={2.0 * DURATION:g}",
        "camera.kind=projected",
    ]  # fmt: skip


def cases(form: Form) -> Iterator[Case]:
    """The grid for all cables."""
    points = QUICK if form.quick else product(DAMPINGS, GAINS)
    for damping, gain in points:
        for cables in CABLES:
            yield Case(
                name=f"{cables} {damping:g} {gain:g}",
                keys={"cables": cables, "damping": damping, "gain": gain},
            )


def measure(case: Case, _seed: int) -> dict[str, Any]:
    """A run, and what the linear loop says of it.

    Returns:
        outcome; amplitude_m, that of a sine with the platform's root mean square distance from its
        line over the last `WINDOW`; frequency_hz, where its spectrum is largest; slack, share of
        that time in which a cable is; cycles; growth, real part of the fastest pole [1/s], and
        pole_hz, its frequency; predicted; formula, whether the one mode's formula predicts a cycle.
    """
    cables, damping, gain = (case.keys[key] for key in ("cables", "damping", "gain"))
    scenario = choose_compiled_loop(load_scenario(SCENARIO, overrides(cables, damping, gain)))
    run = run_scenario(scenario)
    late = run.log["time"] >= run.log["time"][-1] - WINDOW
    amplitude, frequency = swing(run.log["X_WP"][late, 4:], 1.0 / scenario.log_rate)
    loop, rate = loop_of(cables), scenario.controller.rate
    pole = loop.growth(damping, gain, rate)
    robot = load_robot(scenario.robot)
    omega, T = 2.0 * np.pi * loop.slowest_hz, robot.cable.retardation_time
    damped = damping / robot.platform.mass + T * omega**2
    arrived = run.outcome == Outcome.TIMEOUT
    return {
        "outcome": Outcome(run.outcome).name.lower(),
        "amplitude_m": amplitude,
        "frequency_hz": frequency,
        "slack": float(np.mean(np.any(run.log["slack"][late] > 0.0, axis=1))),
        "cycles": bool(not arrived or amplitude > CYCLE),
        "growth": pole.real,
        "pole_hz": abs(pole.imag) / (2.0 * np.pi),
        "slowest_hz": loop.slowest_hz,
        "predicted": bool(pole.real > 0.0),
        "formula": bool(gain * np.cos(0.5 * omega / rate) > damped),
    }


def swing(path: Array, step: float) -> tuple[float, float]:
    """Amplitude [m] and frequency [Hz] of a swing.

    Args:
        path: Positions, equally spaced in time, shape (n, 3) [m].
        step: Their distance in time [s].
    """
    times = np.arange(len(path)) - 0.5 * (len(path) - 1)
    line = np.polynomial.polynomial.polyfit(times, path, 1)
    rest = path - line[0] - times[:, np.newaxis] * line[1]
    power = np.sum(np.abs(np.fft.rfft(rest * np.hanning(len(path))[:, np.newaxis], axis=0)) ** 2, 1)
    return (
        float(np.sqrt(2.0 * np.mean(np.sum(rest**2, axis=1)))),
        float(np.fft.rfftfreq(len(path), step)[np.argmax(power)]),
    )


def _counts(runs: Runs, column: str) -> tuple[str, float]:
    """Confusion counts of a prediction in words, and the share of points that agree.

    Raises:
        MissingRuns: There are no points.
    """
    if not len(runs):
        raise MissingRuns("all")
    cycles, said = runs["cycles"], runs[column]
    both, neither = int(np.sum(cycles & said)), int(np.sum(~cycles & ~said))
    false, missed = int(np.sum(~cycles & said)), int(np.sum(cycles & ~said))
    words = (
        f"{both} cycle as predicted, {neither} rest as predicted, {false} rest against it, "
        f"{missed} cycle against it"
    )
    return words, (both + neither) / len(runs)


@statement(
    "The spectral radius of the linear sampled loop says where the servo cycles.",
    f"at {100.0 * AGREE:.0f} % of the points of each kind of cables",
    basis=OURS,
    rule="All points count, those at the boundary too",
)
def boundary(runs: Runs) -> Finding:
    """Predicted and simulated outcomes."""
    found = {name: _counts(runs(cables=name), "predicted") for name in CABLES}
    return Finding(
        found="; ".join(
            f"{name}: {words} ({_amplitudes(runs(cables=name))})"
            for name, (words, _) in found.items()
        ),
        held=[share >= AGREE for _, share in found.values()],
        why="The loop is linear about its rest, the cables are not; close to the boundary swings "
        f"grow or decay by less than they can show in {DURATION:g} s. Of stiff cables amplitudes "
        "on both sides are close: noise alone moves the platform nearly so far, and the cable that "
        "is just taut there keeps the loop linear for micrometres only.",
    )


def _amplitudes(runs: Runs) -> str:
    """Words for how far apart the amplitudes of runs that cycle and that rest are."""
    cycles, amplitude = runs["cycles"], 1e3 * runs["amplitude_m"]
    parts = []
    if np.any(cycles):
        parts.append(f"cycles of {np.min(amplitude[cycles]):.2f} mm or more")
    if not np.all(cycles):
        parts.append(f"rest within {np.max(amplitude[~cycles]):.2f} mm")
    return ", ".join(parts)


@statement(
    "So does the formula of one mode, lambda cos(omega T_s / 2) > D / m + T omega^2.",
    f"at {100.0 * AGREE:.0f} % of all points",
    basis=OURS,
)
def formula(runs: Runs) -> Finding:
    """The formula alone, from the slowest natural frequency."""
    words, share = _counts(runs, "formula")
    slowest = {name: runs.mean("slowest_hz", cables=name) for name in CABLES}
    return Finding(
        found=f"{words}; slowest mode "
        + ", ".join(f"{name} {value:.2f} Hz" for name, value in slowest.items()),
        held=[share >= AGREE],
    )


@statement("A servo whose model has the robot's cables never cycles.", basis=OURS)
def matched(runs: Runs) -> Finding:
    """Without the pulleys that the controller does not know."""
    some = runs(cables=MATCHED)
    return Finding(
        found=f"{some.total('cycles')} of {len(some)} cycle; cables slack in "
        f"{100.0 * some.mean('slack'):.0f} % of the time",
        held=[not run["cycles"] for run in some],
    )


@statement(
    "The cycle has the frequency of the pole that grows.",
    f"within {100.0 * SAME_HZ:.0f} %",
    basis=OURS,
    rule="Of runs that cycle as predicted and keep their target",
)
def frequency(runs: Runs) -> Finding:
    """Frequencies of cycles beside those of the linear loop."""
    kept = [r for r in runs if r["cycles"] and r["predicted"] and r["outcome"] == "timeout"]
    close = [abs(r["frequency_hz"] / r["pole_hz"] - 1.0) <= SAME_HZ for r in kept]
    spans = {name: [r["frequency_hz"] for r in kept if r["cables"] == name] for name in CABLES}
    words = ", ".join(
        f"{name} {min(some):.2f} to {max(some):.2f} Hz" for name, some in spans.items() if some
    )
    return Finding(
        found=f"{sum(close)} of {len(close)}; {words}",
        held=close,
        why="A swing that is large enough to slacken and tighten cables is slower than the small "
        "one about the rest: stiff cables are slack for part of each cycle.",
    )


def figure(runs: Runs) -> Figure:
    """Simulated outcomes over damping and gain, with the predicted boundary."""
    drawn, axes = new_figure(
        2,
        2,
        (11.0, 9.0),
        "Visual servo of CAROCA: cycles (cross, amplitude in mm), comes to rest (circle)",
    )
    for axis, name in zip(axes.flat, CABLES, strict=True):
        _draw_map(axis, name, runs(cables=name))
    return drawn


def _draw_map(axis: Axes, name: str, runs: Runs) -> None:
    """Outcomes with cables of a name; amplitudes in mm beside those that cycle."""
    for run in runs:
        axis.plot(
            run["gain"], run["damping"], "x" if run["cycles"] else "o", color="black",
            markerfacecolor="none", markersize=8,
        )  # fmt: skip
        if run["cycles"]:
            words = f"{1e3 * run['amplitude_m']:.0f}" if run["outcome"] == "timeout" else "lost"
            axis.annotate(words, (run["gain"], run["damping"]), (6, 4), textcoords="offset points")
    gains, loop = np.linspace(0.5, 2.5, 17), loop_of(name)
    rate = load_scenario(SCENARIO).controller.rate
    edge = [loop.boundary(float(gain), rate) for gain in gains]
    omega = 2.0 * np.pi * loop.slowest_hz
    robot = load_robot(load_scenario(SCENARIO).robot)
    line = gains * np.cos(0.5 * omega / rate) - robot.cable.retardation_time * omega**2
    axis.plot(gains, edge, label="linear loop: cycles below", **line_style(BOUND))
    axis.plot(
        gains, np.maximum(robot.platform.mass * line, 0.0), label="formula of one mode",
        **line_style(nth_look(3)),
    )  # fmt: skip
    axis.set(
        xlabel="gain at the goal [1/s]", ylabel="damping of the platform [N s/m]",
        title=TITLES[name], xlim=(0.5, 2.5), ylim=(0.0, 430.0),
    )  # fmt: skip
    axis.legend(loc="upper left")


def parameters(_form: Form) -> Mapping[str, Any]:
    """What all runs have in common."""
    return {
        "scenario": SCENARIO, "cables": CABLES, "duration_s": DURATION, "window_s": WINDOW,
        "cycle_m": CYCLE, "gyration_m2": GYRATION,
    }  # fmt: skip


STUDY = Study(
    name="slack-cycle",
    title="The cycle of slack of a visual servo on stiff cables, and where it begins",
    source="servoing thesis 2.3.4 and A.1.2, CAROCA",
    cases=cases,
    measure=measure,
    parameters=parameters,
    checks=(boundary, formula, matched, frequency),
    tables=[
        Summary(
            "Runs by cables and gain",
            ("cables", "gain"),
            {
                "runs": Cell("runs"),
                "cycle": Cell("total", "cycles"),
                "predicted": Cell("total", "predicted"),
                "largest amplitude [mm]": Cell("largest", "amplitude_m", ".2f"),
                "median frequency [Hz]": Cell("median", "frequency_hz", ".2f"),
                "share of time with slack": Cell("median", "slack", ".2f"),
            },
        )
    ],
    figures={"slack_cycle": figure},
)
