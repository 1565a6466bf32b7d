"""Behaviours of cables come back from swings that Drake's plant made; one of many seeds."""

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.free_motion_model import FreeMotionModel
from cdpr_drake.analyses.calibration.free_motion_report import freely_moved_robot
from tests.analyses.calibration.many_swings import START, TRUE, identified, off_by

FARTHEST = 4.0
"""Standard errors, as in the other tests of free motion; `many_swings` counts those beyond 3."""


@pytest.mark.parametrize("group", ["hysteresis", "stiffening", "creep"])
def test_what_the_plant_swung_with_is_found(group):
    found = identified(group, 0)
    assert 0.85 < found.spread < 1.15
    assert np.max(np.abs(off_by(group, found))) < FARTHEST
    names = [unknown.name for unknown in found.unknowns]
    by_name = dict(zip(names, found.values, strict=True))
    std = dict(zip(names, found.std, strict=True))
    for name, value in TRUE[group].items():
        assert std[name] < 0.5 * abs(value), f"{name} is not told"
    assert ("rests beside its pose" in " ".join(found.remarks)) == (group == "hysteresis")
    moved = freely_moved_robot(found)
    rubs = moved.platform.hysteresis
    assert (rubs is not None) == (group == "hysteresis")
    if rubs is not None:  # the file holds what was found, and a fit begins there
        for name in ("tilt", "turn", "slip"):
            assert getattr(rubs, name) == by_name[f"hysteresis.{name}"]
        again = FreeMotionModel.of(moved, START, ("hysteresis",), False, False)
        assert again.by_name(again.before())["hysteresis.tilt"] == rubs.tilt
    does = moved.cable_behaviour()
    assert does.stiffening == pytest.approx(by_name.get("all.stiffening", 0.0))
    assert does.creep_stiffness == pytest.approx(by_name.get("all.creep_stiffness", 0.0))
