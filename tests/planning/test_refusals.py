"""What cannot be planned is refused in one line that names it."""

from dataclasses import fields, replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.solvers import MathematicalProgram

from cdpr_drake.analyses.planning.robot_path_task import make_path
from cdpr_drake.errors import CdprError, PlanningError, WrenchSetError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.failures import check_held
from cdpr_drake.planning.free_path import FreePathProgram
from cdpr_drake.planning.input_shaping import make_shaper
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.path_timing_program import PathTimingProgram
from cdpr_drake.planning.place_constraints import (
    CableClearance,
    ObstacleClearance,
    PlaceWithin,
    StiffnessAbove,
    TargetInView,
)
from cdpr_drake.planning.pose_coordinates import BodyState, PlaceAndAngles
from cdpr_drake.planning.reconfiguration import Rails, RailTask
from cdpr_drake.planning.servo_constraint import StableServo
from cdpr_drake.planning.tension_constraints import LengthRates
from cdpr_drake.proofs.box_timing import time_within_box
from cdpr_drake.proofs.path_in_sets import proven_motion, proven_path
from cdpr_drake.proofs.proven_sets import PoseSets
from cdpr_drake.proofs.timed_motion import motion_in_time
from cdpr_drake.stability.perturbation_bounds import BASELINE
from cdpr_drake.trajectories.pose_path import smooth_path
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.planning.planning_cases import (
    MARK,
    PATHS,
    SETS_BOX,
    case,
    damped_acrobot,
    plain_acrobot,
    pose,
    task_of,
)
from tests.planning.test_constraints import servo
from tests.planning.test_free_path import GOAL as FREE_GOAL
from tests.planning.test_free_path import START as FREE_START
from tests.planning.test_motions_in_sets import GOAL, LEFT, RIGHT, START, gate, wall_sets
from tests.planning.test_shaping_and_rails import W, rail_task

HERE, ONES = PlaceAndAngles(), np.ones(3)


# Calls.


def cables():
    return damped_acrobot()[1].cables


def variables(product=False):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(7, "x")
    return prog, np.array([x[0] * x[1], *x[1:6]]) if product else x


def view(points=MARK):
    return TargetInView(HERE, RigidTransform(), (0.6, 0.5), points, 0.1)


def free(knots=8, duration=(1.0, 1.5), goal=FREE_GOAL):
    return FreePathProgram(case("acrobot_large")[1], FREE_START, goal, knots, duration)


def few_cables():
    _, task, _ = case("acrobot_large")
    c = task.cables
    c = type(c)(**{f.name: np.asarray(getattr(c, f.name))[..., :5] for f in fields(c)})
    return PathTask(c, task.dynamics, task.limits)


def along(*poses, corners="smooth", stations=200, resist=None, **settings):
    robot = load_robot("acrobot_large")
    wrenches = None if resist is None else SpatialSet(box=np.array(resist))
    task = task_of(robot, resist=wrenches, **settings)
    return plan_along_path(task, make_path(robot, list(poses), corners), stations)


def over(corners, **settings):
    """Through a pose where the platform cannot be held."""
    return along(
        pose(0, 0, 0.2), pose(0.5, 0.4, 0.6), pose(0, 0.1, 0.2), corners=corners, **settings
    )


def law(change, damping=None, stations=10):
    """Own terms of a law of time, and its solution."""
    _, task, path = case("acrobot_large")
    if damping:
        task = replace(task, dynamics=replace(task.dynamics, damping=damping))
    program = PathTimingProgram(task, path, stations)
    with np.errstate(divide="ignore"):
        change(program)
    return program.Solve()


def stiff(program):
    rows = len(program.values("tensions").offset)
    program.AddLinearConstraint(np.eye(rows), 40.0, 60.0, of="tensions", name="stiff")


def stop(program):
    program.prog().AddBoundingBoxConstraint(0.0, 0.0, program.speeds_squared()[10:13])


def resisting(poses, force=9.0):
    return along(*poses, resist=[0.0, 0, 0, force, 0, 0])


def held_under_wrench():
    robot = load_robot("acrobot_large")
    wrenches = SpatialSet(box=np.array([0.0, 0, 0, 9.0, 0, 0]))
    check_held(task_of(robot, resist=wrenches), PATHS["acrobot_large"][1][0], "start")


def elliptic():
    task_of(load_robot("planar"), None, resist=SpatialSet(ellipsoid=np.ones(6)))


def in_sets(start=START, goal=GOAL, sets=None, **more):
    return proven_path(sets or wall_sets(), start, goal, 0.1, **more)


