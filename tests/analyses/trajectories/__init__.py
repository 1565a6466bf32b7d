"""Tests of `cdpr_drake.analyses.trajectories`."""
