"""Figures of runs: titles, units, legends, and that they draw what the log says."""

import io
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.simulation import adaptation_report, run_figures
from cdpr_drake.analyses.simulation.hardware_figures import (
    motor_figure,
    reading_errors,
    reading_figure,
)
from cdpr_drake.analyses.simulation.perception_figures import looking_figures
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.estimators.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    LEARNT,
    LEARNT_SIGMA,
)
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.sensors.sensor_settings import (
    DepthSettings,
    InertialSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
    SensorSuite,
)
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion
from tests.figure_faults import figure_faults

SHORT = ("camera.kind=projected", "integration.engine=compiled")

# Figures carry titles, units and legends.


@pytest.fixture(scope="module")
def result():
    return ServoRun(load_scenario("planar_pbvs", [*SHORT, "duration=0.4"])).simulate()


def curves(of):
    return partial(run_figures.cable_curves_figure, quantity=of)


@pytest.mark.parametrize("draw", [
    run_figures.image_path_figure, run_figures.error_figure, run_figures.platform_path_figure,
    curves("cable_velocities"), curves("lengths"), curves("tensions"),
])  # fmt: skip
def test_axes_have_units(result, draw):
    figure = draw(result)
    assert figure_faults(figure) == []
    title = figure.get_suptitle()
    assert "planar_pbvs" in title
    assert result.built.scenario.title in title.replace("\n", " ")
    for axes in figure.axes:
        labels = [axes.get_ylabel()]
        if labels == ["slack cable"]:  # a row a cable, by their names
            labels = []
        if axes.xaxis.get_tick_params()["labelbottom"]:  # else it shares the axis below
            labels.append(axes.get_xlabel())
        if hasattr(axes, "get_zlabel"):
            labels.append(axes.get_zlabel())
        for label in labels:
            assert "[" in label, f"{label!r} has no unit"


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def logged(result, **changes):
    return replace(result, log={**result.log, **changes})


def test_cables_are_in_the_legend(result):
    axes = run_figures.cable_curves_figure(result, "tensions").axes[0]
    assert legend(axes)[:4] == ["C1", "C2", "C3", "C4"]


def test_no_panel_is_empty_where_nobody_looked(result):
    """An open loop has no feature error; its panels once were empty."""
    figure = run_figures.error_figure(logged(result, gain=0.0 * result.log["gain"]))
    assert figure_faults(figure) == []
    assert len(figure.axes) == 2
    assert all(len(axes.lines) == 1 for axes in figure.axes)
    assert "no feature was controlled" in figure.get_suptitle()


def test_a_target_that_was_never_found_leaves_no_empty_panel(result):
    figure = run_figures.image_path_figure(logged(result, found=0.0 * result.log["found"]))
    assert figure_faults(figure) == []
    (image,) = figure.axes
    assert legend(image) == ["desired"]
    assert "never found" in figure.get_suptitle()


@pytest.mark.parametrize(("rows", "begins"), [((5, 9), 0.1), ((0, 9), 0.02), ((0, 0), None)])
def test_times_without_the_target_are_shaded_and_said(result, rows, begins):
    """Not before the first image: 0.02 s of every run were shaded once, too narrow to be seen."""
    gain = result.log["gain"].copy()
    gain[slice(*rows)] = 0.0
    figure = run_figures.error_figure(logged(result, gain=gain))
    assert figure_faults(figure) == []
    axes = figure.axes[0]
    assert ("target not seen" in legend(axes)) == (begins is not None)
    ends = [(shade.get_x(), shade.get_x() + shade.get_width()) for shade in axes.patches]
    assert ends == ([] if begins is None else [pytest.approx((begins, 0.18))])


def test_every_run_has_its_figures_in_the_formats_asked_for(result):
    pictures = run_figures.run_figures(result, ("pdf", "svg"))
    assert {name.rpartition(".")[2] for name in pictures} == {"pdf", "svg"}
    assert {"tensions.pdf", "tensions.svg", "platform_path.pdf"} <= set(pictures)


# Figures of motors and sensors: what they draw, and that errors are those of the readings.


@pytest.fixture(scope="module")
def run():
    overrides = [*SHORT, "duration=0.6", "winches.kind=motor"]
    return ServoRun(load_scenario("acrobot_sensors", overrides)).simulate()


def test_errors_are_those_at_the_instant_of_the_reading(run):
    settings = run.built.scenario.sensors
    vlu850 = load_tension_sensor("vlu850")
    _, error = reading_errors(run.log, settings, "tension")
    assert np.max(np.abs(error)) < vlu850.accuracy + 5.0 * vlu850.repeatability
    # The tensions themselves change by far more from row to row.
    assert np.max(np.abs(np.diff(run.log["tensions"], axis=0))) > 3.0 * vlu850.accuracy
    _, error = reading_errors(run.log, settings, "encoder")
    assert np.max(np.abs(error)) < np.pi / 65536 * 0.0041 * (1.0 + 1e-3)
    _, error = reading_errors(run.log, settings, "metrology")
    assert np.linalg.norm(error, axis=1) == pytest.approx(1e-4, abs=1e-4)


def test_ideal_sensors_have_no_error():
    times = np.linspace(0.0, 1.0, 11)
    log = {"time": times, "tensions": times[:, None], "measured_tensions": times[:, None]}
    _, error = reading_errors(log, SensorSettings(), "tension")
    np.testing.assert_array_equal(error, 0.0)


