from .inertial_sensor import InertialSensor as InertialSensor
from .perception_sensors import add_perception_sensors as add_perception_sensors
from .sampled_sensor import SampledSensor as SampledSensor
from .scene_shapes import SceneShapes as SceneShapes
from .sensor_kinds import SENSORS as SENSORS
from .sensor_kinds import SensorSettings as SensorSettings
from .sensor_settings import SensorSuite as SensorSuite
