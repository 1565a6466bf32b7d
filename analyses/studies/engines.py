"""Study: the plant and the compiled engine beside each other.

Both run every scenario that ships, taut motions of robots that are drawn, and servos with cables
that go slack and catch; orders of convergence are measured, and the energy that impacts put in or
take out. The plant is the reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.frame.figures import (
    bar_style,
    bare_figure,
    line_style,
    plain_numbers,
    styled,
)
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import DASHED, SOLID, nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT, CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import COMPILED, PLANT, CableRobotSettings, CableSettings
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL, robot_scenario_names, scenario_kind
from cdpr_drake.systems.scenarios.run_settings import has_contact, needs_plant

LONGEST = 120.0
"""Simulated time after which scenarios of hours are compared [s]."""

QUICK_SCENARIOS = ("acrobot_pbvs", "planar_computed_torque", "planar_pbvs")
QUICK_DURATION = 0.5
"""Of scenarios, and of the undamped robot, in the quick form [s]."""


def run_pair(name: str, overrides: Sequence[str]) -> dict[str, Any]:
    """A scenario, run once by each engine; the camera of a servo is projected.

    Returns:
        outcome_plant, outcome_compiled, time_plant_s, time_compiled_s: how and when each ended;
        distance_m, angle_rad: how far their paths part at most; final_distance_m, final_angle_rad:
        at the end; final_error_plant_m, final_error_compiled_m: how far each ended from its goal;
        tension_difference_n: at most; largest_tension_n; slack_share: share of cables and rows
        that were slack, of the plant.
    """
    tensions = scenario_kind(name) == TENSION_CONTROL
    more = [] if tensions else ["camera.kind=projected"]
    runs: list[ServoRun | TensionRun] = []
    for engine in (PLANT, COMPILED):
        scenario = load_scenario(name, [*more, *overrides, f"integration.engine={engine}"])
        runs.append((TensionRun if tensions else ServoRun)(scenario).simulate())
    one, other = runs
    count = min(len(run.log["time"]) for run in runs)
    distance, angle = pose_rows_distance(one.log["X_WP"][:count], other.log["X_WP"][:count])
    end = pose_rows_distance(one.log["X_WP"][-1:], other.log["X_WP"][-1:])
    difference = np.abs(one.log["tensions"][:count] - other.log["tensions"][:count])
    row: dict[str, Any] = {}
    for engine, run in ((PLANT, one), (COMPILED, other)):
        row[f"outcome_{engine}"] = Outcome(run.outcome).name.lower()
        row[f"time_{engine}_s"] = run.sim_time
        row[f"final_error_{engine}_m"] = final_error(run)
    return row | {
        "distance_m": np.max(distance), "angle_rad": np.max(angle),
        "final_distance_m": end[0][0], "final_angle_rad": end[1][0],
        "tension_difference_n": np.max(difference),
        "largest_tension_n": np.max(one.log["tensions"]),
        "slack_share": np.mean(one.log["slack"]),
    }  # fmt: skip


def final_error(run: ServoRun | TensionRun) -> float:
    """Distance of the last logged pose from where it should be [m]."""
    log = run.log
    if isinstance(run, TensionRun):
        distance, _ = pose_rows_distance(log["X_WP"][-1:], log["X_WP_desired"][-1:])
        return float(distance[0])
    desired = run.built.desired_platform_pose(float(log["time"][-1]))
    return float(np.linalg.norm(desired.translation() - log["X_WP"][-1, 4:]))


def commanded_path(
    kind: type[CableRobot | CompiledCableRobot],
    robot: Robot,
    settings: CableRobotSettings,
    X_WP: RigidTransform,
    velocities: Array,
    period: float,
    *,
    rule: StepRule,
    slack: Array | None = None,
) -> tuple[Array, Array, Array]:
    """A robot that is held at a pose and then gets a velocity of each cable for each period.

    Args:
        kind: `CableRobot`, which Drake's integrator of the rule's name moves, or
            `CompiledCableRobot`.
        robot: The robot.
        settings: Its cables; winches are ideal.
        X_WP: Where it is held [m].
        velocities: Cable velocities, shape (k, m) [m/s].
        period: For how long each is commanded [s].
        rule: How it is integrated.
        slack: Lengths paid out at the start, shape (m,) [m].

    Returns:
        State of the platform after each period, shape (k, 13 or 6), unstrained lengths then, shape
        (k, m) [m], and tensions, shape (k, m) [N].
    """
    block: CableRobot | CompiledCableRobot
    if kind is CompiledCableRobot:
        block = CompiledCableRobot(robot, settings, command_period=HELD)
    else:
        block = CableRobot(robot, settings)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, X_WP, slack)
    if isinstance(block, CompiledCableRobot):
        block.integrate_by(rule)
    else:
        ResetIntegratorFromFlags(simulator, rule.method, rule.max_step).set_fixed_step_mode(True)
    port = block.GetInputPort("cable_velocities")
    ports = [
        block.GetOutputPort(name) for name in ("platform_state", "unstrained_lengths", "tensions")
    ]
    rows: list[list[Array]] = []
    for number, velocity in enumerate(velocities, 1):
        port.FixValue(context, velocity)
        simulator.AdvanceTo(number * period)
        rows.append([port.Eval(context).copy() for port in ports])
    states, lengths, tensions = (np.array([row[k] for row in rows]) for k in range(3))
    return states, lengths, tensions


def state_distance(one: Array, other: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between platforms' states, shape (k, 13 or 6)."""
    if one.shape[1] == 6:
        return (
            np.linalg.norm(one[:, :2] - other[:, :2], axis=1),
            np.abs(one[:, 2] - other[:, 2]),
        )
    rows = [np.hstack([_unit(states[:, :4]), states[:, 4:7]]) for states in (one, other)]
    return pose_rows_distance(*rows)


