"""Tests of `cdpr_drake.workspaces`."""