def in_time(start=LEFT, goal=RIGHT, **more):
    return motion_in_time(gate(), start, goal, plain_acrobot(), SETS_BOX, **more)


def turning():
    return smooth_path([pose(0, 0, 0.3), pose(0.1, 0, 0.3, 0, 0, 6)], 0.1)


def in_box(path, box=SETS_BOX, *moments):
    return time_within_box(plain_acrobot(), path, box, 100, *moments)


def rails(**changes):
    r = rail_task().rails
    return Rails(**{f.name: getattr(r, f.name) for f in fields(r)} | changes)


def rail(poses, wrenches=None):
    task = rail_task()
    return RailTask(task.case, task.rails, poses, *([wrenches] if wrenches else []))


def at_an_exit():
    task = rail_task()
    return RigidTransform(task.rails.bases[:, 0] - task.case.cables.p_PB[:, 0])


def two_sets():
    sets = wall_sets()
    return PoseSets(sets.lower[[0, 2]], sets.upper[[0, 2]], sets.axes, sets.about)


def flat_path():
    return in_sets().path


HEAVY = SpatialSet(box=np.array([0, 0, 0, 1e4, 0, 0]))
HELD = [pose(0, 0, 0.2), pose(0.4, 0.4, 1.0)]
UNDER = r"\(0, 0, 0\) N m, \(-?9, 0, 0\) N to resist; .*C\d"

