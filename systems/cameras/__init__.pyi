from .camera_settings import PROJECTED as PROJECTED
from .camera_settings import CameraSettings as CameraSettings
from .projected_camera import ProjectedCamera as ProjectedCamera
from .region_camera import RegionCamera as RegionCamera
from .scene_picture import SceneCamera as SceneCamera
from .target_measurement import TargetDetector as TargetDetector
from .targets import TARGETS as TARGETS
from .targets import TargetSettings as TargetSettings
