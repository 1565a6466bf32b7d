"""Tests of `cdpr_drake.calibration`."""
