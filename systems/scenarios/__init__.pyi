from .files import scenario_file as scenario_file
from .files import scenario_names as scenario_names
from .run_settings import ScenarioHeader as ScenarioHeader
from .tension_control_scenario import Stretch as Stretch
from .visual_servo_scenario import Scenario as Scenario
from .visual_servo_scenario import VisualServoSettings as VisualServoSettings