REFUSALS = {
    # Constraints.
    "variables": (lambda: LengthRates(cables(), HERE, 1.0).AddTo(*variables()),
     r"cable speeds: found 7 variables .* 12 or 18"),
    "not affine": (lambda: view().AddTo(*variables(True)), "not affine"),
    "rate": (lambda: LengthRates(cables(), HERE, 0.0), "rate: found 0 m/s"),
    "obstacles": (lambda: ObstacleClearance(cables(), HERE, [], [], 0.0, 0.0),
     "obstacles: found none"),
    "distance": (lambda: CableClearance(cables(), HERE, -1.0), "distance: found -1 m"),
    "points": (lambda: view(MARK[:2]), "points: found shape"),
    "stiffness": (lambda: StiffnessAbove(cables(), HERE, 1.0, 0.0), "stiffness: found"),
    "box": (lambda: PlaceWithin(HERE, ONES, 0.0 * ONES), "box: found"),
    "perturbations": (lambda: StableServo(servo(HERE)[0], BASELINE, BodyState(), np.zeros((1, 5))),
     "perturbations: found shape"),
    # Free paths.
    "knots": (lambda: free(knots=2), "knots: found 2"),
    "duration": (lambda: free(duration=(1.0, 0.5)), "duration"),
    "place bounds": (lambda: free().AddPlaceBounds(0.0 * ONES, ONES, 0.6), "box: found"),
    "half a turn": (lambda: free(goal=pose(0, 0, 0, 0, 0, 178)), "178 deg"),
    # Shapers.
    "shaper": (lambda: make_shaper("XY", W, 0.0), "shaper: "),
    "no frequency": (lambda: make_shaper("ZV", 0.0, 0.0), "shaper: "),
    "NaN frequency": (lambda: make_shaper("ZV", np.nan, 0.0), "shaper: "),
    "much damping": (lambda: make_shaper("ZVD", W, 0.95), "shaper: "),
    "negative damping": (lambda: make_shaper("EI", W, -0.1), "shaper: "),
    # Laws of time.
    "five cables": (few_cables, "found 5 cables"),
    "crossed limits": (lambda: MotionLimits(lower=5.0, upper=2.0), "limits: "),
    "infinite limit": (lambda: MotionLimits(lower=0.0, upper=np.inf), "limits: "),
    "NaN limit": (lambda: MotionLimits(lower=0.0, upper=np.nan), "limits: "),
    "negative limit": (lambda: MotionLimits(lower=-1.0, upper=9.0), "limits: "),
    "still winches": (lambda: MotionLimits(lower=0.0, upper=9.0, cable_speed=0.0), "limits: "),
    "reserve": (lambda: plain_acrobot().limits.within(0.7, 0.0), "reserve"),
    "stations": (lambda: along(pose(0, 0, 0.2), pose(0.1, 0, 0.2), stations=3), "stations: f"),
    "corners": (lambda: along(*HELD, corners="sharp"), "corners: found 'sharp'"),
    "not held": (lambda: along(*HELD, tensions=(5.0, 20.0), reserve=0.0),
     r"s = 0.9798 m of 0.9798 m, pose \(0.4, 0.4, 1\).*C2.*C3.*C6"),
    "no rest": (lambda: over("rest"), r"pose \(0.5, 0.4, 0.6\).*cannot hold.*C1"),
    "too slow": (lambda: over("blend", speed=0.2), r"pose .*cannot hold.*C1"),
    # Own terms.
    "damped": (lambda: law(lambda p: p.AddQuadraticCost(0.0, 0.0, name="no"), damping=(20.0, 0.5)),
     r"a platform with damping \(20.0, 0.5\).*accepted"),
    "stiff": (lambda: law(stiff, stations=40), "law of time along the path: found none with stiff"),
    "stopped": (lambda: law(stop, stations=40), "law of time along the path: found"),
    "of": (lambda: law(lambda p: p.AddQuadraticCost(0.1, of="speed")),
     "of: found 'speed'; accepted: speeds_sq"),
    "wanted": (lambda: law(lambda p: p.AddQuadraticCost(ONES)), r"wanted: found shape \(3,\)"),
    "A": (lambda: law(lambda p: p.AddLinearConstraint(ONES, 0, 1, of="C1")),
     r"A: found shape \(1, 3\)"),
    "own infinity": (lambda: law(lambda p: p.AddCost(lambda x: 1.0 / x[0])),
     "NaN or infinity where the search"),
    "own stations": (lambda: law(stop, stations=3), "stations: found 3; accepted: 10 to"),
    # Wrenches to resist.
    "wrench": (lambda: resisting(PATHS["acrobot_large"][1]),
     r"at s = 0 m .*pose \(0, 0, 0.2\).* under the wrench " + UNDER),
    "held": (held_under_wrench, "start: pose .* under the wrench"),
    "shape of wrenches": (lambda: replace(plain_acrobot(), resist=np.zeros((2, 3))),
     "wrenches to resist: found shape"),
    "ellipsoid": (elliptic, "ellipsoid: found one"),
    # Sets of poses, and of time.
    "start": (lambda: in_sets(START + 1.0), "from: found a pose in none of 3 proven sets"),
    "goal": (lambda: in_sets(goal=START), "to: found the pose of the start"),
    "method": (lambda: in_sets(method="x"), "method: found 'x'; accepted: sequences, gcs"),
    "cost": (lambda: proven_motion(wall_sets(), START, GOAL, plain_acrobot(), 0.1, cost="x"),
     "cost: found 'x'; accepted: length, time"),
    "apart": (lambda: in_sets(sets=two_sets()),
     "that 2 proven sets do not connect; accepted: sets of"),
    "turning": (lambda: in_box(turning()), "found a path that turns"),
    "accelerations": (lambda: in_box(flat_path(), 0.0 * ONES), "accelerations: accepted: three"),
    "moments": (lambda: in_box(turning(), SETS_BOX, 0.0 * ONES),
     "moments: accepted: three half widths above 0"),
    "timed start": (lambda: in_time(LEFT + np.array([0, 0.5, 0, 0, 0, 0])),
     "from, to: found a pose in no proven set"),
    "timed goal": (lambda: in_time(goal=LEFT), "to: found the pose of the start"),
    "timed cost": (lambda: in_time(cost="speed"), "cost: found 'speed'"),
    # Rails.
    "no length": (lambda: rails(upper=rail_task().rails.lower), "without length"),
    "directions": (lambda: rails(directions=rail_task().rails.directions[:, :, :2]),
     "directions of shape"),
    "limits": (lambda: rails(lower=rail_task().rails.lower[:1]), "other numbers of limits"),
    "no poses": (lambda: rail([]).loads(), "found 0 poses"),
    "at an exit": (lambda: rail([at_an_exit()]).matrices(np.zeros(2)), "cable without length"),
    "too heavy": (lambda: rail(rail_task().poses, HEAVY).largest_tensions(np.zeros(2)),
     "no tensions"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, words):
    error = WrenchSetError if "ellipsoid" in words else PlanningError
    with pytest.raises(error, match=words) as caught:
        call()
    assert isinstance(caught.value, CdprError)
    assert len(str(caught.value).splitlines()) == 1


def test_a_damped_platform_without_own_terms_is_planned():
    _, task, path = case("acrobot_large")
    damped = replace(task, dynamics=replace(task.dynamics, damping=(20.0, 0.5)))
    duration = PathTimingProgram(damped, path, 40).Solve().duration
    assert duration == plan_along_path(damped, path, 40).duration
