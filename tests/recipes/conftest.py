"""Templates are tests of a copy, in which their modules are."""

collect_ignore = ["templates"]
