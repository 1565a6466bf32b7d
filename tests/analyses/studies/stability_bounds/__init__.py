"""Tests of `cdpr_drake.analyses.studies.stability_bounds`."""
