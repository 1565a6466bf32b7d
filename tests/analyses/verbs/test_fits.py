"""Verbs that fit or choose: calibration, identification, design."""

import json

import numpy as np
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.calibration import calibration_fit, fit_robot
from cdpr_drake.analyses.fits.dynamics import IdentificationTask, fit_dynamics
from cdpr_drake.analyses.fits.setup import CalibrationTask
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.verbs.verb_checks import as_json, one_line, shows_itself
from tests.identification.logs import log as motion_log


def tracked_poses(robot, path):
    """A log of exact lengths and poses of a robot whose first exit point is 5 mm off."""
    rng = np.random.default_rng(0)
    true = load_robot(robot.name)
    true.cables[0].exit_point = true.cables[0].exit_point + np.array([0.005, 0.0, 0.0])
    names = [cable.name for cable in robot.cables]
    header = [f"{name}_length_m" for name in names]
    rows = []
    for k in range(12):
        x, y = rng.uniform(-0.15, 0.15, 2)
        z = robot.plane_height
        pose = cdpr.Pose(
            position=np.array([x, y, z]), angles_deg=np.array([0.0, 0.0, rng.uniform(-8.0, 8.0)])
        )
        lengths = cable_paths(pose.transform(), true.cable_set()).lengths
        rows.append([k, *lengths, x, y, z, *pose.angles_deg])
    header = ["time_s", *header, "x_m", "y_m", "z_m", "phi_deg", "theta_deg", "psi_deg"]
    lines = [",".join(header), *(",".join(f"{value:.15g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_calibration(planar, tmp_path):
    path = tracked_poses(planar, tmp_path / "log.csv")
    unknown = {"unknown": ("C1.exit_point.x", "C1.exit_point.y")}
    found = cdpr.calibrate(planar, path, **unknown)
    log = read_measurements(path, [cable.name for cable in planar.cables])
    same = calibration_fit(fit_robot(CalibrationTask(robot=planar, log=log, **unknown)))
    told, expected = as_json(found), json.loads(json.dumps(same.as_dict()))
    assert told.pop("seconds") > 0.0
    assert told == {key: value for key, value in expected.items() if key != "seconds"}
    moved = found.model.cables[0].exit_point - planar.cables[0].exit_point
    np.testing.assert_allclose(moved, [0.005, 0.0, 0.0], atol=1e-4)
    shows_itself(found)
    assert isinstance(found.plot(), Figure)
    out = tmp_path / "out"
    kept = cdpr.calibrate(planar, path, **unknown, folder=out, formats=("svg",))
    assert kept.folder == out
    assert {path.name for path in out.glob("*.svg")} == {"calibration.svg", "correlation.svg"}
    assert json.loads((out / "results.json").read_text()) == as_json(kept)
    one_line(lambda: cdpr.calibrate(planar, path, **unknown, folder=out), "add overwrite")
    one_line(lambda: cdpr.calibrate(planar, path, propose=0), "propose: found 0")
    one_line(lambda: cdpr.calibrate(planar, path, sigmas={"length": 1.0}), "lengths")
    one_line(lambda: cdpr.calibrate(planar, tmp_path / "no.csv"), "no.csv")


def test_an_identification(tmp_path):
    robot = load_robot("acrobot_large")
    time, poses, tensions = motion_log(span=4.0, tension=0.3, place=1e-4, angle=2e-4)
    names = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
    header = ["time_s", *(f"X_WP.{name}" for name in names)]
    header += [f"measured_tensions.C{k + 1}_n" for k in range(8)]
    rows = np.column_stack([time, poses, tensions])
    path = tmp_path / "motion.csv"
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.12g")
    fit = cdpr.identify(robot, path, pulleys=False)
    log = read_measurements(path, [cable.name for cable in robot.cables])
    again = fit_dynamics(IdentificationTask(robot=robot, pulleys=False), log)
    np.testing.assert_array_equal([u.value for u in fit.unknowns], again.result.values)
    assert fit.model.platform.mass == again.result.model.mass
    assert cdpr.ParameterCovariance.of(fit).names == again.result.names
    assert "mass" in shows_itself(fit)


def test_a_design(planar, tmp_path):
    found = cdpr.optimize_design(
        planar, goals="capacity-margin", folder=tmp_path / "d", generations=1
    )
    told = json.loads((tmp_path / "d" / "results.json").read_text())
    assert found.as_dict()["best"] == told["best"]
    assert (tmp_path / "d" / "designs.csv").is_file()
    again = cdpr.optimize_design("planar", goals="capacity-margin", generations=1)
    assert again.as_dict()["best"] == told["best"]
    shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.optimize_design(planar, goals="beauty"), "beauty")
    one_line(lambda: cdpr.optimize_design(planar, parameters="no.yaml"), "no.yaml")
