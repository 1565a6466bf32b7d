"""Tests of `cdpr_drake.schema`."""