def _unit(quaternions: Array) -> Array:
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=1)[:, None], float)


IMPACTS = "acrobot_pbvs"
"""The servo whose cables are paid out at random at its start, so that they catch on the way."""

MOST_SLACK = 5e-3
"""Largest length that is paid out [m]."""

DRAWN = ("acrobot_small", "acrobot_large", "planar")
"""Robots whose cables, points and masses are varied."""

TAUT_DURATION, TAUT_PERIOD = 10.0, 0.02
"""Of a taut motion, and of a command in it [s]."""

AMPLITUDE = 0.02
"""Of a taut motion [m]."""

TAUT_SHARE = 0.5
"""Share of the automatic step that taut motions are integrated with: close to the largest stable
step the engines would show the errors of their common method, taken at other times."""

SOFTER = 1e3
"""How much softer than ACROBOT's are the cables of a motion that can be followed for long. Real
ones catch within half a millisecond, and what comes after some impacts is chaotic: half the step
gives another path, by either engine."""

STEPS = 5
"""Steps at which orders are measured, each half of the one before."""

EXPLICIT = "runge_kutta3"
METHODS = ("runge_kutta2", EXPLICIT, SEMI_IMPLICIT)

ENERGY_DURATION = 5.0
"""How long an undamped robot bounces on its real cables [s]."""

ENERGY_STEPS = (1e-4, 5e-5, 2.5e-5)
"""Steps of that [s]; the largest stable one with all cables taut is about 1e-3."""

ENERGY_SLACK = 5e-4
"""Length paid out on all cables at its start: it falls into them [m]."""


def slack_override(seed: int) -> str:
    """Lengths that are paid out at the start, by a seed, as an override of a scenario."""
    slack = np.random.default_rng(seed).uniform(0.0, MOST_SLACK, 8)
    return f"perturbations.slack=[{', '.join(f'{x:.6f}' for x in slack)}]"


def drawn_robot(seed: int) -> tuple[Robot, CableRobotSettings]:
    """A robot with other masses, cables and exit points, and whether it has pulleys."""
    random = np.random.default_rng(seed)
    robot = load_robot(DRAWN[random.integers(len(DRAWN))])
    robot.cable.youngs_modulus *= 10.0 ** random.uniform(-3.0, 0.0)
    robot.cable.retardation_time = random.uniform(5e-5, 1e-3)
    robot.platform.mass *= random.uniform(0.7, 2.0)
    flat = np.array([1.0, 1.0, 0.0 if robot.motion_type().is_horizontal_body else 1.0])
    for cable in robot.cables:
        cable.exit_point = cable.exit_point + random.uniform(-0.03, 0.03, 3) * flat
    pulleys = bool(random.integers(2)) and not robot.motion_type().is_horizontal_body
    return robot, CableRobotSettings(cables=CableSettings(pulleys=pulleys))


