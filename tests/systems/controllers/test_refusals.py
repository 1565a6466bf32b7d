"""Sections of controllers that make no sense are refused in one line that names them."""

import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.workspaces.stability import assess_stability
from cdpr_drake.control.force_balance import FORCE
from cdpr_drake.errors import PlanningError, ScenarioError, StabilityError, TensionProblemError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.horizon import Horizon
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.systems.controllers.controller_cases import in_plant

SCENARIOS = {
    "acrobot_broken_redistributed": [
        ("emergency={reaction: stop, motion: continue}", "emergency.motion: found continue"),
        ("failures=null", "emergency: found a section without failures"),
        ("winches={}; torque_control=null",
         "emergency.reaction: found redistribute with winches.mode velocity"),
        ("emergency={reaction: stop, watch: {}}; winches={}; torque_control=null",
         "emergency.watch: found a section with winches"),
        ("emergency={reaction: stop, watch: {bandwidth: 90}}",
         "emergency.watch: bandwidth of a motor's watch"),
    ],
    "acrobot_ibvs": [
        ("controller.points=[0, 1]",
         "controller.points: found 2 image points; accepted: at least 3"),
        ("controller.points=[0, 1, 4]",
         "controller.points: found [0.0, 1.0, 4.0]; accepted: whole numbers below 4"),
        ("controller.points=[0, 1, 1]",
         "controller.points: found [0, 1, 1]; accepted: each point once"),
        ("controller.points=[0, 1, 2]; desired.position=[0.04242640687119285, 0, 0.1]",
         "is singular: its 6 features control 5 motions"),
        ("controller.partition={}",
         "controller.partition: found a section with ibvs; accepted with: partitioned"),
        ("controller.switching={}",
         "controller.switching: found a section with ibvs; accepted with: switching"),
        ("controller.free_rotation=true", "controller.free_rotation: found true with ibvs"),
    ],
    "acrobot_circles": [
        ("controller.scheme=ibvs", "found ibvs on circles"),
        ("controller.scheme=pbvs", "found pbvs on circles"),
        ("controller.scheme=partitioned", "found partitioned on circles"),
        ("desired.position=[0.01, 0, 0.09]", "desired: found circles beside or tilted"),
    ],
    "acrobot_switching": [
        ("controller.free_rotation=true", "controller.free_rotation: found true with switching"),
        ("stability={}", "stability: found a section with controller.scheme switching"),
    ],
    "acrobot_partitioned": [
        ("controller.partition={segment: [1, 1]}",
         "controller.partition.segment: found [1, 1]; accepted: two different ones"),
        ("controller.partition={segment: [0.5, 1]}",
         "controller.partition.segment: found [0.5, 1.0]; accepted: whole numbers"),
        ("controller.partition={edge_distance: 200}",
         "controller.partition.edge_distance: found 200 [px]; accepted: below"),
        ("stability={}",
         "stability: found a section with controller.scheme partitioned, whose law the criterion"),
    ],
    "planar_pbvs": [
        ("controller.scheme=partitioned; target.kind=dots",
         "controller.scheme: found partitioned on planar, a planar robot"),
    ],
    "acrobot_pbvs": [
        ("controller.scheme=circles", "accepted: target.kind=circles"),
        ("controller.yaw={angle_deg: 5}",
         "controller.yaw: found a secondary task, but pbvs leaves no motion free"),
        ("target.kind=tag_bundle", "target.tags: found none; accepted: at least one tag"),
        ("next_tasks=[{time: 1, desired: {position: [0, 0, -1]}}]",
         "next_tasks[0].desired.position: found (0, 0, -1); accepted: z > 0"),
        ("open_loop={duration: 0}", "> 0"),
        ("open_loop={waypoints: [{pose: {position: [0, 0, 0.2]}}]}", "duration: missing"),
        ("open_loop={time: 3}", "unknown key"),
        ("open_loop={waypoints: [{pose: {position: [0, 0, 3]}, duration: 2}]}",
         "open_loop.waypoints[0].pose.position: found (0, 0, 3), outside the frame"),
        ("perturbations.exit_point_shifts=[[0, 0, 0]]", "found 1 rows; accepted: one for each of"),
        ("perturbations.slack=[0.01, 0.02]", "found 2 rows"),
        ("perturbations.slack=[0.01, -0.02, 0, 0, 0, 0, 0, 0]", "accepted: n numbers >= 0 [m]"),
        ("perturbations.exit_pionts=0.01", "did you mean exit_points"),
        ("perturbations.initial_pose_shift={angle: 3}", "did you mean angle_deg"),
        ("perturbations.initial_pose_shift.angle_deg=200", "<= 180"),
    ],
    "acrobot_eye_to_hand": [
        ("target.motion.velocity=[0.1, 0, 0]",
         "target.motion: found a motion of a target that the platform carries"),
        ("camera.mount=onboard",
         "camera.mount: found 'onboard', which is not in the world"),
    ],
    "acrobot_circling_ring": [
        ("target.motion.waypoints=[{time: 2, pose: {position: [0, 0, 0]}}, {time: 1, "
         "pose: {position: [0, 0, 0]}}]",
         "target.motion.waypoints: found the times [2.0, 1.0]; accepted: growing ones"),
    ],
    "acrobot_against_wind": [
        ("force_control={kind: impedance}", "stiffness: found none with impedance"),
        ("force_control={kind: hybrid}", "axes: found none with hybrid; accepted: "),
        ("force_control={kind: tracking, force: [0, 0, 1]}", "force: found one with"),
        ("integration.engine=compiled", "found compiled beside force_control"),
        ("controller.balance=force", "balance: found force beside force_control"),
        ("predictive={}", "force_control: found beside predictive"),
        ("disturbances={pushes: []}", "disturbances.pushes: found none"),
        ("force_control=null; integration.engine=compiled",
         "integration.engine: found compiled beside disturbances; accepted: plant"),
    ],
    "acrobot_led_by_hand": [
        ("force_control.mass=[0, 1, 1, 1, 1, 1]", "mass: found 0; accepted: above 0"),
    ],
    "acrobot_table_edge": [
        ("force_control.axes=[w]", "axes"),
    ],
    "planar_computed_torque": [
        ("force_control={kind: tracking, reject: true}", "found a section for planar, 2T1R"),
        ("predictive.steps=1", "steps"),
    ],
}  # fmt: skip
"""By scenario: changes and what is said of them."""


