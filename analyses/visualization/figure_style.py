"""Names of `cdpr_drake.analyses.frame.figures` for planning, workspaces and design."""

from cdpr_drake.analyses.frame import figures

COVERED_LINE = figures.COVERED_LINE
bar_style = figures.bar_style
bare_figure = figures.bare_figure
few_ticks = figures.few_ticks
lay_out = figures.lay_out
line_style = figures.line_style
new_figure = figures.new_figure
plain_numbers = figures.plain_numbers
spread = figures.spread
styled = figures.styled