def taut_velocities(robot: Robot, settings: CableRobotSettings, seed: int) -> Array:
    """Cable velocities that lead the platform on a slow loop and back, shape (k, m) [m/s]."""
    random = np.random.default_rng(seed)
    cables, home = settings.cables.cable_set(robot), robot.home.transform()
    flat = np.array([1.0, 1.0, 0.0 if robot.motion_type().is_horizontal_body else 1.0])
    size = AMPLITUDE * random.uniform(-1.0, 1.0, (2, 3)) * flat
    times = np.arange(round(TAUT_DURATION / TAUT_PERIOD) + 1) * TAUT_PERIOD
    phase = 2.0 * np.pi * times / TAUT_DURATION
    lengths = []
    for p in phase:
        away = size[0] * (1.0 - np.cos(p)) / 2.0 + size[1] * (1.0 - np.cos(2.0 * p)) / 2.0
        X_WP = RigidTransform(home.rotation(), home.translation() + away)
        lengths.append(cable_paths(X_WP, cables).lengths)
    return np.asarray(np.diff(lengths, axis=0) / TAUT_PERIOD)


def taut_row(seed: int) -> dict[str, Any]:
    """A robot that is drawn, on a slow loop with cables taut, by both engines.

    Returns:
        distance_m, angle_rad, energy_difference: the largest ones, the last over the energy that
        lifts the platform by the motion; least_tension_n.
    """
    robot, settings = drawn_robot(seed)
    home = robot.home.transform()
    velocities = taut_velocities(robot, settings, seed)
    rule = StepRule(max_step=TAUT_SHARE * automatic_step(robot, home, "runge_kutta3", settings))
    (one, l0, tensions), (other, l0_other, _) = (
        commanded_path(kind, robot, settings, home, velocities, TAUT_PERIOD, rule=rule)
        for kind in (CableRobot, CompiledCableRobot)
    )
    distance, angle = state_distance(one, other)
    motion = CompiledCableRobot(robot, settings).motion
    energies = [
        np.array([motion.energy_of(np.concatenate(row)) for row in zip(*rows, strict=True)])
        for rows in ((one, l0), (other, l0_other))
    ]
    size = robot.platform.mass * 9.81 * AMPLITUDE
    return {
        "distance_m": np.max(distance), "angle_rad": np.max(angle),
        "energy_difference": np.max(np.abs(energies[0] - energies[1])) / size,
        "least_tension_n": np.min(tensions),
    }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class OrderTrial:
    """ACROBOT at home, its winches run, by each method at one step after the other.

    Attributes:
        softer: How much softer than the robot's its cables are.
        model: Their model.
        slack: Length that all are paid out by at the start, so that the platform falls and they
            catch [m].
        duration: For how long [s].
        largest: Largest of `STEPS` steps, each half of the one before [s].
        reference: Step of the plant to which they are compared [s].
    """

    softer: float = SOFTER
    model: str = "elastic"
    slack: float = 0.0
    duration: float = 0.4
    largest: float = 4e-3
    reference: float = 2e-5

    def path(self, kind: type[CableRobot | CompiledCableRobot], rule: StepRule) -> Array:
        """States of the platform by an engine and a rule."""
        robot = load_robot("acrobot_small")
        robot.cable.youngs_modulus /= self.softer
        settings = CableRobotSettings(cables=CableSettings(model=self.model))
        velocities = np.tile(np.linspace(-0.05, 0.0, 8), (4, 1))
        states, _, _ = commanded_path(
            kind, robot, settings, robot.home.transform(), velocities, self.duration / 4,
            rule=rule, slack=np.full(8, self.slack) if self.slack > 0.0 else None,
        )  # fmt: skip
        return states


