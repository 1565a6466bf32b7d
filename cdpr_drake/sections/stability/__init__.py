"""Section `stability`: the stability criterion of a visual servo in the log of its run."""
