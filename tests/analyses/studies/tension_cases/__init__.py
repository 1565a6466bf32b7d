"""Tests of `cdpr_drake.analyses.studies.tension_cases`."""
