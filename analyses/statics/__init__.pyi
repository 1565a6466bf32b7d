from .modelling_errors import errors_figure as errors_figure
from .modelling_errors import pose_errors as pose_errors
from .modelling_errors import poses_in as poses_in
from .modelling_errors import slack_along_path as slack_along_path
from .modelling_errors import slack_figure as slack_figure
from .modelling_errors import usual_beliefs as usual_beliefs
from .modelling_errors import wrong_geometry as wrong_geometry
