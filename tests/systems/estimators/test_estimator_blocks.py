"""Estimators of one source as blocks: exact data give exact poses, and each one's own error.

Twists that are integrated, images that are compared, lengths that are searched for a pose.
"""

from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.estimators.basic_estimators import ControlIntegration
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
)
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths, LengthEstimator
from cdpr_drake.systems.estimators.pose_estimator import KnownTag
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

ROUND_OFF = 1e-12
"""Products of some ten poses with entries of order one."""

IMAGES = 1e-11
"""Some hundred products of poses with entries of order one."""

EXACT = 1e-8
"""Tolerance of the search for a pose, with lengths of order one [m, rad]."""

LARGE = 1e-5
"""Well beyond that [m]."""

START = pose_from_angles(np.array([0.1, -0.2, 0.3]), np.array([0.2, -0.3, 0.5]))
WRONG = START @ exponential(np.array([0.05, 0.0, 0.1, 0.02, 0.0, -0.03]))
TWIST = np.array([0.7, -0.4, 1.1, 0.2, -0.1, 0.3])
X_PC = pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.1, 3.0, 0.0]))
X_WO = pose_from_angles(np.array([0.2, -0.2, 0.0]), np.array([0.0, 0.1, 0.3]))
X_WK = pose_from_angles(np.array([-0.1, 0.2, 0.05]), np.array([0.2, 0.0, 1.0]))
NO_IMAGE = {"X_CO": RigidTransform(), "found": [0.0]}
NO_TAG = {"X_CK": RigidTransform(), "known_tag_found": [0.0]}
BOTH = pytest.mark.parametrize("kind", [ConsecutiveImages, FirstImage])
ROBOT = load_robot("acrobot_small")
CABLES = ROBOT.cable_set().without_pulleys()


@pytest.mark.parametrize(
    ("time", "rate", "close"),
    [
        *((periods * PERIOD, RATE, ROUND_OFF) for periods in (0.0, 0.3, 1.0, 1.7, 12.9)),
        (0.5, 1e4, 1e3 * ROUND_OFF),  # thousands of products, which would each add their round-off
    ],
)
def test_a_constant_twist_is_integrated_exactly_and_a_rotation_stays_one(time, rate, close):
    """At updates and between them, X_WP(t) = X_WP(0) exp(V t)."""
    estimator = ControlIntegration(START, rate)
    simulator = Simulator(estimator)
    context = simulator.get_mutable_context()
    estimator.GetInputPort("platform_velocity").FixValue(context, TWIST)
    if time:
        simulator.AdvanceTo(time)
    X_WP = RigidTransform(estimator.GetOutputPort("X_WP").Eval(context))
    assert max(pose_error(START @ exponential(TWIST * time), X_WP)) < close
    R = X_WP.rotation().matrix()
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=ROUND_OFF)


class Source(LeafSystem):
    """Holds a new twist from each update to the next, as a servo does."""

    def __init__(self, twists):
        super().__init__()
        self._twists = twists
        index = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)
        self.DeclareStateOutputPort("platform_velocity", index)

    def _update(self, context, state):
        state.set_value(self._twists[round(context.get_time() * RATE)])


@pytest.mark.parametrize("source_first", [True, False])
def test_control_integration_does_not_lag_behind_a_controller_that_updates_at_the_same_times(
    source_first,
):
    """Whichever of the two was added first, and between updates too."""
    twists = np.random.default_rng(2).standard_normal((12, 6))
    builder = DiagramBuilder()
    source, estimator = Source(twists), ControlIntegration(START, RATE)
    for system in (source, estimator) if source_first else (estimator, source):
        builder.AddSystem(system)
    builder.Connect(source.get_output_port(), estimator.get_input_port())
    simulator = Simulator(builder.Build())
    X_WP = START
    for twist in twists:
        since = simulator.get_context().get_time()
        for share in (0.25, 0.8, 1.0):
            simulator.AdvanceTo(since + share * PERIOD)
            found = estimator.GetOutputPort("X_WP").Eval(
                estimator.GetMyContextFromRoot(simulator.get_context())
            )
            expected = X_WP @ exponential(twist * share * PERIOD)
            assert max(pose_error(expected, found)) < ROUND_OFF
        X_WP = X_WP @ exponential(twist * PERIOD)


def path(count, seed=2):
    random = np.random.default_rng(seed)
    poses = [START]
    for _ in range(count - 1):
        poses.append(poses[-1] @ exponential(0.02 * random.standard_normal(6)))
    return poses