def test_readings_are_one_period_old():
    """A ramp, read every 0.2 s and logged before each reading."""
    times = np.linspace(0.0, 1.0, 11)
    held = np.array([0.0, 0.0, 0.0, 0.2, 0.2, 0.4, 0.4, 0.6, 0.6, 0.8, 0.8])
    log = {"time": times, "tensions": times[:, None], "measured_tensions": held[:, None]}
    settings = SensorSettings(tension="vlu850", tension_rate=5.0)
    _, error = reading_errors(log, settings, "tension")
    np.testing.assert_allclose(error, 0.0, atol=1e-12)


def test_each_logged_sensor_has_a_panel(run):
    settings = run.built.scenario.sensors
    figure = reading_figure("title", run.built.robot, run.log, settings)
    assert [a.get_ylabel().split(",")[0] for a in figure.axes] == [
        "tension", "length", "tracker", "metrology",
    ]  # fmt: skip
    assert len(figure.axes[0].get_lines()) == 8


def test_motors_have_their_torques_and_friction(run):
    figure = motor_figure("title", run.built.robot, run.log)
    top, bottom = figure.axes
    assert (len(top.get_lines()), len(bottom.get_lines())) == (8, 10)
    assert "[N m]" in top.get_ylabel()
    assert "[N m]" in bottom.get_ylabel()


def test_each_figure_of_the_hardware_has_its_own_title(run, tmp_path, monkeypatch):
    titles = []
    for name in ("motor_figure", "reading_figure"):
        draw = getattr(run_figures, name)

        def noted(title, *arguments, draw=draw):
            titles.append(title.partition("\n")[0])
            return draw(title, *arguments)

        monkeypatch.setattr(run_figures, name, noted)
    pictures = run_figures.run_figures(run)
    for name in ("motor_torques.png", "readings.png"):
        pictures[name](tmp_path / name)
    assert titles == [
        "Torques of the motors and of their friction", "What the sensors read beyond the truth",
    ]  # fmt: skip


# Figures of sensors that look round draw what is not there, too, without a warning.

LABELS_APART = 0.2
"""Between a label and the next one that belongs to another panel [inch]."""

SUITE = SensorSuite(
    range_sensors=[
        RangeSettings(name="fan", type="hokuyo", beams=5),
        RangeSettings(name="one", type="beam"),
    ],
    imu=InertialSettings(),
    depth=DepthSettings(),
    pan_tilt=PanTiltSettings(),
    odometry=OdometrySettings(),
)


def log_of(rows, value):
    """A log in which all sensors read one value."""
    sizes = {
        "scan_fan": 5, "scan_one": 1, "specific_force": 3, "angular_velocity": 3,
        "imu_biases": 6, "depth_row": 4, "pan_tilt_angles": 2, "pan_tilt_encoders": 2,
    }  # fmt: skip
    log = {name: np.full((rows, size), value) for name, size in sizes.items()}
    pose = np.tile([1.0, 0, 0, 0, 0.1, 0.2, 0.3], (rows, 1))
    return log | {"time": 0.1 * np.arange(rows), "X_WO_odometry": pose}


@pytest.mark.parametrize(("rows", "value"), [(1, np.inf), (700, 1.5), (3, -np.inf)])
def test_all_are_drawn_whatever_is_read(rows, value):
    motion = SteadyMotion(RigidTransform(), np.zeros(3), np.zeros(3))
    log = log_of(rows, value)
    for name in ("specific_force", "angular_velocity", "imu_biases"):
        log[name][:] = 1.0
    for name in ("pan_tilt_angles", "pan_tilt_encoders"):
        log[name][:] = 0.2
    drawn = looking_figures(str, SUITE, log, motion, np.full((3, 4), value))
    assert set(drawn) == {"scan_fan", "scan_one", "imu", "depth", "pan_tilt", "odometry"}
    drawn["depth of a run left behind"] = looking_figures(str, SUITE, log, motion, None)["depth"]
    for name, draw in drawn.items():
        if rows == 1 or name.startswith(("scan", "depth")):  # which have gaps
            draw().savefig(io.BytesIO(), dpi=20)


def test_the_scale_of_colours_is_apart_from_the_panel_beside_it():
    """And so are their labels, as they are drawn into a file."""
    motion = SteadyMotion(RigidTransform(), np.zeros(3), np.zeros(3))
    drawn = looking_figures(str, SUITE, log_of(20, 1.5), motion, np.full((240, 320), 1.5))
    for name in ("depth", "scan_fan"):
        figure = drawn[name]()
        assert figure_faults(figure) == []
        scale = next(axes for axes in figure.axes if axes.get_ylabel() == "distance [m]")
        end, begin = (axes.yaxis.label.get_window_extent() for axes in (scale, figure.axes[1]))
        assert begin.x0 - end.x1 > LABELS_APART * figure.dpi, name


#

PANELS_APART = 0.1
"""Between a panel and the label of the next one [inch]."""


def test_no_legend_hides_numbers_that_rise_early_and_labels_are_as_long_as_axes():
    robot, time = load_robot("acrobot_small"), np.linspace(0.0, 8.0, 81)
    m = len(robot.cables)
    truth = np.append(adaptation_report.true_points(robot), np.zeros(m))
    log = {
        "time": time,
        LEARNT: truth + 0.0117 * np.exp(-time)[:, None],
        LEARNT_SIGMA: np.full((81, 7 * m), 0.01),
        ADAPTATION: np.outer(1.0 - np.exp(-3.0 * time), np.full(len(ADAPTATION_PARTS), 20.0)),
    }
    figure = adaptation_report.adaptation_figure("What was learnt", log, robot)
    assert figure_faults(figure) == []
    for row in np.reshape(figure.axes, (2, 3)):
        for axes in row:
            assert axes.yaxis.label.get_window_extent().height < axes.bbox.height
        for left, right in pairwise(row):
            begin = right.yaxis.label.get_window_extent().x0
            assert begin - left.bbox.x1 > PANELS_APART * figure.dpi
