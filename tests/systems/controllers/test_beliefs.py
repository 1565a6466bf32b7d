"""What controllers believe: the truth, with the errors that a scenario asks for and no others."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.beliefs import believed_robot, random_shifts
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from tests.systems.controllers.controller_cases import PROJECTED, compiled_run

ROUND_OFF = 1e-12
"""Of lengths of order one [m]."""

ROBOT = load_robot("acrobot_small")
TURNED = "initial_pose_shift={distance: 0.07, angle_deg: 7}"


def believe(*overrides, name="acrobot_pbvs"):
    overrides = [f"perturbations.{item}" if "seed" not in item else item for item in overrides]
    scenario = load_scenario(name, overrides)
    return believed_robot(scenario, load_robot(scenario.robot))


def test_without_perturbations_the_robot_is_believed():
    model, truth = believe(), ROBOT.cable_set()
    for name in ("p_WA", "p_PB", "stiffness", "pulley_radius", "swivel_axis", "linear_weight"):
        np.testing.assert_array_equal(getattr(model.cables, name), getattr(truth, name))
    np.testing.assert_array_equal(model.cables.p_WA, ROBOT.exit_points())
    np.testing.assert_array_equal(model.cables.p_PB, ROBOT.anchor_points())
    assert max(pose_error(model.X_PC, ROBOT.camera_mount("onboard").pose.transform())) < ROUND_OFF
    expected = load_scenario("acrobot_pbvs").initial_pose.transform()
    assert max(pose_error(model.X_WP0, expected)) < ROUND_OFF
    assert model.motions == (0, 1, 2, 3, 4, 5)
    assert model.cable_speed == ROBOT.winch.rated_cable_speed()


POINTS = {"exit_points": ("p_WA", ROBOT.exit_points()),
          "anchor_points": ("p_PB", ROBOT.anchor_points())}  # fmt: skip


@pytest.mark.parametrize("kind", POINTS)
def test_points_are_off_in_one_direction_or_in_one_for_each_cable(kind):
    name, truth = POINTS[kind]
    apart, together, other = (
        getattr(believe(f"{kind}=0.02", more).cables, name) - truth
        for more in ("seed=1", f"{kind}_together=true", "seed=2")
    )
    for shifts in (apart, together, other):
        np.testing.assert_allclose(np.linalg.norm(shifts, axis=0), 0.02, rtol=1e-9)
    np.testing.assert_allclose(together, together[:, :1] * np.ones(8), atol=ROUND_OFF)
    assert np.ptp(apart, axis=1).min() > 1e-3
    assert not np.any(np.isclose(apart, other, rtol=0.0, atol=1e-9))


def test_explicit_shifts_add_to_random_ones():
    rows = np.arange(24.0).reshape(8, 3) / 1e3
    words = str(rows.tolist())
    sizes = ("exit_points=0.02", "anchor_points=0.01")
    random = believe(*sizes)
    both = believe(*sizes, f"exit_point_shifts={words}", f"anchor_point_shifts={words}")
    for name, _ in POINTS.values():
        shift = getattr(both.cables, name) - getattr(random.cables, name)
        np.testing.assert_allclose(shift, rows.T, atol=ROUND_OFF)


def test_poses_are_off_by_the_size_of_the_scenario():
    exact, model = believe(), believe(TURNED, "camera_pose_shift={distance: 0.01, angle_deg: 3}")
    for found, truth, distance, angle in (
        (model.X_WP0, exact.X_WP0, 0.07, 7.0),
        (model.X_PC, exact.X_PC, 0.01, 3.0),
    ):
        assert pose_error(truth, found)[0] == pytest.approx(distance, rel=1e-9)
        assert pose_error(truth, found)[1] == pytest.approx(np.radians(angle), rel=1e-9)


def test_one_perturbation_does_not_change_another():
    alone = believe(TURNED)
    beside = believe(TURNED, "camera_pose_shift={distance: 0.02}", "exit_points=0.01")
    assert max(pose_error(alone.X_WP0, beside.X_WP0)) < ROUND_OFF


def test_seeds_choose_the_directions_of_all_random_errors():
    first, again, other = (believe(TURNED, f"seed={seed}").X_WP0 for seed in (3, 3, 4))
    assert max(pose_error(first, again)) == 0.0
    assert min(pose_error(first, other)) > 1e-3


def test_a_planar_robot_is_believed_in_its_plane():
    model = believe("initial_pose_shift={distance: 0.05, angle_deg: 5}", name="planar_pbvs")
    truth = load_scenario("planar_pbvs").initial_pose.transform()
    assert model.is_planar()
    assert model.X_WP0.translation()[2] == pytest.approx(truth.translation()[2], abs=ROUND_OFF)
    turn = (truth.rotation().inverse() @ model.X_WP0.rotation()).ToAngleAxis()
    assert abs(turn.axis()[2]) == pytest.approx(1.0, abs=1e-6)


def test_random_shifts_have_one_length_and_favour_no_direction():
    shifts = random_shifts(4000, 0.01, np.random.default_rng(0))
    np.testing.assert_allclose(np.linalg.norm(shifts, axis=0), 0.01, rtol=ROUND_OFF)
    # The mean of n independent unit vectors has components of standard deviation 1 / sqrt(3 n).
    assert np.all(np.abs(np.mean(shifts, axis=1)) < 4.0 * 0.01 / np.sqrt(12000))
    np.testing.assert_array_equal(random_shifts(4, 0.0, np.random.default_rng(0)), np.zeros((3, 4)))


def test_a_simulation_keeps_the_truth_of_what_is_believed_wrongly():
    changes = ["perturbations.exit_points=0.02",
        "perturbations.camera_pose={position: [0.01, 0, 0], angles_deg: [0, 0, 5]}",
        "perturbations.initial_pose={position: [0.13, -0.02, 0.31]}"]  # fmt: skip
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, *changes])
    X_PC = ROBOT.camera_mount("onboard").pose.transform()
    error = scenario.perturbations.camera_pose.transform()
    assert max(pose_error(X_PC @ error, believed_robot(scenario, ROBOT).X_PC)) < ROUND_OFF
    servo = build_visual_servo(scenario)
    cables = servo.cable_robot.GetSubsystemByName("cables").cables()
    np.testing.assert_array_equal(cables, ROBOT.cable_set().without_pulleys().packed())
    assert max(pose_error(X_PC, servo.X_PC)) < ROUND_OFF
    context = servo.make_context()
    for name, pose in (
        ("X_WP", scenario.initial_pose),
        ("X_WP_estimated", scenario.perturbations.initial_pose),
    ):
        found = servo.diagram.GetOutputPort(name).Eval(context)
        assert max(pose_error(pose.transform(), found)) < ROUND_OFF, name


def test_slack_is_paid_out_on_the_given_cables_only():
    def lengths(*overrides):
        servo = build_visual_servo(load_scenario("acrobot_pbvs", [PROJECTED, *overrides]))
        return servo.diagram.GetOutputPort("unstrained_lengths").Eval(servo.make_context())

    slack = np.array([0.02, 0.02, 0, 0, 0, 0, 0, 0.01])
    found = lengths(f"perturbations.slack={slack.tolist()}")
    np.testing.assert_allclose(found - lengths(), slack, atol=ROUND_OFF)


@pytest.mark.parametrize(
    "pattern", [["target.kind=tag"], ["target.kind=circles", "controller.scheme=circles"]]
)
def test_an_image_is_measured_beside_what_it_shows(pattern):
    """All points move alike; of ellipses the centres move and the shapes stay."""

    def marks(*overrides):
        changes = [PROJECTED, "camera.pixel_noise=0", *pattern, *overrides]
        servo = build_visual_servo(load_scenario("acrobot_pbvs", changes))
        simulator = Simulator(servo.diagram, servo.make_context())
        simulator.AdvanceTo(1e-4)
        return servo.diagram.GetOutputPort(servo.target.mark).Eval(simulator.get_context())

    moved = marks("perturbations.image_bias=[3, -2]") - marks()
    rows = moved.reshape(4, 2) if len(moved) == 8 else moved.reshape(2, 5)
    np.testing.assert_allclose(rows[:, :2], np.tile([3.0, -2.0], (len(rows), 1)), atol=1e-9)
    np.testing.assert_allclose(rows[:, 2:], 0.0, atol=1e-9)


def test_a_biased_image_is_servoed_to_the_wrong_place():
    """4 px at a focal length of some 860 px and 9 cm: 0.4 mm beside."""
    result = compiled_run("acrobot_pbvs", "perturbations.image_bias=[4, 0]")
    end = pose_from_row(result.log["X_WP"][-1])
    X_CO = result.built.X_CO(end, float(result.log["time"][-1]))
    off, wanted = (
        result.built.pinhole.project(X.translation()[:, np.newaxis])[:, 0]
        for X in (X_CO, result.built.X_CdO)
    )
    np.testing.assert_allclose(off - wanted, [-4.0, 0.0], atol=1.5)
