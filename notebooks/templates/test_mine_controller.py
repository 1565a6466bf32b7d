"""The controller `mine` brings the robot to where it shall be."""

from mine import distance_after


def test_it_arrives():
    assert distance_after(3.0) < 1e-3


def test_it_comes_nearer():
    assert distance_after(2.0) < distance_after(1.0)
