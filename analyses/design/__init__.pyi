from .candidates import make_candidates as make_candidates
from .goals import GOALS as GOALS
from .search import judging_of as judging_of
from .settings import DesignSettings as DesignSettings
from .settings import GoalSettings as GoalSettings
from .settings import MirrorSettings as MirrorSettings
