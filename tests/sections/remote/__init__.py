"""Tests of `cdpr_drake.sections.remote`."""

"""Tests of `cdpr_drake.sections.remote`."""
