from .body_driver import BodyDriver as BodyDriver
from .clearances import WorldClearances as WorldClearances
from .contact import add_contact as add_contact
from .world_scene import WorldScene as WorldScene