def image(X_WP, noise=None):
    X_CO = (X_WP @ X_PC).inverse() @ X_WO
    return {"X_CO": X_CO if noise is None else X_CO @ exponential(noise), "found": [1.0]}


def known(X_WP):
    return {"X_CK": (X_WP @ X_PC).inverse() @ X_WK, "known_tag_found": [1.0]}


@BOTH
def test_exact_images_give_the_exact_pose_but_for_the_error_of_the_start(kind):
    """At the instant of the image, not one step later: images tell the motion only, so that an
    error of the start is one fixed motion of the world."""
    for start in (START, WRONG):
        bench = EstimatorBench(kind(start, X_PC, RATE))
        for X_WP in path(30):
            found = bench.step(**image(X_WP))
            assert max(pose_error(found, start @ START.inverse() @ X_WP)) < IMAGES


@BOTH
def test_without_an_image_an_estimate_stays_and_catches_up_with_the_next_one(kind):
    bench, poses = EstimatorBench(kind(START, X_PC, RATE)), path(12)
    assert max(pose_error(bench.step(**NO_IMAGE), START)) < IMAGES
    for k, X_WP in enumerate(poses):
        seen = k < 4 or k > 8
        found = bench.step(**(image(X_WP) if seen else NO_IMAGE))
        assert max(pose_error(found, X_WP if seen else poses[3])) < IMAGES


def test_noise_does_not_add_up_from_image_to_image():
    """Neither drifts, and they agree: comparing consecutive images cancels what lies between."""
    random = np.random.default_rng(4)
    noise = 0.003 * random.standard_normal((200, 6))
    benches = [EstimatorBench(kind(START, X_PC, RATE)) for kind in (ConsecutiveImages, FirstImage)]
    errors = []
    for X_WP, each in zip(path(200), noise, strict=True):
        one, other = (bench.step(**image(X_WP, each)) for bench in benches)
        assert max(pose_error(one, other)) < IMAGES
        errors.append(pose_error(one, X_WP)[1])
    assert np.max(errors[100:]) < 1.5 * np.max(errors[:100])


@BOTH
@pytest.mark.parametrize(("period", "late"), [(5.0, None), (2.0, 7)])
def test_a_known_tag_begins_an_estimate_anew_after_each_period_or_when_it_shows_up(
    kind, period, late
):
    """The late one is seen once, at a step without the target: what follows is told from 8 on."""
    bench = EstimatorBench(kind(WRONG, X_PC, RATE, KnownTag(X_WK, X_PC, period * PERIOD)))
    for k, X_WP in enumerate(path(late + 1 if late else 20)):
        with_tag = late is None or k == late
        found = bench.step(
            **(NO_IMAGE if k == late else image(X_WP)), **(known(X_WP) if with_tag else NO_TAG)
        )
        expected = X_WP if k >= (late or period) else WRONG @ START.inverse() @ X_WP
        assert max(pose_error(found, expected)) < IMAGES


def test_the_known_object_tells_the_pose_whatever_was_believed():
    bench = EstimatorBench(KnownObject(RigidTransform(), X_PC, X_WK, RATE))
    assert bench.step(**NO_TAG).IsExactlyIdentity()
    poses = path(6)
    for X_WP in poses:
        assert max(pose_error(bench.step(**known(X_WP)), X_WP)) < IMAGES
    assert max(pose_error(bench.step(**NO_TAG), poses[-1])) < IMAGES


TENSIONS = np.array([40.0, 55.0, 60.0, 35.0, 10.0, 20.0, 5.0, 1.0])


@cache
def robot_way(name="acrobot_small"):
    """A robot and a way from its home, at the period of control."""
    robot = load_robot(name)
    home, planar = robot.home.transform(), robot.is_planar()
    step = np.array([0, 0, 0.3, 0.15, -0.1, 0] if planar else [0.1, -0.2, 0.3, 0.15, -0.1, 0.1])
    way = PoseTrajectory((home, home @ exponential(step)), (1.0,))
    return robot, [way.pose(k * PERIOD) for k in range(26)]


def counted(cables, X_WP, tensions=TENSIONS, elastic=False, zero=0.3):
    """What encoders read that were zero at a length [m], and tensions."""
    lengths = cable_paths(X_WP, cables).lengths
    if elastic:
        lengths = unstrained_lengths(lengths, tensions, cables.stiffness)
    return {"measured_lengths": lengths - zero, "measured_tensions": tensions}


