"""Tests of `cdpr_drake.analyses.studies.control_stability`."""