def order_row(trial: OrderTrial) -> dict[str, Any]:
    """The largest distance to the plant at a small step, distances_m, and the order of convergence
    between the first step and the last, orders, by method; the former by step."""
    reference = trial.path(CableRobot, StepRule(method=EXPLICIT, max_step=trial.reference))
    steps = [trial.largest / 2**k for k in range(STEPS)]
    found: dict[str, list[float]] = {method: [] for method in METHODS}
    for method, distances in found.items():
        for step in steps:
            path = trial.path(CompiledCableRobot, StepRule(method=method, max_step=step))
            distances.append(float(np.max(state_distance(path, reference)[0])))
    orders = {m: float(np.log2(d[0] / d[-1]) / (STEPS - 1)) for m, d in found.items()}
    return {"steps_s": steps, "distances_m": found, "orders": orders}


ORDERS = {
    "taut": OrderTrial(),
    "catching": OrderTrial(slack=2e-2),
    "catching real": OrderTrial(
        softer=1.0, model="kelvin_voigt", slack=5e-4, duration=0.04, largest=4e-4, reference=2e-6
    ),
}
"""Where orders are measured, by what cables do; the last a fall of half a millimetre into the real
cables, and the first impacts."""


def energy_row(step: float, duration: float) -> dict[str, Any]:
    """ACROBOT on its real cables, undamped and slack at the start, halted.

    Args:
        step: Of the integration [s].
        duration: For how long [s].

    Returns:
        Changes of the energy over that of the fall: largest_gain and least_gain by runge_kutta3,
        semi_implicit_gain, the largest; slack_cables: most at a time; largest_tension_n.
    """
    robot = load_robot("acrobot_small")
    settings = CableRobotSettings(cables=CableSettings(model="elastic"))
    motion = CompiledCableRobot(robot, settings).motion
    fall = robot.platform.mass * robot.gravity * ENERGY_SLACK
    gains, tensions = {}, {}
    for method in (EXPLICIT, SEMI_IMPLICIT):
        states, l0, tensions[method] = commanded_path(
            CompiledCableRobot, robot, settings, robot.home.transform(),
            np.zeros((round(duration / 0.01), 8)), 0.01,
            rule=StepRule(method=method, max_step=step), slack=np.full(8, ENERGY_SLACK),
        )  # fmt: skip
        energies = [motion.energy_of(np.concatenate(r)) for r in zip(states, l0, strict=True)]
        gains[method] = np.array(energies) - energies[0]
    return {
        "largest_gain": np.max(gains[EXPLICIT]) / fall,
        "least_gain": np.min(gains[EXPLICIT]) / fall,
        "semi_implicit_gain": np.max(gains[SEMI_IMPLICIT]) / fall,
        "slack_cables": int(np.max(np.sum(tensions[EXPLICIT] == 0.0, axis=1))),
        "largest_tension_n": np.max(tensions[EXPLICIT]),
    }


def impacts_row(seed: int) -> dict[str, Any]:
    """A servo with cables paid out by the seed, by both engines."""
    return run_pair(IMPACTS, [slack_override(seed), f"seed={seed}"])


def cases(form: Form) -> Iterator[Case]:
    """Scenarios, taut motions and impacts over seeds, orders by what cables do, steps."""
    for name in QUICK_SCENARIOS if form.quick else robot_scenario_names():
        scenario = load_scenario(name)
        if has_contact(scenario) or needs_plant(scenario):
            continue  # the compiled engine has no contact and no pushes: nothing to compare
        changes = [f"duration={LONGEST}"] if scenario.duration > LONGEST else []
        if form.quick and scenario_kind(name) != TENSION_CONTROL:
            changes = [f"duration={QUICK_DURATION}"]
        yield Case(
            keys={"kind": "scenario", "scenario": name}, call=partial(run_pair, name, changes)
        )
    yield Case(keys={"kind": "taut"}, call=partial(taut_row), seeds=form.times(30, 3))
    for name, trial in ORDERS.items():
        yield Case(keys={"kind": "order", "order": name}, call=partial(order_row, trial))
    for step in ENERGY_STEPS:
        duration = QUICK_DURATION if form.quick else ENERGY_DURATION
        keys = {"kind": "energy", "step_s": step}
        yield Case(keys=keys, call=partial(energy_row, step, duration))
    yield Case(keys={"kind": "impacts"}, call=partial(impacts_row), seeds=form.times(200, 2))