def bench_of(start, cables=CABLES, elastic=False, **options):
    return EstimatorBench(LengthEstimator(start, EncoderLengths(cables, elastic), RATE, **options))


def run(robot, poses, truth, model):
    """Errors [m] along a way, with (cables, elastic) of the truth and of the model."""
    bench, m = bench_of(poses[0], *model, motion=robot.motion_type()), len(robot.cables)
    return np.array([
        pose_error(bench.step(**counted(truth[0], X, TENSIONS[:m] * (1.0 + 0.02 * k), truth[1])), X)
        for k, X in enumerate(poses)
    ])  # fmt: skip


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("name", ["acrobot_small", "caroca", "planar"])
def test_lengths_of_its_own_model_give_the_exact_pose(name, elastic, pulleys):
    robot, poses = robot_way(name)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    assert np.max(run(robot, poses, (cables, elastic), (cables, elastic))) < EXACT


@pytest.mark.parametrize("left_out", ["pulleys", "elasticity"])
def test_a_model_is_wrong_on_the_way_but_not_at_the_start_by_what_it_leaves_out(left_out):
    robot, poses = robot_way("caroca")
    over, straight = robot.cable_set(), robot.cable_set().without_pulleys()
    truth = (over, False) if left_out == "pulleys" else (straight, True)
    errors = run(robot, poses, truth, (straight, False))
    assert np.max(errors[0]) < EXACT
    assert errors[-1, 0] > LARGE


def test_only_the_tautest_cables_count():
    _, poses = robot_way()
    bench = bench_of(poses[0])
    for k, X_WP in enumerate(poses):
        read = counted(CABLES, X_WP)
        read["measured_lengths"][6:] += 0.05 if k else 0.0  # slack in the two that pull least
        assert max(pose_error(bench.step(**read), X_WP)) < EXACT


def test_a_start_from_a_wrong_pose_stays_wrong_and_jumps_where_the_cables_change():
    """The reference lengths are those of the wrong pose: each six of them tell another pose."""
    _, poses = robot_way()
    bench = bench_of(poses[0] @ exponential(np.array([0.05, 0.02, -0.05, 0.02, -0.02, 0.02])))
    error = []
    for k, X_WP in enumerate(poses):
        # Half-way slack moves from the last two cables to the first two.
        tensions = TENSIONS if k < 13 else TENSIONS[::-1].copy()
        found = bench.step(**counted(CABLES, X_WP, tensions))
        error.append(found.translation() - X_WP.translation())
    steps = np.linalg.norm(np.diff(error, axis=0), axis=1)
    assert np.linalg.norm(error[-1]) > 0.01
    assert steps[12] > 3.0 * np.max(np.delete(steps, 12))


def test_where_no_pose_has_the_lengths_the_last_one_stays():
    start = robot_way()[1][0]
    bench, read = bench_of(start), counted(CABLES, start, zero=0.0)
    bench.step(**read)
    shorter = read["measured_lengths"] * np.array([0.3, 1, 0.3, 1, 0.3, 1, 1, 1])
    for lengths in (shorter, read["measured_lengths"]):
        found = bench.step(**{**read, "measured_lengths": lengths})
        assert max(pose_error(found, start)) < EXACT


def test_a_known_tag_corrects_the_reference_too():
    _, poses = robot_way()
    wrong = poses[0] @ exponential(np.array([0.03, 0.0, 0.0, 0.02, 0.0, 0.0]))
    bench = bench_of(wrong, known_tag=KnownTag(X_WK, X_PC, 4.0 * PERIOD))
    for k, X_WP in enumerate(poses):
        # Seen once: what follows is told by the lengths alone.
        seen = {**known(X_WP), "known_tag_found": [float(k == 5)]}
        error = max(pose_error(bench.step(**counted(CABLES, X_WP), **seen), X_WP))
        assert error < EXACT if k >= 5 else error > LARGE


def test_readings_below_zero_do_not_shorten_cables():
    cables, pose = ROBOT.cable_set(), ROBOT.home.transform()
    counting, below = EncoderLengths(cables, True), np.full(8, -3.0)
    reference = counting.reference(pose, np.zeros(8), below)
    np.testing.assert_array_equal(reference, cable_paths(pose, cables).lengths)
    np.testing.assert_array_equal(counting.lengths(np.zeros(8), reference, below), reference)
