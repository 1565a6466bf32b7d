"""Tests of `cdpr_drake.analyses.workspaces`."""

"""Tests of `cdpr_drake.analyses.workspaces`."""