def scenario_table(rows: Frame) -> Frame:
    """Scenarios by both engines; paths and ends in um."""
    some = rows[rows["kind"] == "scenario"]
    keys = ["scenario", "outcome_plant", "outcome_compiled", "time_plant_s", "time_compiled_s"]
    sizes = ["distance_m", "final_distance_m", "final_error_plant_m", "final_error_compiled_m"]
    found = some[[*keys, *sizes, "slack_share"]].copy()
    found[sizes] *= 1e6
    return found.rename(columns={name: name.replace("_m", " [um]") for name in sizes})


def figure(rows: Frame) -> Figure:
    """Orders of convergence, and distances of the engines."""
    drawn = bare_figure((14.0, 13.0), "Compiled engine beside the plant")
    with styled():
        axes = drawn.subplot_mosaic([["soft", "names"], ["impacts", "names"], ["energy", "names"]])
    for name, dash in (("taut", SOLID), ("catching", DASHED)):
        for row in rows[rows.get("order") == name].to_dict("records"):
            steps = 1e3 * np.array(row["steps_s"])
            for k, method in enumerate(METHODS):
                look = nth_look(k)
                axes["soft"].loglog(
                    steps, row["distances_m"][method], linestyle=dash, color=look.color,
                    marker=look.marker, label=f"{method}, {name}",
                )  # fmt: skip
            _name_steps(axes["soft"], steps)
    axes["soft"].set(
        xlabel="step [ms]", ylabel="distance to the plant at 0.02 ms [m]", title="soft cables"
    )
    kinds = dict([*rows.groupby("kind")])
    whats = (("distance_m", "on the path"), ("final_distance_m", "at the end"))
    for k, (what, label) in enumerate(whats):
        if "scenario" in kinds:
            some = kinds["scenario"]
            style = {"height": 0.8 / (k + 1), "label": label, **bar_style(nth_look(k))}
            axes["names"].barh(some["scenario"], 1e6 * some[what], **style)
        if "impacts" in kinds:
            sizes = np.sort(1e6 * kinds["impacts"][what])
            axes["impacts"].semilogy(sizes, label=label, **line_style(nth_look(k)))
    if "scenario" in kinds:
        axes["names"].set(xscale="log", ylim=(-0.8, len(kinds["scenario"]) - 0.2))
        axes["names"].tick_params(axis="y", labelsize=8)
        below = {"bbox_to_anchor": (0.5, 0.0), "borderaxespad": 6.0, "fontsize": 8, "ncols": 2}
        axes["names"].legend(loc="upper center", **below)  # bars fill the axes
    axes["names"].set(xlabel="distance of the engines [\u00b5m]", title="scenarios that ship")
    words = {"xlabel": "runs, sorted", "ylabel": "distance of the engines [\u00b5m]"}
    axes["impacts"].set(**words, title="servo, cables paid out at random")
    if "energy" in kinds:
        steps = 1e3 * kinds["energy"]["step_s"].to_numpy()
        for k, (column, label) in enumerate((("least_gain", "least"), ("largest_gain", "largest"))):
            style = {"marker": nth_look(k).marker, "label": label, **line_style(nth_look(k))}
            axes["energy"].semilogx(steps, kinds["energy"][column], **style)
        _name_steps(axes["energy"], steps)
    words = {"xlabel": "step [ms]", "ylabel": "change of energy over that of the fall [-]"}
    axes["energy"].set(**words, title="real stiffness, undamped, runge_kutta3")
    for name, one in axes.items():
        if name != "names" and one.get_legend_handles_labels()[0]:
            one.legend(loc="best", fontsize=8)
    return drawn


def _name_steps(axes: Any, steps: Array) -> None:
    """Numbers at the steps that were taken, and nowhere else."""
    axes.set_xticks(steps)
    axes.xaxis.set_minor_locator(NullLocator())
    plain_numbers(axes.xaxis)


STUDY = Study(
    name="engines",
    title="The plant and the compiled engine beside each other",
    cases=cases,
    parameters=lambda form: {
        "methods": METHODS,
        "energy_steps_s": ENERGY_STEPS,
        "impacts": IMPACTS,
    },
    tables={"Scenarios by both engines": scenario_table},
    figures={"engines": figure},
)
