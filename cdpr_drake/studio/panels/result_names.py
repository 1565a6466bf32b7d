"""Names of the results that panels show; the table of panels has words for each."""

WORKSPACES = "workspaces"
"""Computed workspaces."""

RUN, COMPARED = "run", "compared"
"""The run that is shown, and the one behind it."""

LOG = "log"
"""A log beside the model."""

STUDY = "study"
"""A study."""
