"""Tests of `cdpr_drake.analyses.studies.engines`."""
