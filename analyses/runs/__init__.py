"""Runs of scenarios: a kind is one class, a subject of a run is one `Section`."""
