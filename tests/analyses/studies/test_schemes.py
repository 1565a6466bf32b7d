"""The study of schemes: the same starts for all, and numbers by hand."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.schemes import (
    DESIRED,
    SCENARIO,
    TURNS_DEG,
    VARIANTS,
    FreeCamera,
    free_row,
    free_starts,
    measured,
    robot_changes,
    robot_row,
    robot_starts,
    turned,
)
from cdpr_drake.systems.diagrams.load import load_scenario

BY_HAND = 1e-9


@pytest.fixture(scope="module")
def half_turns():
    """Half a turn, almost, by each scheme."""
    return {name: FreeCamera(name).run(turned(TURNS_DEG[-1]), bounded=False) for name in VARIANTS}


def test_half_a_turn_is_the_classic_retreat_of_image_based_servoing(half_turns):
    assert half_turns["ibvs"]["retreat_m"] > 10.0
    assert not half_turns["ibvs"]["arrived"]
    for name in ("pbvs", "pbvs-line", "2.5d", "partitioned", "partitioned, turned"):
        assert half_turns[name]["retreat_m"] < 1e-3
        assert half_turns[name]["arrived"]
    assert half_turns["switching"]["arrived"]
    assert half_turns["switching"]["switches"] == 1.0
    assert half_turns["switching"]["bound_share"] < 1.0


def test_paths_in_the_image_are_arcs_about_its_middle(half_turns):
    """A dot of a square turns at its distance from the middle, by each focal length its share."""
    pinhole = FreeCamera("pbvs").pinhole
    row = half_turns["partitioned, turned"]
    np.testing.assert_allclose(row["depths_m"], DESIRED, atol=1e-6)
    radius = 0.03 * np.sqrt(2.0) / DESIRED
    lengths = [angle * radius * np.radians(TURNS_DEG[-1]) for angle in (pinhole.fx, pinhole.fy)]
    assert lengths[0] < row["image_path_px"] < lengths[1]
    assert row["dots_px"].shape[1:] == (2, 4)


def test_numbers_of_a_motion_by_hand():
    """Straight back by 0.1 m beyond the farther end, and there again."""
    free = FreeCamera("ibvs")
    poses = [turned(0.0)]
    for depth in (0.2, 0.25, DESIRED):
        X = turned(0.0)
        X.set_translation([0.0, 0.0, depth])
        poses.append(X)
    row = measured(poses)
    assert row["retreat_m"] == pytest.approx(0.1, abs=BY_HAND)
    np.testing.assert_allclose(row["depths_m"], [DESIRED, 0.2, 0.25, DESIRED])
    out = 0.03 * np.hypot(free.pinhole.fx, free.pinhole.fy) * (1.0 / DESIRED - 1.0 / 0.25)
    assert row["image_path_px"] == pytest.approx(2.0 * out, abs=1e-6)
    below = 0.5 * free.pinhole.height - 0.03 * free.pinhole.fy / DESIRED
    assert row["room_px"] == pytest.approx(below, abs=1e-6)


def test_starts_are_the_same_for_all_and_see_the_dots():
    for few, more in ((free_starts(2), free_starts(3)), (robot_starts(2), robot_starts(3))):
        assert all(one is other or one == other for one, other in zip(few, more, strict=False)) or (
            few[0].IsNearlyEqualTo(more[0], 0.0)
        )
    free = FreeCamera("pbvs")
    assert all(free.target.in_view(X_CO, free.pinhole) for X_CO in free_starts(3))
    for variant in VARIANTS:
        scenario = load_scenario(SCENARIO, robot_changes(variant, 1))
        assert scenario.controller.scheme == variant.split(",")[0]
        assert scenario.initial_pose.position.tolist() == robot_starts(2)[1][0]
        assert scenario.seed == 1


@pytest.mark.parametrize("row", [free_row, robot_row])
def test_a_run_depends_on_its_number_alone(row):
    first, second, again = (row("switching", seed) for seed in (0, 1, 0))
    assert first == again
    assert first["image_path_px"] != second["image_path_px"]
    assert "depths_m" not in first
