"""The sensors of a robot beside its camera, added to a diagram when first asked for."""

from __future__ import annotations

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry import cable_lengths
from cdpr_drake.models import load_encoder, load_pose_sensor, load_tension_sensor
from cdpr_drake.systems.robots import RobotBlock
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.settings import SENSORS, SensorSettings
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor

READINGS = {
    "tension": "measured_tensions",
    "encoder": "measured_lengths",
    "tracker": "X_WP_measured",
    "metrology": "X_WP_metrology",
}
"""What each of `SENSORS` reads, as estimators and logs name it."""

_TRUTHS = {
    "tension": "tensions",
    "encoder": "unstrained_lengths",
    "tracker": "X_WP",
    "metrology": "X_WP",
}

METROLOGY_SEED = 104_729
"""Added to the seed, so that metrology does not share the tracker's noise."""


class SensorReadings:
    """Offers ports with readings by name, and adds the sensors behind them when first asked.

    ================= ============== ===== ====================================================
    name              type           unit  meaning
    ================= ============== ===== ====================================================
    measured_tensions vector(m)      N     from the tension sensors
    measured_lengths  vector(m)      m     unstrained lengths that the encoders count
    X_WP_measured     RigidTransform m     from the tracker
    X_WP_metrology    RigidTransform m     from metrology
    ================= ============== ===== ====================================================

    Subsystems: tension_sensors, encoders, tracker, metrology, as far as they exist. Ideal ones are
    the robot's true ports.
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        robot: RobotBlock,
        settings: SensorSettings,
        *,
        seed: int = 0,
        name: str = "",
    ) -> None:
        """With the builder that has the robot; `name` stands before the names of blocks."""
        self._builder, self._settings, self._seed = builder, settings, seed
        self._robot, self._block = robot.robot, robot
        self._prefix = f"{name}_" if name else ""
        self._ports: dict[str, OutputPort] = {}

    def port(self, name: str) -> OutputPort:
        """The port of that name, one of `READINGS`."""
        if name not in self._ports:
            sensor = next(s for s in SENSORS if READINGS[s] == name)
            self._ports[name] = self._add(sensor)
        return self._ports[name]

    def shortest_period(self) -> float:
        """Time between readings of the fastest sensor that was added; infinite if none [s]."""
        rates = [self._settings.rate(s) for s in SENSORS if READINGS[s] in self._ports]
        return min((1.0 / rate for rate in rates if rate is not None), default=float("inf"))

    def check_step(self, max_step: float) -> None:
        """Refuses sensors that read more often than the simulation steps, `max_step` [s].

        Raises:
            ScenarioError: Names the sensor, its rate and the largest one.
        """
        for sensor in SENSORS:
            rate = self._settings.rate(sensor)
            if READINGS[sensor] in self._ports and rate is not None and rate * max_step > 1.0:
                raise ScenarioError(
                    f"sensors.{sensor}_rate: found {rate:g}; accepted: at most {1.0 / max_step:g} "
                    f"[Hz], one reading per step of integration.max_step = {max_step:g} s"
                )

    def _add(self, sensor: str) -> OutputPort:
        truth = self._block.GetOutputPort(_TRUTHS[sensor])
        rate = self._settings.rate(sensor)
        if rate is None:
            return truth
        kind = self._settings.kind(sensor)
        name, system = self._make(sensor, kind, rate)
        self._builder.AddNamedSystem(self._prefix + name, system)
        self._builder.Connect(truth, system.get_input_port())
        port = "X_WP_measured" if sensor == "metrology" else READINGS[sensor]
        return system.GetOutputPort(port)

    def _make(self, sensor: str, kind: str, rate: float) -> tuple[str, System]:
        """Name and block of a sensor."""
        robot, seed = self._robot, self._seed
        if sensor == "tension":
            slack = robot.slack_readings
            model = load_tension_sensor(kind)
            return "tension_sensors", TensionSensor(model, len(robot.cables), seed, slack, rate)
        if sensor == "encoder":
            # The lengths at which counts are zero; by convention straight ones.
            cables = robot.cable_set().without_pulleys()
            home = cable_lengths(robot.home.transform(), cables.p_WA, cables.p_PB)
            return "encoders", MotorEncoders(load_encoder(kind), robot.drum(), home, rate=rate)
        # Registered with the platform at home, in the middle of the robot.
        registered = robot.home.transform()
        if sensor == "metrology":
            seed += METROLOGY_SEED
        return sensor, PoseSensor(load_pose_sensor(kind), registered, seed, rate)
