"""Tests of `cdpr_drake.analyses.repetitions`."""
