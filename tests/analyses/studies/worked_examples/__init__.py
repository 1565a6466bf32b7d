"""Tests of `cdpr_drake.analyses.studies.worked_examples`."""
