"""Tests of `cdpr_drake`, the verbs of `import cdpr_drake as cdpr`."""
