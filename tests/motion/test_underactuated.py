"""Fewer cables than degrees of freedom: rest against Drake's springs, energy, what is asked."""

import json

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import LinearSpringDamper
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.analyses.workspaces.pose_grid import check_grid
from cdpr_drake.cli.app import main
from cdpr_drake.errors import (
    CableModelError,
    InfeasibleTensionError,
    RobotFileError,
    StabilityError,
    TensionProblemError,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
from cdpr_drake.models.robot_holding import rest_as_long
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_statics import rigid_platform, wrench_balance
from cdpr_drake.statics.controlled_wrenches import combination_words
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.messages import printed
from tests.motion.small_robots import content, small_robot

AT_REST = 1e-7
"""Of Drake's platform after it settled [m, rad]."""

KEPT = 1e-7
"""Change of energy per energy of the motion in a second, steps of 0.1 ms by Runge-Kutta 3."""


def command(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


def runs(capsys, *arguments):
    """What a command says."""
    code, out, err = command(capsys, *arguments)
    assert code == 0, err
    return out


def fails(capsys, *arguments):
    """The one line with which a command refuses."""
    code, _, err = command(capsys, *arguments)
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    return err


NAMES = ["pendulum", "tripod", "hanging_four", "tilted_gravity"]


def sprung_plant(robot, l0, damping):
    """The platform on Drake's springs of the cables' stiffness, braked, and its plant."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    handle = add_robot(plant, robot)
    cables = robot.cable_set()
    for k, length in enumerate(l0):
        stiffness = cables.stiffness[k] / length
        spring = LinearSpringDamper(
            plant.world_body(), cables.p_WA[:, k], handle.body, cables.p_PB[:, k], length,
            stiffness, 2.0,
        )  # fmt: skip
        plant.AddForceElement(spring)
    plant.Finalize()
    D = np.zeros((6, 13))
    D[:, 7:] = -np.diag(damping)
    brake = builder.AddSystem(MatrixGain(D))
    builder.Connect(plant.get_state_output_port(), brake.get_input_port())
    builder.Connect(brake.get_output_port(), plant.get_applied_generalized_force_input_port())
    return builder.Build(), plant, handle


@pytest.mark.parametrize("name", NAMES)
def test_pose_of_rest_is_where_drake_s_springs_settle(name):
    robot = small_robot(name)
    cables = robot.cable_set()
    l0 = cable_paths(robot.home.transform(), cables).lengths
    rest = equilibrium_near(cables, "elastic", rigid_platform(robot), l0, robot.home.transform())
    assert np.all(rest.tensions > 0.0)  # springs also push, cables do not
    diagram, plant, handle = sprung_plant(robot, l0, [0.5, 0.5, 0.5, 8.0, 8.0, 8.0])
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    R = rotation_from_vector(np.array([0.02, -0.03, 0.02]))
    start = rest.X_WP.translation() + np.array([0.03, -0.02, 0.02])
    turned = rotation_from_vector(np.zeros(3)) if robot.motion_type().is_point else R
    handle.set_pose(context, RigidTransform(turned @ rest.X_WP.rotation(), start))
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.Initialize()
    simulator.AdvanceTo(12.0)
    assert max(pose_error(handle.pose(context), rest.X_WP)) < AT_REST


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
@pytest.mark.parametrize("name", ["pendulum", "tripod", "hanging_four"])
def test_it_hangs_swings_and_keeps_its_energy(name, kind):
    robot = small_robot(name)
    settings = CableRobotSettings(cables=CableSettings(model="elastic"))
    if kind is CompiledCableRobot:
        diagram = kind(robot, settings, rule=StepRule(max_step=1e-4))
    else:
        diagram = kind(robot, settings)
    simulator = Simulator(diagram)
    context, m = simulator.get_mutable_context(), len(robot.cables)
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(m))
    diagram.set_at_equilibrium(context, robot.home.transform())
    X_WP = diagram.GetOutputPort("X_WP").Eval(context)
    cables = robot.cable_set().without_pulleys()
    l0 = cable_paths(robot.home.transform(), cables).lengths
    tensions = diagram.GetOutputPort("tensions").Eval(context)
    if robot.is_underactuated():
        rest, holding = rest_as_long(robot, robot.home.transform(), cables, "elastic")
        assert max(pose_error(X_WP, rest)) < 1e-12
        np.testing.assert_allclose(tensions, holding.tensions, rtol=1e-6)
    else:
        l0 = diagram.GetOutputPort("unstrained_lengths").Eval(context).copy()
    shifted = RigidTransform(X_WP.rotation(), X_WP.translation() + np.array([0.01, 0.02, 0.0]))
    platform = rigid_platform(robot)

    def energy():
        X = diagram.GetOutputPort("X_WP").Eval(context)
        state = diagram.GetOutputPort("platform_state").Eval(context)
        stretch = np.maximum(cable_paths(X, cables).lengths - l0, 0.0)
        V = state[7:]
        kinetic = 0.5 * V @ platform.mass_matrix(X) @ V
        springs = 0.5 * np.sum(cables.stiffness / l0 * stretch**2)
        return kinetic, kinetic + springs + platform.potential_energy(X)

    lowest = energy()[1]
    if kind is CompiledCableRobot:
        motion = diagram.motion
        motion.hold(motion.GetMyMutableContextFromRoot(context), shifted, l0, np.zeros(m))
    else:
        plant = diagram.plant.GetMyMutableContextFromRoot(context)
        diagram.in_plant.set_pose(plant, shifted)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-4)
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
    before = energy()[1]
    simulator.Initialize()
    simulator.AdvanceTo(0.5)
    kinetic, after = energy()
    assert kinetic > 0.0
    assert abs(after - before) < KEPT * (before - lowest)


def test_what_four_cables_cannot_control():
    robot = small_robot("hanging_four")
    control = wrench_balance(robot, robot.home.transform()).control()
    assert control.rank == 4
    assert control.free.shape == (6, 2)
    J = cable_paths(robot.home.transform(), robot.cable_set()).J
    np.testing.assert_allclose(J @ control.free, 0.0, atol=1e-9)
    assert not control.balances
    assert control.tensions is None
    with pytest.raises(InfeasibleTensionError, match="4 cables for 6 degrees of freedom"):
        static_at_pose(robot, robot.home.transform(), "elastic", False)


def test_a_pose_of_rest_is_held_by_its_tensions():
    robot = small_robot("hanging_four")
    l0 = cable_paths(robot.home.transform(), robot.cable_set()).lengths
    report = static_at_lengths(robot, l0, "elastic", False)
    control = wrench_balance(robot, report.X_WP).control()
    assert control.balances
    np.testing.assert_allclose(control.tensions, report.tensions, rtol=1e-6)
    held = static_at_pose(robot, report.X_WP, "elastic", False)
    np.testing.assert_allclose(held.l0, l0, rtol=1e-8)


def test_combinations_in_words():
    words = ("moment about x", "force along y", "force along z")
    assert combination_words(np.array([0.0, 1.0, 0.0]), words) == "force along y"
    assert (
        combination_words(np.array([0.0, 1.0, -0.5]), words) == "force along y - 0.5 force along z"
    )
    found = combination_words(np.array([1.0, 0.25, 0.0]), words)
    assert found == "moment about x + 0.25 m force along y"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Files of some small robots by name."""
    folder = tmp_path_factory.mktemp("robots")
    made = {}
    for name in (
        "pendulum",
        "tripod",
        "hanging_four",
        "beam",
        "tilted_gravity",
        "slope",
        "oblique_body",
        "upright_body",
        "lift",
    ):
        made[name] = folder / f"{name}.yaml"
        made[name].write_text(yaml.safe_dump(content(name)), encoding="utf-8")
    return made


def test_tension_says_what_cannot_be_controlled(files, capsys):
    answer = json.loads(runs(capsys, "tension", files["pendulum"], "--pose", "0,0,0.5", "--json"))
    assert (answer["rank"], answer["degrees_of_freedom"]) == (1, 3)
    assert answer["status"] == "feasible"
    assert answer["tensions_n"] == pytest.approx([2.0 * 9.81])
    combinations = [one["combination"] for one in answer["uncontrolled"]]
    assert combinations == ["force along x", "force along y"]
    aside = runs(capsys, "tension", files["pendulum"], "--pose", "0.5,0,0.5")
    assert "infeasible" in aside
    assert "no tensions change" in aside
    four = runs(capsys, "tension", files["hanging_four"], "--pose", "0,0,0.3")
    assert "4 cables for 6 degrees of freedom, which control 4 of them here" in four


def test_static_finds_the_pose_of_rest_and_its_frequencies(files, capsys):
    arguments = ("--lengths", "1.5", "--json", "--cable-model", "inextensible")
    answer = json.loads(runs(capsys, "static", files["pendulum"], *arguments))
    assert answer["frequencies_hz"] == pytest.approx([np.sqrt(9.81 / 1.5) / (2 * np.pi)] * 2)
    assert answer["pose"]["position_m"] == pytest.approx([0.0, 0.0, 0.5])
    told = fails(capsys, "static", files["hanging_four"], "--pose", "0,0,0.3")
    assert "4 cables for 6 degrees of freedom, does not rest at" in told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("tension", "pendulum", "--pose", "0,0,0.5", "--method", "dykstra"), "quadratic_program"),
        (("workspace", "beam"), "motions along axes of W, and not 2R3T"),
        (("workspace", "slope"), "motions along axes of W, and not 2R3T"),
        (("workspace", "hanging_four"), "found 4 for 6 degrees of freedom"),
        (("stability", "tripod"), "accepted by stability: 3R3T, or 2T1R in a horizontal plane"),
        (
            ("simulate", "acrobot_pbvs", "--set", "robot=tripod"),
            "accepted by scenarios: 3R3T, or 2T1R in a",
        ),
    ],
)
def test_what_a_command_does_not_take_is_refused_by_name(
    files, capsys, monkeypatch, tmp_path, arguments, words
):
    monkeypatch.chdir(tmp_path)
    changed = [
        str(files[word]) if word in files else word.replace("tripod", str(files["tripod"]))
        for word in arguments
    ]
    told = fails(capsys, *changed)
    assert words in " ".join(told.split())


