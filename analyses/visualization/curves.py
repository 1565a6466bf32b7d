"""Names of `cdpr_drake.analyses.frame.figures` for planning, workspaces and design."""

from cdpr_drake.analyses.frame import figures, thinning

by_pieces = thinning.by_pieces
draw_bars = figures.draw_bars
draw_curve = figures.draw_curve
path_rows = thinning.path_rows
phase_of = figures.phase_of
shade = figures.shade
