"""Tests of `cdpr_drake.analyses.studies.closed_loops`."""
