"""The sensors of a robot beside its camera, added to a diagram when first asked for."""

from __future__ import annotations

from collections.abc import Iterator

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS, SensorSettings


def make_sensor(sensor: str, settings: SensorSettings, robot: Robot, seed: int) -> System | None:
    """One of `SENSORS` as settings ask for it; None where it is ideal: its truth."""
    kind, rate = SENSORS[sensor], settings.rate(sensor)
    if rate is None:
        return None
    return kind.make(settings.model(sensor), robot, seed, rate)


def check_rate(key: str, rate: float, max_step: float) -> None:
    """Refuses a sensor that reads, at the rate of a key [Hz], more often than steps are taken [s].

    Raises:
        ScenarioError: Names the key, its rate and the largest one.
    """
    if rate * max_step > 1.0:
        raise ScenarioError(
            f"{key}: found {rate:g}; accepted: at most {1.0 / max_step:g} "
            f"[Hz], one reading per step of integration.max_step = {max_step:g} s"
        )


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
        self._robot = robot
        self._prefix = f"{name}_" if name else ""
        self._ports: dict[str, OutputPort] = {}
        self._systems: dict[str, SampledSensor] = {}

    def port(self, reading: str) -> OutputPort:
        """The port with the reading of that name."""
        if reading not in self._ports:
            sensor = next(s for s, kind in SENSORS.items() if kind.reading == reading)
            self._ports[reading] = self._add(sensor)
        return self._ports[reading]

    def shortest_period(self) -> float:
        """Time between readings of the fastest sensor that was added; infinite if none [s]."""
        return min((1.0 / rate for _, rate in self._added()), default=float("inf"))

    def check_step(self, max_step: float) -> None:
        """Refuses sensors that read more often than the simulation steps, `max_step` [s].

        Raises:
            ScenarioError: Names the sensor, its rate and the largest one.
        """
        for sensor, rate in self._added():
            check_rate(f"sensors.{sensor}_rate", rate, max_step)

    def fail(self, sensor: str, begins: float, cable: int | None, late: float | None) -> None:
        """Has one of `SENSORS` fail from a time on.

        Args:
            sensor: Its name; it is there and samples.
            begins: The time [s].
            cable: Of which cable; None: of all, or of a pose.
            late: By how much its messages are late [s]; None: it gives what it read last.
        """
        system = self._systems[sensor]
        entries = system.channels(cable)
        if late is None:
            system.freeze(begins, entries)
        else:
            system.delay(begins, entries, late)

    def _added(self) -> Iterator[tuple[str, float]]:
        """Sensors that were added and sample, with their rates [Hz]."""
        for sensor, kind in SENSORS.items():
            rate = self._settings.rate(sensor)
            if kind.reading in self._ports and rate is not None:
                yield sensor, rate

    def _add(self, sensor: str) -> OutputPort:
        kind, rate = SENSORS[sensor], self._settings.rate(sensor)
        truth = self._robot.GetOutputPort(kind.truth)
        if rate is None:
            return truth
        system = make_sensor(sensor, self._settings, self._robot.robot, self._seed)
        assert isinstance(system, SampledSensor)
        self._systems[sensor] = system
        self._builder.AddNamedSystem(self._prefix + kind.block, system)
        self._builder.Connect(truth, system.get_input_port())
        return system.GetOutputPort(kind.output)
