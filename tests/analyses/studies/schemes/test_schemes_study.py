"""The study of schemes: the same starts for all, what it says of what it found, numbers by hand."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework import seeded_study
from cdpr_drake.analyses.studies.schemes import trials
from cdpr_drake.analyses.studies.schemes.statements import (
    FREE,
    ROBOT,
    TURN,
    schemes_statements,
    task_name,
)
from cdpr_drake.analyses.studies.schemes.study import study_schemes
from cdpr_drake.analyses.studies.schemes.trials import (
    COLUMNS,
    DESIRED,
    TURNS,
    VARIANTS,
    FreeCamera,
    FreeTask,
    RobotTask,
    RunNumbers,
    free_starts,
    measured,
    robot_starts,
    turned,
)
from cdpr_drake.systems.diagrams.load import load_scenario

BY_HAND = 1e-9


def number(row, name):
    return row[COLUMNS.index(name)]


@pytest.fixture(scope="module")
def half_turns():
    """Half a turn, almost, by each scheme."""
    return {name: FreeCamera(name).run(turned(TURNS[-1]), bounded=False) for name in VARIANTS}


def test_half_a_turn_is_the_classic_retreat_of_image_based_servoing(half_turns):
    rows = {name: run[0] for name, run in half_turns.items()}
    assert number(rows["ibvs"], "retreat_m") > 10.0
    assert number(rows["ibvs"], "arrived") == 0.0
    for name in ("pbvs", "pbvs-line", "2.5d", "partitioned", "partitioned, turned"):
        assert number(rows[name], "retreat_m") < 1e-3
        assert number(rows[name], "arrived") == 1.0
    assert number(rows["switching"], "arrived") == 1.0
    assert number(rows["switching"], "switches") == 1.0
    assert number(rows["switching"], "bound_share") < 1.0


def test_paths_in_the_image_are_arcs_about_its_middle(half_turns):
    """A dot of a square turns at its distance from the middle, by each focal length its share."""
    pinhole = FreeCamera("pbvs").pinhole
    row, depths, dots = half_turns["partitioned, turned"]
    np.testing.assert_allclose(depths, DESIRED, atol=1e-6)
    radius = 0.03 * np.sqrt(2.0) / DESIRED
    lengths = [angle * radius * np.radians(TURNS[-1]) for angle in (pinhole.fx, pinhole.fy)]
    assert lengths[0] < number(row, "image_path_px") < lengths[1]
    assert dots.shape[1:] == (2, 4)


def test_numbers_of_a_motion_by_hand():
    """Straight back by 0.1 m beyond the farther end, and there again."""
    free = FreeCamera("ibvs")
    poses = [turned(0.0)]
    for depth in (0.2, 0.25, DESIRED):
        X = turned(0.0)
        X.set_translation([0.0, 0.0, depth])
        poses.append(X)
    (path, retreat, room), depths, _ = measured(poses, free.X_CdO, free.target, free.pinhole)
    assert retreat == pytest.approx(0.1, abs=BY_HAND)
    np.testing.assert_allclose(depths, [DESIRED, 0.2, 0.25, DESIRED])
    out = 0.03 * np.hypot(free.pinhole.fx, free.pinhole.fy) * (1.0 / DESIRED - 1.0 / 0.25)
    assert path == pytest.approx(2.0 * out, abs=1e-6)
    below = 0.5 * free.pinhole.height - 0.03 * free.pinhole.fy / DESIRED
    assert room == pytest.approx(below, abs=1e-6)


def test_starts_are_the_same_for_all_and_see_the_dots():
    for few, more in ((free_starts(2), free_starts(3)), (robot_starts(2), robot_starts(3))):
        assert all(one is other or one == other for one, other in zip(few, more, strict=False)) or (
            few[0].IsNearlyEqualTo(more[0], 0.0)
        )
    free = FreeCamera("pbvs")
    assert all(free.target.in_view(X_CO, free.pinhole) for X_CO in free_starts(3))
    for variant in VARIANTS:
        scenario = load_scenario(trials.SCENARIO, RobotTask(variant).overrides(1))
        assert scenario.controller.scheme == variant.split(",")[0]
        assert scenario.initial_pose.position.tolist() == robot_starts(2)[1][0]
        assert scenario.seed == 1


@pytest.mark.parametrize("task", [FreeTask, RobotTask])
def test_a_task_does_its_items_alone_or_together(task):
    together = task("switching")(0, 2)["runs"]
    alone = [task("switching")(k, k + 1)["runs"][0] for k in range(2)]
    np.testing.assert_array_equal(together, alone)
    assert together.shape == (2, len(COLUMNS))
    assert [name.rpartition("_")[0] or name for name in COLUMNS[2:5]] == list(
        RunNumbers._fields[2:5]
    )


def canned(**changes):
    """What would be found: all arrive; ibvs retreats, the line of pbvs loses, one run switches."""
    found = {}
    for what, count in ((TURN, len(TURNS)), (FREE, 5), (ROBOT, 5)):
        for variant in VARIANTS:
            nan = 0.0 if variant == "switching" else np.nan
            runs = np.tile([1.0, 0.0, 5.0, 200.0, 0.0, nan, nan, 50.0], (count, 1))
            found[task_name(what, variant)] = {"runs": runs}
    found[task_name(TURN, "ibvs")]["runs"][-1, [0, 4]] = 0.0, 50.0
    found[task_name(TURN, "switching")]["runs"][-1, [5, 6]] = 1.0, 0.9
    found[task_name(FREE, "ibvs")]["runs"][0, 0] = 0.0
    for name in ("pbvs", "pbvs-line", "partitioned"):
        found[task_name(FREE, name)]["runs"][0, :2] = 0.0, 1.0
    for name, (row, column, value) in changes.items():
        found[name.replace("_", ", ")]["runs"][row, COLUMNS.index(column)] = value
    return found


def said(found, quick=False):
    return {s.name: s.verdict for s in schemes_statements(found, quick)}


def test_what_is_said_is_judged():
    assert set(said(canned()).values()) == {"confirmed"}
    assert said(canned(turns_ibvs=(-1, "arrived", 1.0)))["image_far"] == "in part"
    retreats = said(canned(turns_partitioned=(3, "retreat_m", 0.2)))
    assert retreats["partition_decouples"] == "in part"
    tilted = canned()
    tilted[task_name(FREE, "partitioned")]["runs"][1, COLUMNS.index("retreat_m")] = 0.7
    tilted[task_name(FREE, "partitioned")]["runs"][1:3, 1] = 1.0
    tilted[task_name(FREE, "partitioned, field")]["runs"][1:3, 1] = 1.0
    tilted[task_name(FREE, "ibvs")]["runs"][:, 0] = 1.0
    for name in ("partition_decouples", "field_keeps_points", "image_far"):
        assert said(tilted)[name] == "in part"
    left = said(canned(turns_switching=(3, "bound_share", 1.5)))
    assert left["switching_by_bounds"] == "in part"
    stuck = canned()
    stuck[task_name(FREE, "2.5d")]["runs"][:, 0] = 0.0
    assert said(stuck)["hybrid_free_of_minima"] == "not confirmed"
    del stuck[task_name(ROBOT, "2.5d")]
    assert "hybrid_free_of_minima" not in said(stuck)


def test_it_tabulates_and_writes(tmp_path, monkeypatch):
    found = canned()
    for name, arrays in found.items():
        if name.startswith(TURN):
            arrays["depths"] = np.full((len(TURNS), 3), DESIRED)

    def finished(tasks, *_):
        assert set(tasks) == set(found)
        return type("Result", (), {"finished": found, "progress": WorkProgress("", 1, 1, 0.0)})

    monkeypatch.setattr(seeded_study, "run_study_sweep", finished)
    study = study_schemes(True, StudySession(workers=1, seeds=2))
    assert len(study.tables()) == 4
    study.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text())
    assert len(written["robot_starts"]) == 2
    assert written["parameters"]["SEED"] == trials.SEED
    assert (tmp_path / "schemes.png").exists()


def test_the_command_line_knows_it():
    assert STUDIES["schemes"].continues
    assert STUDIES["schemes"].repeats
