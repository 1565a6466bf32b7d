"""Tests of `cdpr_drake.systems.controllers`."""

"""Tests of `cdpr_drake.systems.controllers`."""
