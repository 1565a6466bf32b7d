from .candidates import make_candidates as make_candidates
from .program import DesignProgram as DesignProgram
from .rails import RailSettings as RailSettings
from .search import evaluate_design as evaluate_design
from .search import goal_context as goal_context
from .settings import DesignSettings as DesignSettings
from .settings import GoalSettings as GoalSettings
from .settings import MirrorSettings as MirrorSettings
