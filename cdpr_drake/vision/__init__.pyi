from .cable_images import slack_from_image as slack_from_image
from .pinhole import Pinhole as Pinhole
from .target import PointTarget as PointTarget
from .target import Target as Target
from .texture_pictures import drawn_image as drawn_image
from .textured_target import TexturedTarget as TexturedTarget
