from .cable_figures import draw_cables as draw_cables
from .curves import draw_curve as draw_curve
from .figure_files import figure_writers as figure_writers
from .figure_files import write_figures as write_figures
from .figure_style import bar_style as bar_style
from .figure_style import new_figure as new_figure
from .replay import write_replay as write_replay
