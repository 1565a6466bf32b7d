"""The study `proven-paths`: paths in proven sets beside other planners, in drawn problems."""
