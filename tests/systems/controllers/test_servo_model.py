"""What controllers believe: the truth, with the errors that a scenario asks for and no others."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.beliefs import believed_robot, random_shifts
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo

ROUND_OFF = 1e-12
"""Of lengths of order one [m]."""

ROBOT = load_robot("acrobot_small")


def believe(*overrides, name="acrobot_pbvs"):
    overrides = [f"perturbations.{item}" if "seed" not in item else item for item in overrides]
    scenario = load_scenario(name, overrides)
    return believed_robot(scenario, load_robot(scenario.robot))


def test_without_perturbations_it_is_the_robot():
    model = believe()
    for name in ("p_WA", "p_PB", "stiffness", "pulley_radius", "swivel_axis", "linear_weight"):
        np.testing.assert_array_equal(getattr(model.cables, name), getattr(ROBOT.cable_set(), name))
    np.testing.assert_array_equal(model.cables.p_WA, ROBOT.exit_points())
    assert max(pose_error(model.X_PC, ROBOT.camera_mount("onboard").pose.transform())) < ROUND_OFF
    expected = load_scenario("acrobot_pbvs").initial_pose.transform()
    assert max(pose_error(model.X_WP0, expected)) < ROUND_OFF


@pytest.mark.parametrize("kind", ["exit_points", "anchor_points"])
def test_one_direction_or_one_for_each_cable(kind):
    truth = {"exit_points": ROBOT.exit_points(), "anchor_points": ROBOT.anchor_points()}[kind]

    def shifts(model):
        return {"exit_points": model.cables.p_WA, "anchor_points": model.cables.p_PB}[kind] - truth

    apart = shifts(believe(f"{kind}=0.02"))
    together = shifts(believe(f"{kind}=0.02", f"{kind}_together=true"))
    for found in (apart, together):
        np.testing.assert_allclose(np.linalg.norm(found, axis=0), 0.02, rtol=1e-9)
    np.testing.assert_allclose(together, together[:, :1] * np.ones(8), atol=ROUND_OFF)
    assert np.ptp(apart, axis=1).min() > 1e-3


def test_explicit_shifts_add_to_random_ones():
    rows = np.arange(24.0).reshape(8, 3) / 1e3
    words = str(rows.tolist())
    random = believe("exit_points=0.02", "anchor_points=0.01")
    both = believe(
        "exit_points=0.02",
        "anchor_points=0.01",
        f"exit_point_shifts={words}",
        f"anchor_point_shifts={words}",
    )
    np.testing.assert_allclose(both.cables.p_WA - random.cables.p_WA, rows.T, atol=ROUND_OFF)
    np.testing.assert_allclose(both.cables.p_PB - random.cables.p_PB, rows.T, atol=ROUND_OFF)


def test_poses_are_off_by_the_size_that_was_asked_for():
    exact = believe()
    model = believe(
        "initial_pose_shift={distance: 0.07, angle_deg: 7}",
        "camera_pose_shift={distance: 0.01, angle_deg: 3}",
    )
    for found, truth, distance, angle in (
        (model.X_WP0, exact.X_WP0, 0.07, 7.0),
        (model.X_PC, exact.X_PC, 0.01, 3.0),
    ):
        assert pose_error(truth, found)[0] == pytest.approx(distance, rel=1e-9)
        assert pose_error(truth, found)[1] == pytest.approx(np.radians(angle), rel=1e-9)


def test_one_perturbation_does_not_change_another():
    alone = believe("initial_pose_shift={distance: 0.07, angle_deg: 7}")
    beside = believe(
        "initial_pose_shift={distance: 0.07, angle_deg: 7}",
        "camera_pose_shift={distance: 0.02}",
        "exit_points=0.01",
    )
    assert max(pose_error(alone.X_WP0, beside.X_WP0)) < ROUND_OFF


def test_seeds_choose_the_directions_of_all_random_errors():
    shift = "initial_pose_shift={distance: 0.07, angle_deg: 7}"
    one, again, other = (believe(shift, f"seed={seed}") for seed in (3, 3, 4))
    assert max(pose_error(one.X_WP0, again.X_WP0)) == 0.0
    assert min(pose_error(one.X_WP0, other.X_WP0)) > 1e-3


def test_a_planar_robot_is_believed_in_its_plane():
    model = believe("initial_pose_shift={distance: 0.05, angle_deg: 5}", name="planar_pbvs")
    truth = load_scenario("planar_pbvs").initial_pose.transform()
    assert model.is_planar()
    assert model.X_WP0.translation()[2] == pytest.approx(truth.translation()[2], abs=ROUND_OFF)
    turn = (truth.rotation().inverse() @ model.X_WP0.rotation()).ToAngleAxis()
    assert abs(turn.axis()[2]) == pytest.approx(1.0, abs=1e-6)


def test_random_directions_favour_none():
    shifts = random_shifts(4000, 1.0, np.random.default_rng(0))
    assert np.linalg.norm(np.mean(shifts, axis=1)) < 0.05  # 3 / sqrt(4000)


def test_slack_is_paid_out_on_the_given_cables_only():
    def lengths(*overrides):
        servo = build_visual_servo(
            load_scenario("acrobot_pbvs", ["camera.kind=projected", *overrides])
        )
        return servo.diagram.GetOutputPort("unstrained_lengths").Eval(servo.make_context())

    slack = np.array([0.02, 0.02, 0, 0, 0, 0, 0, 0.01])
    found = lengths(f"perturbations.slack={slack.tolist()}")
    np.testing.assert_allclose(found - lengths(), slack, atol=ROUND_OFF)


@pytest.mark.parametrize(
    "pattern",
    [["target.kind=tag"], ["target.kind=circles", "controller.scheme=circles"]],
    ids=["points", "ellipses"],
)
def test_the_image_is_measured_beside_what_it_shows(pattern):
    """All points move alike; of ellipses the centres move and the shapes stay."""

    def marks(*overrides):
        servo = build_visual_servo(
            load_scenario(
                "acrobot_pbvs",
                ["camera.kind=projected", "camera.pixel_noise=0", *pattern, *overrides],
            )
        )
        simulator = Simulator(servo.diagram, servo.make_context())
        simulator.AdvanceTo(1e-4)
        mark = servo.target.mark
        return servo.diagram.GetOutputPort(mark).Eval(simulator.get_context())

    moved = marks("perturbations.image_bias=[3, -2]") - marks()
    rows = moved.reshape(4, 2) if len(moved) == 8 else moved.reshape(2, 5)
    np.testing.assert_allclose(rows[:, :2], np.tile([3.0, -2.0], (len(rows), 1)), atol=1e-9)
    np.testing.assert_allclose(rows[:, 2:], 0.0, atol=1e-9)


def test_a_biased_image_is_servoed_to_the_wrong_place():
    """4 px at a focal length of some 860 px and 9 cm: 0.4 mm beside."""
    scenario = load_scenario(
        "acrobot_pbvs", ["camera.kind=projected", "perturbations.image_bias=[4, 0]"]
    )
    result = run_scenario(scenario)
    end = pose_from_row(result.log["X_WP"][-1])
    X_CO = result.servo.X_CO(end, float(result.log["time"][-1]))
    off = result.servo.pinhole.project(X_CO.translation()[:, np.newaxis])[:, 0]
    wanted = result.servo.pinhole.project(result.servo.X_CdO.translation()[:, np.newaxis])[:, 0]
    np.testing.assert_allclose(off - wanted, [-4.0, 0.0], atol=1.5)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("perturbations.exit_point_shifts=[[0, 0, 0]]", "found 1 rows; accepted: one for each of"),
        ("perturbations.slack=[0.01, 0.02]", "found 2 rows"),
        ("perturbations.slack=[0.01, -0.02, 0, 0, 0, 0, 0, 0]", r"accepted: n numbers >= 0 \[m\]"),
        ("perturbations.exit_pionts=0.01", "did you mean exit_points"),
        ("perturbations.initial_pose_shift={angle: 3}", "did you mean angle_deg"),
        ("perturbations.initial_pose_shift.angle_deg=200", "<= 180"),
    ],
)
def test_bad_input_is_refused(override, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("acrobot_pbvs", [override])
