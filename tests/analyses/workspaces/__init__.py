"""Tests of `cdpr_drake.analyses.workspaces`."""
