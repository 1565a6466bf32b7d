"""Verdicts against plain NumPy and each other, worst perturbations, any target, and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.studies.perturbed_servo import Perturbation, perturbed_servo
from cdpr_drake.analyses.workspaces.servo_stability import varied
from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds
from cdpr_drake.errors import CdprError, StabilityError
from cdpr_drake.geometry.poses import pose_from_row, pose_rows
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs import no_stable_target as any_target
from cdpr_drake.proofs.no_stable_target import stable_target_exists
from cdpr_drake.servoing.turned_view import encoder_turn
from cdpr_drake.stability.criterion import stability_margin
from cdpr_drake.stability.criterion_at_pose_kernel import evaluate, new_work, prepare
from cdpr_drake.stability.desired_view import FixedError, FixedObject
from cdpr_drake.stability.perturbation_bounds import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    POSE_BLOCKS,
    RADII,
    PerturbationBounds,
)
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import (
    VERDICTS,
    VerdictOptions,
    judge_stability,
    packed_case,
    worst_perturbations,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.stability.stability_cases import (
    CASES,
    ROUNDING,
    planar_case,
    pose_of,
    random_poses,
    reference_pi,
    spatial_case,
)

SAME = 1e-7  # two implementations of the criterion agree within this
PBVS = CASES["pbvs"]


def margins(case, bounds, poses, verdict="sampled", **options):
    return judge_stability(case, bounds, poses, verdict, VerdictOptions(**options)).margin


# Sampled.


@pytest.mark.parametrize("perturbed", ["estimate", "truth"])
@pytest.mark.parametrize("name", [*CASES, "ibvs blind"])
@pytest.mark.parametrize("s", [0.0, 0.05])
def test_sampled_margin_is_that_of_plain_numpy(name, perturbed, s):
    blind = name == "ibvs blind"
    case = replace(spatial_case("ibvs", p_OK=None) if blind else CASES[name], perturbed=perturbed)
    s = 0.0 if blind else s
    bounds = BASELINE.varied(r_s=s, d_theta_s=0.0 if case.planar else s, exits="corners")
    poses = random_poses(3, case.planar)
    m = case.cables.count
    for pose, margin in zip(poses, margins(case, bounds, poses, draws=20, seed=3), strict=True):
        flat = pose * (np.arange(7) != 6) if case.planar else pose  # draws know no height
        draws = draw_perturbations(flat, bounds, case.m, 20, 3, case.planar)
        if case.planar:
            pose[6] = 0.3  # the plane of the robot
        points = np.zeros((20, 2, m, 3))
        points[:, :, case.taut_cables()] = draws[:, 18:].reshape(20, 2, case.m, 3)
        full = np.hstack([draws[:, :18], points.reshape(20, -1)])
        expected = min(stability_margin(reference_pi(case, pose, d)) for d in full)
        assert margin == pytest.approx(min(expected, 1.0), abs=ROUNDING)


@pytest.mark.parametrize("name", ["pbvs", "2.5d", "ibvs"])
def test_a_perfect_model_is_the_identity(name):
    Pi = reference_pi(CASES[name], random_poses(1)[0], np.zeros(66))
    np.testing.assert_allclose(Pi, np.eye(6), atol=ROUNDING)


def test_verdicts_do_not_depend_on_the_chunk_nor_on_threads_but_on_the_seed():
    poses = random_poses(9)
    whole = margins(PBVS, BASELINE, poses)
    parts = [margins(PBVS, BASELINE, part) for part in (poses[:1], poses[1:6], poses[6:])]
    np.testing.assert_array_equal(whole, np.concatenate(parts))
    np.testing.assert_array_equal(whole, margins(PBVS, BASELINE, poses, threads=1))
    assert not np.array_equal(whole, margins(PBVS, BASELINE, poses, seed=1))


def test_verdicts_without_margins_are_the_same():
    poses, bounds = random_poses(50), BASELINE.scaled(8.0)
    whole = judge_stability(PBVS, bounds, poses)
    quick = judge_stability(PBVS, bounds, poses, options=VerdictOptions(margins=False))
    np.testing.assert_array_equal(whole.stable, quick.stable)
    assert 0 < np.sum(whole.stable) < 50


def test_fifty_draws_are_looked_at_unless_said_otherwise():
    poses = random_poses(300)
    by = {draws: margins(PBVS, BASELINE, poses, draws=draws) for draws in (49, 50, 51)}
    assert np.any(by[50] < by[49])  # else fewer would do here
    assert np.any(by[51] < by[50])
    np.testing.assert_array_equal(margins(PBVS, BASELINE, poses), by[50])


def test_perturbations_of_full_size_point_everywhere_alike():
    d = draw_perturbations(random_poses(1)[0], BASELINE, 8, 2000, 3)[:, :3]
    V = d / np.linalg.norm(d, axis=1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), BASELINE.d_theta_bp, rtol=ROUNDING)
    np.testing.assert_allclose(V.mean(axis=0), 0.0, atol=0.06)  # 4.6 of its standard deviations
    np.testing.assert_allclose(V.T @ V / len(V), np.eye(3) / 3.0, atol=0.03)


def test_poses_may_be_transforms():
    poses = random_poses(4)
    rows = pose_rows([pose_of(row) for row in poses])
    along = np.abs(np.sum(rows[:, :4] * poses[:, :4], axis=1))
    np.testing.assert_allclose(along, np.linalg.norm(poses[:, :4], axis=1))
    np.testing.assert_array_equal(rows[:, 4:], poses[:, 4:])
    assert judge_stability(PBVS, BASELINE, rows).stable.all()


# All verdicts.


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line"])
@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_planar_robot_sees_nothing_out_of_its_plane(verdict, scheme):
    """Neither a height nor a tilt of the desired view; a way in the plane counts under PBVS."""
    turn, error = np.array([0.3, -0.2, 0.5]), np.array([0.1, -0.15, 0.4])
    flat, poses = np.array([1.0, 1.0, 0.0]), random_poses(4, planar=True)

    def seen(turn, error):
        case = replace(planar_case(), scheme=scheme, target=FixedError(turn, error))
        return margins(case, PLANAR_BASELINE.scaled(0.2), poses, verdict)

    whole = seen(turn, error)
    assert np.all(np.isfinite(whole))
    np.testing.assert_array_equal(whole, seen(turn * (1.0 - flat), error * flat))
    for axis in np.eye(3)[:2]:
        changed = seen(turn, error + 0.1 * axis) != whole
        assert np.all(changed) if scheme == "pbvs" else not np.any(changed)


@pytest.mark.parametrize("name", [name for name in CASES if name != "exact"])
@pytest.mark.parametrize("directions", DIRECTIONS)
def test_certified_implies_searched_implies_sampled(name, directions):
    case = CASES[name]
    poses = random_poses(6, case.planar)
    for share in (0.25, 1.0, 2.0):
        bounds = BASELINE.varied(exits=directions, anchors=directions).scaled(share)
        sampled, searched, certified = (
            margins(case, bounds, poses, verdict) for verdict in VERDICTS
        )
        assert np.all(certified <= searched)
        assert np.all(searched <= sampled)
        quick = judge_stability(case, bounds, poses, "certified", VerdictOptions(margins=False))
        assert not np.any(quick.stable & (searched <= 0.0))


def test_the_search_beats_many_random_draws():
    poses = random_poses(20)
    searched = margins(PBVS, BASELINE, poses, "searched")
    assert np.all(searched < margins(PBVS, BASELINE, poses, draws=20_000))


def test_a_quarter_of_the_baseline_is_mostly_certified():
    poses, options = random_poses(200), VerdictOptions(margins=False)
    searched, certified = (
        judge_stability(PBVS, BASELINE.scaled(0.25), poses, verdict, options).stable
        for verdict in ("searched", "certified")
    )
    assert np.sum(certified) >= 0.9 * np.sum(searched) > 0


# The worst perturbation.


def test_the_worst_perturbation_is_within_bounds_and_as_bad_as_the_verdict_says():
    """Against the servo of a scenario, perturbed."""
    scenario = load_scenario(
        "acrobot_pbvs",
        ["robot=acrobot_large", "target.pose.position=[0,0,0]", "desired.position=[0,0,0.3]"],
    )
    nothing = Perturbation.from_vector(np.zeros(3 * (POSE_BLOCKS + 16)))
    servo = perturbed_servo(scenario, nothing)
    case = StabilityCase(
        servo.robot.cable_set().without_pulleys(), X_PC=servo.X_PC, lever="object",
        target=FixedObject(servo.X_WO, scenario.desired.transform()),
    )  # fmt: skip
    poses = grid_by_count([-0.3, -0.3, 0.3], [0.3, 0.3, 0.9], [2, 2, 2]).pose_rows()
    margin, worst = worst_perturbations(case, BASELINE, poses, VerdictOptions(seed=4))
    np.testing.assert_array_equal(margin, margins(case, BASELINE, poses, "searched", seed=4))
    assert np.all(margin < margins(case, BASELINE, poses, seed=4))
    for pose, value, d in zip(poses, margin, worst, strict=True):
        servo = perturbed_servo(scenario, Perturbation.from_vector(d))
        assert servo.margin(pose_from_row(pose)) == pytest.approx(value, abs=SAME)
    blocks = np.linalg.norm(worst.reshape(len(worst), -1, 3), axis=2)
    radii = BASELINE.radii()
    limits = np.concatenate([radii[:POSE_BLOCKS], np.repeat(radii[POSE_BLOCKS:], 8)])
    assert np.all(blocks <= limits * (1.0 + ROUNDING) + 1e-15)


@pytest.mark.parametrize(
    ("name", "bounds"),
    [
        ("planar", PerturbationBounds(d_theta_bp=0.3)),  # two draws are all there is
        ("planar", BASELINE.scaled(2.0)),
        ("pbvs", PerturbationBounds(d_theta_bp=0.5)),
        ("2.5d", PerturbationBounds()),
    ],
)
def test_every_perturbation_has_the_margin_that_stands_beside_it(name, bounds):
    case = CASES[name]
    poses = random_poses(40, case.planar)
    options = VerdictOptions(draws=20, searches=2, steps=3)
    margin, worst = worst_perturbations(case, bounds, poses, options)
    arrays, rows = packed_case(case, bounds, poses)
    w = new_work(arrays)
    for n in range(len(poses)):
        assert prepare(arrays, rows, n, w)
        assert evaluate(arrays, rows, n, w, worst[n])
        smallest = min(np.linalg.eigvalsh(w.S)[0], 1.0)
        assert smallest == pytest.approx(margin[n], abs=ROUNDING)


# What no target makes stable.

LARGE = BASELINE.varied(r_A=0.1, r_B=0.06)  # excludes some poses of ACROBOT and leaves others
CABLES = load_robot("acrobot_large").cable_set().without_pulleys()


class Eigenvalues:
    """Smallest real parts of eigenvalues at poses, whatever is seen."""

    def __init__(self, count, seed):
        self.poses = random_poses(count, unit=True)
        self.model = (
            rotations_of_quaternions(self.poses[:, :4]), self.poses[:, 4:], CABLES.p_WA.T,
            CABLES.p_PB.T,
        )  # fmt: skip
        self.drawn = any_target._drawn(np.random.default_rng(seed), LARGE, count, 8)
        nothing = any_target._nothing(count, 8)
        self.true = np.linalg.pinv(any_target._jacobians(*self.model, nothing))

    def steepest(self):
        return any_target._steepest(LARGE, *self.model, true=self.true, at=self.drawn)

    def smallest(self, at):
        return any_target._smallest(self.true @ any_target._jacobians(*self.model, at))


@pytest.mark.parametrize("scheme", ["pbvs", "2.5d", "ibvs"])
def test_the_criterion_has_these_eigenvalues_whatever_is_seen(scheme):
    values, rng = Eigenvalues(8, 3), np.random.default_rng(1)
    error = values.steepest()
    parts = (error.turn, error.shift, np.zeros((8, 12)), error.exits, error.anchors)
    d = np.hstack([part.reshape(8, -1) for part in parts])
    for pose, perturbation, least in zip(values.poses, d, values.smallest(error), strict=True):
        R = RotationMatrix(rotations_of_quaternions(pose[None, :4])[0])
        place = np.append(rng.uniform(-0.4, 0.4, 2), rng.uniform(0.3, 1.0))
        target = FixedError(rng.uniform(-1.5, 1.5, 3), rng.normal(size=3), place, np.eye(3))
        X_PC = RigidTransform(R, rng.normal(size=3))
        Pi = reference_pi(StabilityCase(CABLES, scheme, False, X_PC, target), pose, perturbation)
        assert np.linalg.eigvals(Pi).real.min() == pytest.approx(least, abs=1e-8)
        # Lyapunov: the symmetric part is not above the smallest real part.
        assert stability_margin(Pi) <= least + 1e-8


def test_an_excluded_pose_is_not_stable_for_any_verdict_that_looks_hard():
    poses = random_poses(40, unit=True)
    possible = stable_target_exists(CABLES, LARGE, poses)
    assert 0 < possible.sum() < len(poses)
    for scheme in ("pbvs", "ibvs"):
        found = judge_stability(StabilityCase(CABLES, scheme), LARGE, poses, "searched")
        assert not np.any(found.stable & ~possible)
    alone = [stable_target_exists(CABLES, LARGE, pose)[0] for pose in poses[:8]]
    np.testing.assert_array_equal(possible[:8], alone)
    assert stable_target_exists(CABLES, BASELINE.scaled(0.0), poses).all()
    assert possible.sum() <= stable_target_exists(CABLES, LARGE.scaled(0.5), poses).sum()


@pytest.mark.parametrize(
    ("name", "radius"),
    [
        ("turn", LARGE.d_theta_bp), ("shift", LARGE.r_bp), ("exits", LARGE.r_A),
        ("anchors", LARGE.r_B),
    ],
)  # fmt: skip
def test_every_step_goes_down_and_stays_within_the_bounds(name, radius):
    values = Eigenvalues(6, 2)
    step = getattr(values.steepest(), name)
    assert np.linalg.norm(step, axis=-1).max() <= radius + 1e-12
    changed = replace(values.drawn, **{name: getattr(values.drawn, name) + 1e-5 * step})
    assert np.all(values.smallest(changed) < values.smallest(values.drawn))


# Errors of a camera's joints among the bounds.


def test_joints_add_to_the_camera_and_to_nothing_else():
    turn, joints = RADII.index("d_theta_pc"), BASELINE.varied(d_theta_joints=0.02)
    change = joints.radii() - BASELINE.radii()
    assert change[turn] == pytest.approx(0.02)
    assert np.count_nonzero(change) == 1
    assert joints.scaled(0.5).d_theta_joints == 0.01
    assert PerturbationBounds(d_theta_pc=3.0, d_theta_joints=1.0).radii()[turn] == math.pi
    assert "d_theta_joints" not in BASELINE.as_dict()  # without joints nothing is said of them
    assert joints.as_dict()["d_theta_joints"] == 0.02
    assert varied(BASELINE, "d_theta_joints_deg", 2.0).d_theta_joints == math.radians(2.0)


def test_a_file_of_bounds_has_encoders(tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text("d_theta_pc_deg: 1.0\nencoders_deg: [0.3, 0.4]\n")
    bounds = load_bounds(path)
    assert bounds.d_theta_joints == encoder_turn(math.radians(0.3), math.radians(0.4))
    assert math.degrees(bounds.d_theta_joints) == pytest.approx(0.5, rel=1e-4)


# Refusals.


def judge(case=PBVS, bounds=BASELINE, poses=None, verdict="sampled"):
    return judge_stability(case, bounds, random_poses(1) if poses is None else poses, verdict)


TRUTH = spatial_case("pbvs", perturbed="truth")
SEEN = BASELINE.varied(d_theta_s=0.1)
PULLEYS = load_robot("caroca").cable_set()

REFUSALS = {
    "radius": (lambda: BASELINE.varied(r_A=-0.1), "r_A: found -0.1; accepted: a number >= 0"),
    "turn": (lambda: BASELINE.varied(d_theta_bp=4.0), "d_theta_bp: found 4; accepted"),
    "bound": (lambda: BASELINE.varied(r_X=1.0), "found r_X; accepted"),
    "exits": (lambda: BASELINE.varied(exits="all"), "exits: found all; accepted"),
    "planar 2.5d": (lambda: replace(planar_case(), scheme="2.5d"), "2.5d for a planar robot"),
    "planar ibvs": (lambda: replace(planar_case(), scheme="ibvs"), "ibvs for a planar robot"),
    "taut": (lambda: spatial_case("pbvs", taut=np.arange(8) < 5), "found 5 taut; accepted: at l"),
    "scheme": (lambda: spatial_case("dance"), "scheme: found dance"),
    "draws": (lambda: VerdictOptions(draws=0), "draws: found 0"),
    "verdict": (lambda: judge(verdict="sure"), "verdict: found"),
    "truth": (lambda: judge(TRUTH, verdict="certified"), "perturbed: found truth for a cert"),
    "seen": (lambda: judge(CASES["pbvs"], SEEN, verdict="certified"), "d_theta_s: found 0.1 for a"),
    "r_s": (lambda: judge(CASES["2.5d"], BASELINE.varied(r_s=0.1), verdict="certified"),
     "r_s: found 0.1 for a certificate of 2.5d"),
    "shape": (lambda: judge(poses=np.zeros((2, 6))), r"shape \(2, 6\)"),
    "quaternion": (lambda: judge(poses=np.zeros((2, 7))), "quaternion of zeros"),
    "p_CO": (lambda: judge(spatial_case("2.5d", target=FixedError())), "needs p_CO"),
    "tilted": (lambda: judge(planar_case(), PLANAR_BASELINE), "tilted"),
    "pulleys": (lambda: StabilityCase(PULLEYS), r"found pulleys; .*cables\.without_pulleys\(\)"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, words):
    with pytest.raises(StabilityError, match=words) as caught:
        call()
    assert isinstance(caught.value, CdprError)
    assert len(str(caught.value).splitlines()) == 1
