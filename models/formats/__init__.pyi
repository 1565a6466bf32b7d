from .assumptions import complete_draft as complete_draft
from .draft import RobotDraft as RobotDraft
from .reading import robot_name as robot_name
