"""Tests of the study `scenarios`."""