@pytest.mark.parametrize(
    ("name", "changes", "words"), [(name, *row) for name, rows in SCENARIOS.items() for row in rows]
)
def test_a_scenario_without_sense_is_refused(name, changes, words):
    with pytest.raises(ScenarioError) as refused:
        load_scenario(name, changes.split("; "))
    message = str(refused.value)
    assert words in message
    for line in message.splitlines():
        assert f"{name}.yaml:" in line or line.startswith("overrides ")


def planar_run(*changes):
    return TensionRun(load_scenario("planar_computed_torque", changes)).simulate()


def horizon_of_one_step():
    robot = load_robot("acrobot_large")
    limits = MotionLimits(lower=1.0, upper=60.0, cable_speed=robot.winch.rated_cable_speed())
    task = PathTask(robot.cable_set().without_pulleys(), platform_dynamics(robot), limits)
    ends = RigidTransform([0.0, 0.0, 0.3]), RigidTransform([0.1, 0.0, 0.3])
    return Horizon(task, PoseTrajectory(ends, (1.5,)), 1, 0.01, None)


def block(*words, **more):
    return TensionDistributor(in_plant("acrobot_large"), *words, **more)


CALLS = {
    "stability of a partition": (lambda: assess_stability("acrobot_small", scheme="partitioned"),
        StabilityError, "scheme: found partitioned; accepted: pbvs, pbvs-line"),
    "stability of a switch": (lambda: assess_stability("acrobot_small", scheme="switching"),
        StabilityError, "scheme: found switching; accepted: pbvs, pbvs-line"),
    "horizon": (horizon_of_one_step, PlanningError, "horizon: found 1 steps"),
    "points to see": (lambda: planar_run("predictive.mount=onboard"),
        ScenarioError, "predictive.points: found null"),
    "mount to see": (
        lambda: planar_run("predictive.mount=nose", "predictive.points=[[0, 0, 0]]"),
        ScenarioError, "predictive.mount: found 'nose'; accepted: onboard, on the platform"),
    "method": (lambda: block("foo"), TensionProblemError, "method: found foo"),
    "limits": (lambda: block(limits=(9.0, 1.0)), TensionProblemError, "lower <= upper"),
    "reference": (lambda: block("reference_program"), TensionProblemError, "no reference"),
}  # fmt: skip


@pytest.mark.parametrize("case", CALLS)
def test_a_call_without_sense_is_refused(case):
    call, error, words = CALLS[case]
    with pytest.raises(error) as refused:
        call()
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


REDUNDANCIES = {("acrobot_large", None): 2, ("planar", None): 1,
                ("acrobot_large", FORCE): 5, ("planar", FORCE): 2}  # fmt: skip


@pytest.mark.parametrize(("name", "balance"), REDUNDANCIES)
def test_a_method_that_does_not_take_the_redundancy_is_refused(name, balance):
    r = REDUNDANCIES[name, balance]
    more = {} if balance is None else {"balance": balance}
    refused = [method for method in METHODS if not METHODS[method].takes(r)]
    assert refused
    for method in refused:
        with pytest.raises(TensionProblemError) as caught:
            TensionDistributor(in_plant(name), method, **more)
        message = str(caught.value)
        assert f"{method}: found redundancy m - n = {r}; accepted: " in message
        assert "\n" not in message
