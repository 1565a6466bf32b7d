"""The kind `dynamic-single-failure` over a grid, as `breaks_at` says of each pose."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.workspaces.break_survival import BreakRequest, breaks_at
from cdpr_drake.analyses.workspaces.workspace_figures import breaks_figure, planes_figure
from cdpr_drake.errors import StoppedError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.pose_grid import grid_by_count

AFTER, REACTIONS = 0.2, ["stop", "redistribute"]
GRID = grid_by_count(np.array([0.0, 0.0, 0.35]), np.array([0.1, 0.0, 0.35]), (2, 1, 1))
ASKED = {"grid": GRID, "reactions": REACTIONS, "after": AFTER, "workers": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Stopped after the first pose, and continued."""
    where = tmp_path_factory.mktemp("breaks") / "found"
    seen = []
    follow = cdpr.Follow(seen.append, stop=lambda: bool(seen) and seen[-1].done >= 1)
    with pytest.raises(StoppedError, match="after 1 of 2 poses"):
        cdpr.compute_workspace(
            "acrobot_large", "dynamic-single-failure", folder=where, follow=follow, **ASKED
        )
    return where


@pytest.fixture(scope="module")
def found(folder):
    seen = []
    result = cdpr.compute_workspace(
        "acrobot_large", "dynamic-single-failure", folder=folder, follow=cdpr.Follow(seen.append),
        **ASKED,
    )  # fmt: skip
    assert seen[-1].found == 1  # of the two poses one was there
    return result


def test_a_pose_is_what_its_runs_say(found):
    robot = load_robot("acrobot_large")
    asked = BreakRequest(
        scenario=load_scenario("acrobot_broken_redistributed"), reactions=tuple(REACTIONS),
        velocity=np.zeros(3), after=AFTER,
    )  # fmt: skip
    told = found.as_dict()["broken"]
    last = GRID.poses()[-1]
    cable, reaction, far, saved = breaks_at(robot, RigidTransform(last), asked).worst()
    row = told["poses"][-1]
    assert row["worst_cable"] == robot.cables[cable].name
    assert row["best_reaction"] == REACTIONS[reaction]
    assert row["excursion_m"] == far == found.values["break-excursion"].ravel()[-1]
    assert row["survives"] == saved == bool(found.inside("dynamic-single-failure").ravel()[-1])
    assert sum(told["worst_cables"].values()) == sum(told["best_reactions"].values()) == 2


def test_it_is_written_and_drawn(found, folder):
    told = json.loads((folder / "results.json").read_text())
    assert told["broken"]["poses"] == found.as_dict()["broken"]["poses"]
    assert told["breaks"]["after_s"] == AFTER
    assert (folder / "breaks.png").stat().st_size > 10_000
    assert not (folder / "worst-cable.png").exists()
    drawn = breaks_figure(found)
    numbers = [one.get_text() for axes in drawn.axes for one in axes.texts]
    assert numbers == [f"{int(n)}" for n in found.values["worst-cable"].ravel()]


def test_excursions_are_drawn_where_no_pose_survives(found):
    kind = "dynamic-single-failure"
    nobody = replace(found, holds={kind: np.zeros_like(found.holds[kind])})
    drawn = planes_figure(nobody, "break-excursion")
    shown = np.ravel(drawn.axes[0].collections[0].get_array())
    np.testing.assert_array_equal(shown, found.values["break-excursion"].ravel())
    assert "no pose inside" in drawn.get_suptitle()
