"""Where servos converge from: starts, loops, judges of made-up rows, pictures."""

from dataclasses import replace

import numpy as np
import pytest
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.basin import loops, starts
from cdpr_drake.analyses.studies.basin import statements as said
from cdpr_drake.analyses.studies.basin.figures import basin_figure, turn_figure
from cdpr_drake.analyses.studies.basin.study import BLOCKS, POINTS, STUDY, cases, numbers
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.perturbed_servo import Perturbation, perturbed_scenario
from cdpr_drake.geometry.poses import angles_from_rotation, pose_row
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.verdict import VERDICTS
from cdpr_drake.systems.monitoring.run_monitor import Outcome

BOX = (np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 2.0]))

ROUNDING = 1e-9
"""Of angles that become matrices and angles again."""

EVEN = 0.02
"""Shares of an octant of a box among 400 points: of random ones the standard deviation is 0.017."""

STEPS_CUT = 2e-4
"""A run that reports its progress cuts integration steps ten times a second; quaternions [-] and
places [m] differ by a tenth of this."""

GOAL = RigidTransform([0.0, 0.0, 0.3])
"""Where the servo wants to be, since its camera is at Po."""


def test_starts_fill_the_box_and_the_turns_evenly_in_any_chunk():
    poses = starts.start_poses(BOX, 0, 400)
    rows = np.array([pose_row(X) for X in poses])
    again = np.array([pose_row(X) for X in starts.start_poses(BOX, 130, 140)])
    np.testing.assert_array_equal(rows[130:140], again)
    upper = rows[:, 4:] > (BOX[0] + BOX[1]) / 2.0
    for octant in np.ndindex(2, 2, 2):
        share = np.mean(np.all(upper == np.array(octant, bool), axis=1))
        assert share == pytest.approx(1.0 / 8.0, abs=EVEN)
    angles = np.degrees([angles_from_rotation(X.rotation()) for X in poses])
    most = np.array([starts.TILT_DEG, starts.TILT_DEG, starts.YAW_DEG])
    assert np.all(np.abs(angles) <= most + ROUNDING)
    assert np.all(np.max(np.abs(angles), axis=0) > 0.95 * most)


def test_blocks_of_the_full_form_are_one_sequence_of_every_scheme():
    found = list(cases(Form()))
    assert len(found) == BLOCKS * len(starts.SCHEMES)
    for scheme in starts.SCHEMES:
        firsts = [one.task.first for one in found if one.keys["scheme"] == scheme]
        assert firsts == [POINTS * block for block in range(BLOCKS)]
    assert [one.keys["scheme"] for one in found[:4]] == [*starts.SCHEMES, starts.SCHEMES[0]]


@pytest.fixture(scope="module")
def few():
    """A few starts, some of which see the tag."""
    return loops.BasinTask("pbvs", 3)(0, 12)


def test_loops_are_those_of_scenarios(few):
    """The end that the task tells is that of the scenario run by itself, in another program."""
    setup = starts.basin_setup("pbvs")
    ran = np.flatnonzero(few["end"] != loops.NO_RUN)
    assert 0 < len(ran) < 12
    k = ran[0]
    start = starts.start_poses(setup.box, 3, 15)[k]
    np.testing.assert_array_equal(pose_row(start), few["pose"][k])
    drawn = draw_perturbations(few["pose"][k], setup.bounds, setup.case.m, 1, starts.SEED)[0]
    wrong = Perturbation.from_vector(drawn)
    run = run_scenario(perturbed_scenario(setup.scenario, start, wrong))
    assert run.outcome.name.lower() == loops.ENDS[few["end"][k]] == loops.CONVERGED
    assert run.sim_time == few["time_s"][k]
    assert few["position_error_m"][k] < 0.001  # it stops at 0.3 mm
    end = loops.close_loop(setup, start, wrong)
    np.testing.assert_allclose(end.way, run.log["X_WP"], atol=STEPS_CUT)


def test_no_start_depends_on_the_chunk(few):
    tail = loops.BasinTask("pbvs", 3)(9, 12)
    assert all(np.array_equal(tail[name], few[name][9:], equal_nan=True) for name in few)


def test_only_what_is_held_and_seen_is_judged(few):
    assert np.all(few["held"] >= few["seen"])
    for name in (*VERDICTS, "taut"):
        assert not np.any(few[name][~few["seen"]])
    assert np.all(few["sampled"] >= few["searched"])
    assert np.all(few["searched"] >= few["certified"])
    setup = starts.basin_setup("pbvs")
    assert setup.is_seen(GOAL)
    assert not setup.is_seen(RigidTransform([0.45, 0.45, 0.2]))  # the tag is beside the image


