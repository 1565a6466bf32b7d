"""Names of `cdpr_drake.analyses.frame.figures` for planning, workspaces and design."""

from cdpr_drake.analyses.frame import figures

DEFAULT_FORMATS = figures.DEFAULT_FORMATS
figure_writers = figures.figure_writers
save_figure = figures.save_figure
write_figures = figures.write_figures
