"""The toy target: found in a picture where it was drawn, and known to scenarios."""

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.large_tag import LARGE_ID, LargeTag

QUICK = ["camera.kind=projected", "duration=0.2", "target.kind=large_tag"]


def test_its_points_are_those_of_a_tag_of_twice_the_edge():
    np.testing.assert_array_equal(LargeTag(0.1).points, TagTarget(0, 0.2).points)


def test_its_own_picture_shows_it():
    (drawn,) = LargeTag(0.1).plates()
    (same,) = TagTarget(LARGE_ID, 0.2).plates()
    assert (drawn.png, drawn.width) == (same.png, same.width)


def test_a_servo_has_it():
    servo = cdpr.build_visual_servo(cdpr.load_scenario("acrobot_pbvs", QUICK))
    np.testing.assert_array_equal(servo.target.points, LargeTag(servo.scenario.target.size).points)
