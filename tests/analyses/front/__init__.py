"""Tests of `cdpr_drake.analyses.front`, the verbs of `import cdpr_drake as cdpr`."""
