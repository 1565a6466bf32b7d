"""Tests of `cdpr_drake.workspaces.certificate`."""
