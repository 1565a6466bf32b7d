"""Tests of `cdpr_drake.analyses.studies.basin`."""
