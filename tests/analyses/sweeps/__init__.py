"""Tests of `cdpr_drake.analyses.sweeps`."""
