"""Dynamic control by tensions: tracking, forces alone, and the compiled loop as the diagram."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.benchmarks.mujoco import TendonLoop, compiled_loop, dynamic_scenario
from tests.systems.diagrams.diagram_cases import dynamic_control

TRACKING = 1e-4
"""Promised distance from the trajectory with the exact model [m]; a wrench that is held for a
millisecond leaves some micrometres."""

UNDAMPED = DampingSettings(translation=0.0, rotation=0.0)
"""The controller's model has no damping of the platform, which CAROCA's file has."""

ROUNDING = 1e-12
"""The same numbers by another way, of order one [m, N]."""

WAYS = {
    "acrobot_large": ([0.1, -0.08, 0.15], [4.0, -3.0, 6.0]),
    "caroca": ([0.3, 0.5, 0.3], [2.0, -2.0, 3.0]),
    "planar": ([0.1, 0.05, 0.0], [0.0, 0.0, 5.0]),
}
"""Steps [m] and turns [deg] that each robot can follow in a second."""


def there_and_back(name, **more):
    """Dynamic control of a robot that goes its way and returns."""
    home = load_robot(name).home.transform()
    step, turn = WAYS[name]
    away = pose_from_angles(home.translation() + step, np.radians(turn))
    way = PoseTrajectory((home, away, home), (1.0, 1.0), 0.1)
    return dynamic_control(name, trajectory=way, **more)


def advance(control, duration):
    """The context at the end, and the largest distance from the trajectory on the way [m]."""
    context = control.make_context()
    simulator = Simulator(control.diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    worst = 0.0
    for k in range(1, int(duration / 0.05) + 1):
        simulator.AdvanceTo(0.05 * k)
        worst = max(worst, control.errors(context)[0])
    return context, worst


def failures(control, context):
    return control.diagram.GetOutputPort("failures").Eval(context)[0]


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("acrobot_large", "quadratic_program"),
        ("planar", "quadratic_program"),
    ],
)
def test_a_feasible_trajectory_is_followed(name, method):
    control = there_and_back(name, method=method, damping=UNDAMPED)
    context, worst = advance(control, 1.6)
    assert worst < TRACKING
    assert failures(control, context) == 0.0


@pytest.mark.parametrize("known", [True, False])
def test_pulleys_matter_unless_the_distribution_knows_them(known):
    cables = load_robot("caroca").cable_set()
    believed = cables if known else cables.without_pulleys()
    control = there_and_back(
        "caroca", cables=cables, believed_cables=believed, damping=UNDAMPED, log_rate=10.0
    )
    context, worst = advance(control, 1.6)
    log = control.read_log(context)
    lengths = cable_paths(pose_from_row(log["X_WP"][-1]), cables).lengths
    np.testing.assert_allclose(log["lengths"][-1], lengths, rtol=0.0, atol=ROUNDING)
    assert worst < TRACKING if known else worst > 10.0 * TRACKING


OUTPUTS = ("desired_wrench", "tensions", "feasible", "failures", "lengths", "slack")


def test_a_log_has_the_values_of_public_ports():
    """Lengths, slack and poses are computed from logged states, and not in the loop."""
    control = there_and_back("planar", limits=(0.0, 60.0), log_rate=100.0)
    diagram = control.diagram
    names = {system.get_name() for system in diagram.GetSystems()}
    assert names >= {"plant", "controller", "distributor", "cables"}
    ports = {diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())}
    assert ports == {"X_WP", "X_WP_desired", *OUTPUTS}
    context, _ = advance(control, 0.5)
    log = control.read_log(context)
    assert log["time"][-1] == pytest.approx(0.5)
    for name in ("X_WP", "X_WP_desired", *OUTPUTS):
        here = diagram.GetOutputPort(name).Eval(context)
        here = here if name in OUTPUTS else pose_row(here)
        np.testing.assert_allclose(log[name][-1], here, rtol=0.0, atol=ROUNDING, err_msg=name)
        assert len(log[name]) == len(log["time"])
    alone = there_and_back("planar").diagram.GetSystems()  # without a log
    named = {system.get_name() for system in alone}
    assert named == {"plant", "controller", "distributor", "cables"}
    assert np.any(log["slack"])  # the least tensions of a planar robot have cables at zero


SAMPLED = 4e-4
"""A force that is held for a millisecond changes that curve by less, of 20 mm [m]."""

SAME = 1e-13
"""Of largest numbers: the same kernels in the same order, compiled together and apart."""

END = 0.23
"""Simulated time, between two control steps of most rates [s]."""


def forced(balance):
    rule = StepRule(max_step=1e-3)
    return dynamic_control(balance=balance, limits=(0.1, 200.0), rule=rule, log_rate=1000.0)


def released(balance, offset, duration=0.4):
    """The log of a platform that starts beside home, until cables can pull it no more."""
    built = forced(balance)
    start = RigidTransform(built.trajectory.pose(0.0))
    start.set_translation(start.translation() + offset)
    loop = TensionLoop(built, 1000.0, start)
    loop.advance_to(duration)
    return built, loop.read_log()


def test_by_forces_alone_the_centre_of_mass_obeys_the_law_of_a_point_mass():
    """e0 (1 + 10 t) exp(-10 t) of critical damping."""
    offset = np.array([0.0, 0.0, -0.02])
    built, log = released(FORCE, offset)
    assert np.all(log["feasible"][1:] == 1.0)
    t, center = log["time"][:, np.newaxis], built.robot.center_of_mass()
    expected = built.trajectory.pose(0.0) @ center + offset * (1.0 + 10.0 * t) * np.exp(-10.0 * t)
    centres = np.array([pose_from_row(row) @ center for row in log["X_WP"]])
    assert np.max(np.abs(centres - expected)) < SAMPLED


def test_moments_are_held_by_the_wrench_and_not_by_the_force():
    turns = {}
    for balance in (WRENCH, FORCE):
        _, log = released(balance, np.array([0.01, 0.0, -0.02]))
        w = np.clip(np.abs(log["X_WP"][:, 0]), 0.0, 1.0)
        turns[balance] = np.max(2.0 * np.arccos(w))
    assert turns[WRENCH] < np.radians(0.1)
    assert turns[FORCE] > np.radians(5.0)


def moving(*, rate=1000.0, log_rate=100.0, max_step=1e-3, **more):
    """Dynamic control of ACROBOT on a short way."""
    ends = RigidTransform([0.0, 0.0, 0.25]), RigidTransform([0.05, 0.02, 0.3])
    return dynamic_control(
        trajectory=PoseTrajectory(ends, (0.3,)), limits=(1.0, 60.0), rate=rate,
        rule=StepRule(max_step=max_step), log_rate=log_rate, **more,
    )  # fmt: skip


LOOPS = {
    "as it is": (moving, {}),
    "rates": (moving, {"rate": 700.0, "log_rate": 330.0, "max_step": 4e-4}),
    "damping": (moving, {"damping": DampingSettings(translation=40.0, rotation=0.5)}),
    # Requests that are not met, which are held and counted.
    "failures": (moving, {"rate": 90.0, "log_rate": 1000.0, "method": "dykstra"}),
    "forces": (lambda: forced(FORCE), {}),
}


@pytest.mark.parametrize("case", LOOPS)
def test_the_loop_is_the_diagram_without_its_callbacks(case):
    make, options = LOOPS[case]
    built, pieces = make(**options), [0.1, 0.2, END]
    assert can_be_compiled(built)
    loop = TensionLoop(built, 1000.0 if case == "forces" else options.get("log_rate", 100.0))
    simulator = Simulator(built.diagram, built.make_context())
    simulator.Initialize()
    for time in pieces:
        simulator.AdvanceTo(time)
        loop.advance_to(time)
    assert loop.time == END
    context = simulator.get_context()
    log, compiled = built.read_log(context), loop.read_log()
    assert set(compiled) == set(log)
    assert len(log["time"]) > 20
    for key, values in log.items():
        assert compiled[key].shape == values.shape, key
        close = SAME * (1.0 + np.max(np.abs(values)))
        np.testing.assert_allclose(compiled[key], values, rtol=0.0, atol=close, err_msg=key)
    state = built.motion.state(built.motion.GetMyContextFromRoot(context))
    np.testing.assert_allclose(loop.state(), state, rtol=0.0, atol=SAME)
    if case != "forces":
        assert np.ptp(log["X_WP"][:, 6]) > 0.005  # it moves
    if case == "failures":
        assert log["failures"][-1, 0] > 0.0


def test_a_log_is_read_in_pieces_and_one_call_is_many():
    built, read = moving(), []
    whole, pieces = TensionLoop(built, 100.0), TensionLoop(built, 100.0)
    whole.advance_to(END)
    for time in (0.05, 0.15, END):
        pieces.advance_to(time)
        read.append(pieces.read_log())
        assert pieces.rows() == len(read[-1]["time"])
        pieces.clear()
    for key, values in whole.read_log().items():
        joined = np.concatenate([piece[key] for piece in read])
        # Where a call ends, a step of the integrator ends.
        np.testing.assert_allclose(joined, values, rtol=1e-9, atol=1e-9)
    assert pieces.errors() == pytest.approx(whole.errors(), abs=1e-9)


def test_a_loop_starts_at_a_given_pose():
    built = moving()
    start = RigidTransform([0.01, -0.02, 0.0]) @ built.trajectory.pose(0.0)
    loop = TensionLoop(built, 100.0, start)
    assert loop.errors()[0] == pytest.approx(np.hypot(0.01, 0.02))
    loop.advance_to(0.05)
    np.testing.assert_array_equal(loop.columns()["tensions"], loop.read_log()["tensions"])
    np.testing.assert_allclose(loop.read_log()["X_WP"][0, 4:], start.translation(), atol=SAME)


def test_mujoco_and_daqp_close_the_same_loop():
    """Another engine and another solver, of first order in the step of 1 ms; found: 29 um, 1e-3."""
    loop, tendons = compiled_loop(), TendonLoop(dynamic_scenario("plant"))
    loop.advance_to(1.5)
    tendons.advance(1500)
    assert tendons.time == pytest.approx(loop.time)
    log = loop.read_log()
    assert np.linalg.norm(log["X_WP"][-1, 4:] - log["X_WP"][0, 4:]) > 0.05
    pose = tendons.pose()
    np.testing.assert_allclose(pose[:3], loop.pose().translation(), atol=1e-4)
    turn = 2.0 * np.arccos(min(abs(pose[3:] @ loop.pose().rotation().ToQuaternion().wxyz()), 1.0))
    assert turn < 1e-4
    np.testing.assert_allclose(tendons.tensions(), log["tensions"][-1], rtol=1e-2)
