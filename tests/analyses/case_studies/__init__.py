"""Tests of `cdpr_drake.analyses.case_studies`."""
