"""Tests of `cdpr_drake.stability`."""

"""Tests of `cdpr_drake.stability`."""

"""Tests of `cdpr_drake.stability`."""

"""Tests of `cdpr_drake.stability`."""
