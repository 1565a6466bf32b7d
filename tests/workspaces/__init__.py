"""Tests of `cdpr_drake.workspaces`."""

"""Tests of `cdpr_drake.workspaces`."""

"""Tests of `cdpr_drake.workspaces`."""

"""Tests of `cdpr_drake.workspaces`."""

"""Tests of `cdpr_drake.workspaces`."""

"""Tests of `cdpr_drake.workspaces`."""
