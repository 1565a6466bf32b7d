"""A robot at rest on cables that stiffen, are warm, or rub in their sheaves."""

import json
from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.cables.cable_behaviour import tension_of_strain
from cdpr_drake.cables.models import check_model
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.settings import CableSettings

STIFFENING, EXPANSION, WARMER, FRICTION = 2e-3, 1.2e-5, 12.0, 0.03

FORCE_TOLERANCE = 1e-6
"""Of tensions that follow from lengths, relative: lengths are exact to 1e-12 m of 1e-3 m."""


def robot(name="acrobot_large", **behaviour):
    """A robot with a section `cable.behaviour`."""
    loaded = load_robot(name)
    settings = BehaviourSettings(**behaviour) if behaviour else None
    return replace(loaded, cable=replace(loaded.cable, behaviour=settings))


def test_counted_lengths_give_the_tensions_by_the_law():
    one = robot(stiffening=STIFFENING, expansion=EXPANSION, warmer=WARMER)
    rest, plain = cdpr.solve_static(one), cdpr.solve_static("acrobot_large")
    np.testing.assert_allclose(rest.tensions, plain.tensions, rtol=1e-9)
    strains = rest.lengths / (rest.l0 * (1.0 + EXPANSION * WARMER)) - 1.0
    by_law = tension_of_strain(strains, one.stiffness(), STIFFENING)
    np.testing.assert_allclose(by_law, rest.tensions, rtol=FORCE_TOLERANCE)
    # Stiffer cables under tension: every mode is faster.
    assert np.all(rest.frequencies > plain.frequencies)


def test_stiffness_is_the_slope_of_what_lengths_give():
    """One length shorter by a little: the robot comes to rest where the stiffness says."""
    one = robot(stiffening=STIFFENING, expansion=EXPANSION, warmer=WARMER)
    rest = cdpr.solve_static(one)
    again = cdpr.solve_static(one, lengths=rest.l0)
    moved = again.X_WP.translation() - rest.X_WP.translation()
    assert np.linalg.norm(moved) < 1e-8
    np.testing.assert_allclose(again.tensions, rest.tensions, rtol=1e-5)
    np.testing.assert_allclose(again.stiffness, rest.stiffness, rtol=1e-5, atol=1e-2)
    np.testing.assert_array_equal(again.l0, rest.l0)


def test_sheaves_show_between_winding_up_and_paying_out():
    one = robot("irma4u", sheave_friction=FRICTION)
    pose = pose_from_angles(np.array([0.0, 0.0, 0.4]), np.zeros(3))
    rest = cdpr.solve_static(one, pose)
    told = rest.as_dict()
    up = np.array(told["drum_tensions_winding_up_n"])
    down = np.array(told["drum_tensions_paying_out_n"])
    cables = one.cable_set()
    wraps = cable_paths(rest.X_WP, cables).arcs / cables.pulley_radius
    assert np.all(wraps > 1.0)
    np.testing.assert_allclose(np.log(up / down), 2.0 * FRICTION * wraps, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(up * down), rest.tensions, rtol=1e-9)


def test_off_is_the_same_to_the_bit():
    zeros = robot(stiffening=0.0)
    a, b = cdpr.solve_static(zeros).as_dict(), cdpr.solve_static("acrobot_large").as_dict()
    assert json.dumps(a) == json.dumps(b)


def test_what_does_not_know_them_says_so():
    one = robot(stiffening=STIFFENING)
    with pytest.raises(CableModelError, match="found catenary for cables that stiffen or are warm"):
        cdpr.solve_static(one, model="catenary")
    with pytest.raises(CableModelError, match="found catenary for cables with a behaviour"):
        check_model("catenary", CableSettings().cable_set(one))
    assert CableSettings().cable_set(robot(stiffening=0.0)).count == 8


def test_a_rest_prints_drum_tensions_or_that_friction_does_nothing():
    one = robot("irma4u", sheave_friction=FRICTION)
    for pulleys, words in (
        (True, "tensions at the drums while cable is wound up [N]:"),
        (False, "note: sheave_friction 0.03 of irma4u does nothing without pulleys"),
    ):
        assert words in repr(cdpr.solve_static(one, [0.0, 0.0, 0.4], pulleys=pulleys))
