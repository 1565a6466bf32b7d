"""Tests of `cdpr_drake.trajectories`."""
