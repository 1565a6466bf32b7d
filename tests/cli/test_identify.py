import json

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.identified_robots import dynamic_model
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot
from tests.identification.logs import TRUE, log
from tests.messages import printed

NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}
HEADER = ["time_s", *(f"X_WP.{n}" for n in ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"))]


def run(*args):
    """Exit code of `cdpr`."""
    with pytest.raises(SystemExit) as ended:
        main([str(arg) for arg in args])
    return ended.value.code


def write(path, time, poses, tensions):
    """A log with columns as `cdpr simulate` names them; NaN becomes an empty cell."""
    header = [*HEADER, *(f"measured_tensions.C{i + 1}_n" for i in range(tensions.shape[1]))]
    rows = np.column_stack([time, poses, tensions])
    lines = [",".join("" if not np.isfinite(v) else f"{v:.12g}" for v in row) for row in rows]
    path.write_text("\n".join([",".join(header), *lines]) + "\n")
    return str(path)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    fitted = write(folder / "a.csv", *log(span=4.0, **NOISE))
    return fitted, write(folder / "b.csv", *log(span=4.0, seed=1, turn=0.7, move=-0.8, **NOISE))


def test_a_log_identifies_and_another_one_validates(tmp_path, logs, capsys):
    out = tmp_path / "out"
    fitted, other = logs
    args = ["identify", "acrobot_large", fitted, "--validate", other, "--no-pulleys", "--json"]
    assert run(*args, "--out", out) == 0
    said = json.loads(printed(capsys).out)
    assert said == json.loads((out / "identification.json").read_text())
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


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """A log of which one tension sensor shows half as much again."""
    time, poses, tensions = log(span=4.0, **NOISE)
    tensions[:, 3] *= 1.5
    return write(tmp_path_factory.mktemp("broken") / "log.csv", time, poses, tensions)


def test_a_fit_that_misses_its_noise_ends_with_6_and_names_where(tmp_path, broken, capsys):
    out = tmp_path / "out"
    args = ["identify", "acrobot_large", broken, "--no-pulleys", "--out", out]
    assert run(*args, "--json") == 6
    said = json.loads(capsys.readouterr().out)
    assert said["status"] == "misfit"
    assert said["residuals_over_sigma"] > said["misfit_factor"] == 3.0
    most = said["largest_residuals"][0]
    assert 0.0 <= most["time_s"] <= 4.0
    assert most["equation"].startswith(("moment about ", "force along "))
    assert most["unit"] in ("N", "N m")
    assert most["sigmas"] > 3.0
    times = [one["time_s"] for one in said["largest_residuals"]]
    assert len(times) == len(set(times)) == 5
    assert any(words.startswith("misfit: residuals are") for words in said["remarks"])
    assert "Identified: misfit" in (out / "robot.yaml").read_text()
    assert run(*args, "--overwrite") == 6
    told = " ".join(capsys.readouterr().out.split())
    assert "acrobot_large: misfit" in told
    assert "Largest residuals" in told
    assert most["equation"] in told


@pytest.mark.usefixtures("no_room_for_pictures")
def test_a_misfit_is_said_also_where_figures_fail(tmp_path, broken, capsys):
    args = ["identify", "acrobot_large", broken, "--no-pulleys", "--json"]
    assert run(*args, "--out", tmp_path / "out") == 6
    assert "not written: [Errno 28]" in printed(capsys).err


@pytest.mark.usefixtures("no_room_for_pictures")
def test_figures_that_fail_cost_nothing_else(tmp_path, logs, capsys):
    out = tmp_path / "out"
    args = ["identify", "acrobot_large", logs[0], "--no-pulleys", "--json", "--out", out]
    assert run(*args) == 3
    said, err = printed(capsys)
    assert json.loads(said) == json.loads((out / "identification.json").read_text())
    assert load_robot(str(out / "robot.yaml"))
    assert "validation.png: not written: [Errno 28]" in err
    assert "The data is complete" in err
    assert not [path for path in out.rglob("*") if "png" in path.name]


def spoiled(kind):
    time, poses, tensions = log(span=4.0, **NOISE)
    if kind == "still":
        time, poses, tensions = log(span=4.0, turn=0.0, move=0.0, **NOISE)
    elif kind == "cables":
        tensions = tensions[:, :4]
    elif kind == "late":
        poses = poses[np.maximum(np.arange(len(time)) - 30, 0)]
    return time, poses, tensions


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("still", "cannot be told"),
        ("cables", "tensions: found none of C5, C6, C7, C8"),
        ("late", "tracker: found it 0.12"),
    ],
)
def test_logs_that_cannot_tell_end_with_2(tmp_path, capsys, kind, words):
    path = write(tmp_path / "log.csv", *spoiled(kind))
    out = tmp_path / "out"
    args = ["identify", "acrobot_large", path, "--no-pulleys", "--out", str(out)]
    assert run(*args) == 2
    said = printed(capsys).err
    assert words in said
    assert said.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty log"),
        ("time_s,C1_tension_n\n", "header without rows"),
        ("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n", "tensions: found none"),
        ("time_s,C1_tension_n\n0,1\n1,2\n", "poses: found none"),
        ("x_m,C1_tension_n\n0,nan\n", "found nan"),
        ("C1_tension_n\n1\n", "time: found none"),
    ],
)
def test_files_that_are_no_logs_end_with_2(tmp_path, capsys, text, words):
    path = tmp_path / "log.csv"
    path.write_text(text)
    assert run("identify", "acrobot_large", path) == 2
    assert words in printed(capsys).err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--unknown", "weight"], "--unknown: found 'weight'"),
        (["--bandwidth", "0"], "--bandwidth: found 0 Hz"),
        (["--unknown", "stiffness"], "cable lengths: found none"),
        (["--unknown", "friction"], "motor torques: found none"),
        (["--prior", "mass"], "--prior: found 'mass'"),
        (["--prior", "weight=1"], "--prior: found 'weight'"),
    ],
)
def test_impossible_requests_end_with_2(logs, capsys, options, words):
    assert run("identify", "acrobot_large", logs[0], *options) == 2
    assert words in printed(capsys).err


def test_a_planar_robot_is_refused(logs, capsys):
    assert run("identify", "planar", logs[0]) == 2
    assert "motion: found 2T1R" in printed(capsys).err
