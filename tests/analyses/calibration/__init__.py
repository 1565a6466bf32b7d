"""Tests of `cdpr_drake.analyses.calibration`."""