@pytest.mark.parametrize(
    ("name", "grid"), [("tripod", "5,5,5"), ("upright_body", "5,1,5"), ("lift", "1,1,5")]
)
def test_a_workspace_of_points_and_of_an_upright_plane(files, capsys, tmp_path, name, grid):
    told = runs(capsys, "workspace", files[name], "--kind", "static", "--json", "--grid", grid,
                "--workers", "1", "--out", tmp_path / "made")  # fmt: skip
    assert 0.0 < json.loads(told)["workspaces"]["static"]["pose_share"] <= 1.0


def test_a_grid_off_a_plane_or_a_line_is_refused():
    corner = np.full(3, 1.0)
    grid = grid_by_count(-corner, corner, (3, 3, 3))
    for name, words in (("upright_body", "its plane y = 0.2"), ("lift", "its line x = 0.3")):
        with pytest.raises(StabilityError, match=words):
            check_grid(small_robot(name), grid)
    check_grid(small_robot("tripod"), grid)


@pytest.mark.parametrize("name", ["upright_body", "slope", "tilted_gravity"])
def test_sagging_cables_need_gravity_along_minus_z_of_their_frame(name):
    robot = small_robot(name)
    settings = CableRobotSettings(cables=CableSettings(model="catenary"))
    with pytest.raises(CableModelError, match="gravity along"):
        CompiledCableRobot(robot, settings)
    with pytest.raises(CableModelError, match="gravity along"):
        CableRobot(robot, settings)


def test_computed_torque_refuses_by_name():
    from cdpr_drake.systems.controllers.computed_torque import platform_dynamics

    for name in ("tripod", "upright_body", "tilted_gravity"):
        with pytest.raises(RobotFileError, match="accepted by computed torque"):
            platform_dynamics(small_robot(name))
    assert simulated_cables(small_robot("tripod").cable_set(), "elastic").count == 3


@pytest.mark.parametrize(
    ("name", "pose"),
    [
        ("upright_body", RigidTransform([0.1, 0.9, 0.3])),
        (
            "upright_body",
            RigidTransform(rotation_from_vector(np.array([0.1, 0, 0])), [0.1, 0.2, 0.3]),
        ),
        ("slope", RigidTransform([0.3, 0.1, 0.6])),
        ("level_point", RigidTransform([0.2, 0.0, 0.4])),
    ],
)
def test_a_pose_that_a_robot_cannot_have_is_refused(name, pose):
    robot = small_robot(name)
    with pytest.raises(TensionProblemError, match="cannot have"):
        static_at_pose(robot, pose, "elastic", False)
    near = robot.joint().nearest(pose)
    assert robot.joint().nearest(near).IsNearlyEqualTo(near, 1e-12)
    wrench_balance(robot, near)
