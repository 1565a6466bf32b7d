"""Tests of `cdpr_drake.systems.estimators`."""
