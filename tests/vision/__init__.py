"""Tests of `cdpr_drake.vision`."""

"""Tests of `cdpr_drake.vision`."""