def ended(outcome=Outcome.TIMEOUT, taut=8, place=(0.0, 0.0, 0.4), off=0.0):
    way = np.tile(pose_row(RigidTransform(np.array(place, float))), (20, 1))
    believed = way.copy()
    believed[-1, 4] += off
    return loops.LoopEnd(outcome, 40.0, taut, (0.1, 0.0), way, believed)


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        (ended(Outcome.CONVERGED), loops.CONVERGED),
        (ended(Outcome.TARGET_LOST), loops.VIEW),
        (ended(Outcome.DIVERGED), loops.FRAME),
        (ended(taut=7), loops.SLACK_CABLES),
        (ended(place=(0.47, 0.47, 1.09)), loops.WAY),
        (ended(off=0.2), loops.ESTIMATE),
        (ended(off=0.01), loops.TIME),
    ],
)
def test_ends_have_names(end, expected):
    assert loops.why_it_ended(starts.basin_setup("pbvs"), end) == expected


def arrays(end=loops.CONVERGED, count=30, certified=20):
    """All converge but one of a certified start; ten are certified, one sampled more."""
    random = np.random.default_rng(0)
    ends = np.zeros(count, int)
    ends[0] = loops.ENDS.index(end)
    ends[-3:] = loops.NO_RUN
    ran = ends != loops.NO_RUN
    places = random.uniform(-0.4, 0.4, (count, 3))
    return {
        "pose": np.hstack([np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)), places]),
        "held": np.ones(count, bool), "seen": ran, "end": ends, "taut": np.where(ran, 8, 0),
        "certified": np.arange(count) < certified, "searched": np.arange(count) < certified + 1,
        "sampled": np.arange(count) < certified + 2,
        **{name: np.ones(count) for name in ("time_s", "position_error_m", "rotation_error_rad")},
    }  # fmt: skip


def made_up(end=loops.CONVERGED, **how):
    rows = []
    for scheme in starts.SCHEMES:
        found = arrays(end if scheme == "ibvs" else loops.CONVERGED, **how)
        keys = {"scheme": scheme, "block": 0}
        rows.append(Run(scheme, None, keys, loops.reduce(Case(name=scheme), found), {}))
    return Runs(rows)


def verdict(check, runs):
    return check.judge(runs).verdict


@pytest.mark.parametrize(
    ("end", "all_converge", "have_names"),
    [
        (loops.CONVERGED, CONFIRMED, CONFIRMED),
        (loops.VIEW, IN_PART, CONFIRMED),
        (loops.SLACK_CABLES, IN_PART, CONFIRMED),
        (loops.TIME, IN_PART, IN_PART),
    ],
)
def test_one_loop_that_ends_elsewhere_is_told(end, all_converge, have_names):
    runs = made_up(end)
    assert verdict(said.converges_from_certified, runs) == all_converge
    assert verdict(said.failures_have_names, runs) == have_names
    failures = runs.one(scheme="ibvs")["failures"]
    assert [one["end"] for one in failures] == ([] if end == loops.CONVERGED else [end])


def test_a_start_whose_platform_covers_an_exit_point_is_not_held():
    """Point 276,623 ended the full study, which had found 828,650 others by then."""
    found = loops.BasinTask("pbvs", 276_623)(0, 1)
    assert not found["held"][0]
    assert found["end"][0] == loops.NO_RUN


def test_a_certificate_that_promises_all_is_told():
    assert verdict(said.basin_is_larger, made_up()) == CONFIRMED
    assert verdict(said.basin_is_larger, made_up(certified=27)) == NOT_CONFIRMED


def test_numbers_and_figures(tmp_path):
    found = numbers(made_up(loops.VIEW))["schemes"]["ibvs"]
    assert (found["points"], found["runs"], found["converged"]) == (30, 27, 26)
    assert found["converged_per_certified"] == pytest.approx(26 / 20)
    assert found["certified_not_converged"] == {loops.VIEW: 1}
    for figure in (basin_figure, turn_figure):
        figure(made_up(loops.VIEW)).savefig(tmp_path / "figure.png")
    none = Runs([replace(run, measured=_without_loops(run.measured)) for run in made_up()])
    with pytest.raises(NothingToDraw):
        basin_figure(none)
    assert STUDY.names_of_checks() == tuple(check.name for check in said.CHECKS)


def _without_loops(row):
    empty = {name: np.zeros(0, int) for name in ("end", *(f"is_{one}" for one in VERDICTS))}
    return dict(row) | {"pose": np.zeros((0, 7))} | empty
