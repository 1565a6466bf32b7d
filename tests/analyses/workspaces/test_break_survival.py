"""Single breaks of cables from a pose, in a batch, against runs of the scenario in a diagram."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.runs.breaks import BRAKE, REDISTRIBUTE, STOP
from cdpr_drake.analyses.workspaces import break_survival
from cdpr_drake.analyses.workspaces.break_survival import (
    CALM,
    BreakOutcomes,
    BreakRequest,
    breaks_at,
)
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

SCENARIO = "acrobot_broken_redistributed"
POSITION = np.array([0.05, 0.02, 0.35])
AFTER = 0.3

NEAR = 0.01
"""Sensors are ideal in both; rows of the diagram's log are 2 ms apart, and its camera and servo go
on at 25 Hz."""

BREAK = 0.01
"""When the cable breaks in both, so that tensions are still those at the start [s]."""


def request(**changes):
    asked = {"scenario": load_scenario(SCENARIO), "velocity": np.zeros(3), "after": AFTER}
    return BreakRequest(**{**asked, **changes})


def listed(numbers):
    return "[" + ", ".join(f"{x:.9g}" for x in numbers) + "]"


def test_it_is_near_to_runs_in_a_diagram(monkeypatch):
    """A servo that sees its goal from the start, and hardly moves, holds the platform there."""
    robot, scenario = load_robot("acrobot_large"), load_scenario(SCENARIO)
    X_WP = RigidTransform(POSITION)
    X_CO = pose_from_angles(np.array([0.0, 0.0, 0.35]), np.radians([180.0, 0.0, 0.0]))
    X_WO = X_WP @ robot.camera_mount(scenario.camera.mount).pose.transform() @ X_CO
    cable = 5
    monkeypatch.setattr(break_survival, "SETTLES", BREAK)
    found = breaks_at(robot, X_WP, request(reactions=(STOP, REDISTRIBUTE)))
    compared = cdpr.compare_reactions(
        SCENARIO, cable=cable, time=BREAK, after=AFTER, reactions=(STOP, REDISTRIBUTE),
        overrides=[
            "integration.engine=compiled", f"initial_pose.position={listed(POSITION)}",
            "initial_pose.angles_deg=[0, 0, 0]", "desired.position=[0, 0, 0.35]",
            "desired.angles_deg=[180, 0, 0]", f"target.pose.position={listed(X_WO.translation())}",
            f"target.pose.angles_deg={listed(np.degrees(angles_from_rotation(X_WO.rotation())))}",
            "estimator.kind=measured", "controller.lambda_0=1e-9",
            "controller.lambda_infinity=1e-9", "sensors.tracker=ideal", "sensors.tension=ideal",
            "sensors.encoder=ideal",
        ],
    )  # fmt: skip
    for k, name in enumerate((STOP, REDISTRIBUTE)):
        row = compared.rows[name]
        assert found.excursion[cable, k] == pytest.approx(row["excursion_m"], rel=NEAR)
        assert found.fastest[cable, k] == pytest.approx(row["largest_speed_m_s"], rel=NEAR)
        assert found.leaves[cable, k] == row["leaves"]


def test_a_platform_that_flies_is_hit_where_it_passes():
    """Stopped, it goes on for at least the way of the time that brakes take to close."""
    robot, speed = load_robot("acrobot_large"), 0.2
    velocity = np.array([speed, 0.0, 0.0])
    asked = request(reactions=(STOP,), velocity=velocity, after=0.15)
    found = breaks_at(robot, RigidTransform(POSITION), asked)
    assert np.all(found.fastest > 0.9 * speed)
    assert np.all(found.excursion > 0.9 * speed * BRAKE)
    hung = break_survival._Hung(robot, asked)
    at = hung.fly_to(RigidTransform(POSITION)).state.arrays[0][0]
    assert at[4] == pytest.approx(POSITION[0], abs=1.1e-3 * speed)  # a step of control
    assert at[10] == pytest.approx(speed, rel=0.05)


def test_what_is_best_and_worst():
    far = np.array([[0.3, 0.1], [0.2, np.nan], [0.05, 0.04]])
    leaves = np.array([[False, True], [True, True], [False, False]])
    rests = np.array([[True, True], [True, False], [True, True]])
    outcomes = BreakOutcomes((STOP, REDISTRIBUTE), far, far, far, leaves, rests)
    np.testing.assert_array_equal(outcomes.best(), [0, 0, 1])
    assert outcomes.worst() == (1, 0, 0.2, False)
    saved = replace(outcomes, leaves=np.zeros((3, 2), bool))
    np.testing.assert_array_equal(saved.best(), [1, 0, 1])
    assert saved.worst() == (1, 0, 0.2, True)


def test_spare_cables_save_what_few_do_not():
    """Each cable doubled: where one of a pair breaks, the other one stays; six cables hold what
    five do not. Until the end of the run, since the fall has only begun by then."""
    robot = load_robot("acrobot_large")
    few = replace(robot, name="six", cables=robot.cables[:6])
    more = [replace(one, name=f"{one.name}b") for one in robot.cables]
    doubled = replace(robot, name="double", cables=[*robot.cables, *more])
    some = request(reactions=(REDISTRIBUTE,), after=0.6)
    spare = breaks_at(doubled, RigidTransform(POSITION), some)
    least = breaks_at(robot, RigidTransform(POSITION), some)
    assert np.max(spare.excursion) < 0.2 * np.max(least.excursion)
    assert spare.worst()[3]
    lost = breaks_at(few, RigidTransform(POSITION), some)
    assert lost is None or not np.any(lost.saved)


def test_a_pose_that_is_not_held_has_no_answer():
    high = RigidTransform([0.0, 0.0, 1.19])
    assert breaks_at(load_robot("acrobot_large"), high, request()) is None


def check(**changes):
    return lambda: request(**changes).check(load_robot("acrobot_large"))


REFUSALS = [
    (check(reactions=("pray",)), "reactions 'pray' is unknown"),
    (check(reactions=()), "reactions: found none"),
    (check(after=CALM), "after: found 0.1"),
    (check(velocity=np.array([0.0, 1e9, 0.0])), "moving: found .*1000000000.*; accepted: three"),
    (check(velocity=np.array([0.0, np.nan, 0.0])), "moving: found .*; accepted: three finite"),
    (check(scenario=load_scenario("acrobot_pbvs")), "winches.mode: found velocity"),
]


@pytest.mark.parametrize(("call", "words"), REFUSALS)
def test_what_is_refused(call, words):
    with pytest.raises(WorkspaceError, match=words):
        call()
