"""Tests of `cdpr_drake.kinematics`."""
