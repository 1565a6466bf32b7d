from .controller import ServoController as ServoController
from .servo_law import GOALS as GOALS
from .target_motion import KINDS as KINDS
from .turned_view import centring_rates as centring_rates
from .turned_view import steady_view as steady_view
from .visual_features import VisualFeatures as VisualFeatures
from .visual_features import columns as columns
from .visual_features import sighting as sighting
