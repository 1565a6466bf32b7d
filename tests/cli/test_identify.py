"""`cdpr identify`: what it finds, writes and says, and which logs and requests it refuses."""

import json

import numpy as np
import pytest

from cdpr_drake.models.robot_dynamics import dynamic_model
from cdpr_drake.models.robot_loader import load_robot
from tests.cli.commands import refuse, run, told, write_log
from tests.identification.logs import TRUE, log

NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}
HEADER = ["time_s", *(f"X_WP.{n}" for n in ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"))]


def write(path, time, poses, tensions):
    """A log with columns as `cdpr simulate` names them."""
    header = [*HEADER, *(f"measured_tensions.C{i + 1}_n" for i in range(tensions.shape[1]))]
    return write_log(path, dict(zip(header, [time, *poses.T, *tensions.T], strict=True)))


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    fitted = write(folder / "a.csv", *log(span=4.0, **NOISE))
    return fitted, write(folder / "b.csv", *log(span=4.0, seed=1, turn=0.7, move=-0.8, **NOISE))


def identify(path, out="out"):
    return "identify", "acrobot_large", path, "--no-pulleys", "--out", out


def test_a_log_identifies_and_another_one_validates(tmp_path, logs, capsys):
    out = tmp_path / "out"
    said = told(capsys, *identify(logs[0], out), "--validate", logs[1])
    assert said == json.loads((out / "results.json").read_text())
    assert (out / "validation.png").exists()
    assert said["status"] == "optimal"
    mass = said["parameters"][0]
    assert mass["name"] == "mass"
    assert abs(mass["value"] - TRUE.mass) < 4.0 * mass["std"]
    # A motion that was not fitted is explained as well as the one that was.
    inside, outside = said["fitted_log"], said["log_not_fitted"]
    for what in ("force_n", "moment_nm"):
        assert outside["identified"][what] < 1.3 * inside["identified"][what]
        assert outside["identified"][what] < 0.2 * outside["believed"][what]
    # The file is a robot that can be believed in.
    found = dynamic_model(load_robot(str(out / "robot.yaml")))
    assert found.mass == pytest.approx(mass["value"])
    np.testing.assert_allclose(found.center_of_mass, TRUE.center_of_mass, atol=1e-3)
    np.testing.assert_allclose(found.inertia, TRUE.inertia, atol=3e-3)


@pytest.mark.usefixtures("no_room_for_pictures")
def test_a_fit_that_misses_its_noise_ends_with_6_and_names_where(tmp_path, capsys):
    """Also where figures fail."""
    time, poses, tensions = log(span=2.0, **NOISE)
    tensions[:, 3] *= 1.5  # as one sensor shows it
    path, out = write(tmp_path / "log.csv", time, poses, tensions), tmp_path / "out"
    code, words, err = run(capsys, *identify(path, out))
    assert code == 6
    assert "validation.png: not written: " in err
    assert "No space left" in err
    said = json.loads((out / "results.json").read_text())
    assert said["status"] == "misfit"
    assert said["residuals_over_sigma"] > said["misfit_factor"] == 3.0
    most = said["largest_residuals"][0]
    assert 0.0 <= most["time_s"] <= 2.0
    assert most["equation"].startswith(("moment about ", "force along "))
    assert most["unit"] in ("N", "N m")
    assert most["sigmas"] > 3.0
    times = [one["time_s"] for one in said["largest_residuals"]]
    assert len(times) == len(set(times)) == 5
    assert any(words.startswith("misfit: residuals are") for words in said["remarks"])
    assert "Identified: misfit" in (out / "robot.yaml").read_text()
    words = " ".join(words.split())
    for word in ("acrobot_large: misfit", "Largest residuals", most["equation"]):
        assert word in words


def spoiled(kind):
    time, poses, tensions = log(span=4.0, **NOISE)
    if kind == "still":
        return log(span=4.0, turn=0.0, move=0.0, **NOISE)
    if kind == "cables":
        return time, poses, tensions[:, :4]
    return time, poses[np.maximum(np.arange(len(time)) - 30, 0)], tensions


def test_logs_and_requests_that_cannot_tell_end_with_2(tmp_path, logs, capsys):
    for kind, words in (
        ("still", "cannot be told"),
        ("cables", "tensions: found none of C5, C6, C7, C8"),
        ("late", "tracker: found it 0.12"),
    ):
        path = write(tmp_path / "log.csv", *spoiled(kind))
        assert words in refuse(capsys, *identify(path, tmp_path / "out"))
    for options, words in (
        (("--unknown", "weight"), "--unknown: found 'weight'"),
        (("--bandwidth", "0"), "--bandwidth: found 0 Hz"),
        (("--unknown", "stiffness"), "cable lengths: found none"),
        (("--unknown", "friction"), "motor torques: found none"),
        (("--prior", "weight=1"), "--prior: found 'weight'"),
    ):
        assert words in refuse(capsys, *identify(logs[0], tmp_path / "out"), *options)
    assert not (tmp_path / "out").exists()
