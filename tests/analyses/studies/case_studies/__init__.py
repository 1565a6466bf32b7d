"""Tests of `cdpr_drake.analyses.studies.case_studies`."""
