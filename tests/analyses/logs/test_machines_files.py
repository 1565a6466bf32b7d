"""Files that owners of machines post: Maslow's CLBM, older logs of GRAB, text and bags of ROS."""

import numpy as np
import pytest

from cdpr_drake.analyses.logs.dialects import DIALECTS, Dialect, first_line, read_log, recognise
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import LogFileError
from tests.analyses.logs import recorders

READ = 1e-9
"""Times of bags are whole nanoseconds [s]."""


def test_the_last_list_of_a_maslow_has_all_poses(write):
    path = write("serial.log", recorders.maslow())
    log = read_measurements(path, ["tl", "tr", "bl", "br"])
    assert log.lengths.shape == (8, 4)
    np.testing.assert_allclose(log.lengths[7], [2.78087, 1.69887, 2.3495, 1.0004])
    assert log.headers == {"cable lengths": ("bl", "br", "tr", "tl")}


@pytest.mark.parametrize("cells", [11, 12])
def test_older_logs_of_grab(cells, write):
    log = read_log(write("prova.log", recorders.grab_older(cells)))
    assert len(log.frame) == 40
    np.testing.assert_allclose(log.frame["C4_length_m"], 0.8 + 0.001 * np.arange(40))
    np.testing.assert_allclose(log.frame["C1_swivel_rad"], 0.01 * np.arange(40))
    assert ("C2_tension_n" in log.frame) == (cells == 12)
    assert cells == 11 or set(log.frame["C2_tension_n"]) == {30.0}
    assert any(remark.startswith("8 lines that came up to 2.5 ms") for remark in log.remarks)


def test_text_of_ros_has_the_times_of_the_sender(write):
    log = read_log(write("echo.csv", recorders.ros()))
    np.testing.assert_allclose(log.time, 0.01 * np.arange(6), atol=READ)
    np.testing.assert_allclose(log.frame["x_m"], 0.1 * np.arange(6))
    fates = dict(zip(log.ledger["header"], log.ledger["fate"], strict=True))
    assert fates["%time"] == "worse"
    assert fates["field.header.frame_id"] == "left out"
    late = recorders.ros().splitlines()  # a sender without a clock: its stamps are 0
    late = [late[0], *(f"{row.split(',')[0]},0,0,w,{row.split(',', 4)[4]}" for row in late[1:])]
    log = read_log(write("echo.csv", "\n".join(late) + "\n"))
    np.testing.assert_allclose(log.time, 0.01 * np.arange(6), atol=READ)


def test_a_recorder_with_seven_columns_and_its_own_units_is_one_entry(write, monkeypatch):
    text = "#rec v2\ntick,beltA,beltB,pullA,pullB,px,py\n0,39.37,20,1,2,100,200\n10,40,21,1,2,1,2\n"
    monkeypatch.setitem(DIALECTS, "mine", Dialect(
        "my recorder", lambda head: "it begins with #rec" if head.startswith("#rec") else "",
        columns=(("tick", "time_ms"), (r"belt(\w)", "{}_length_in"),
                 (r"pull(\w)", "{}_tension_kgf"), (r"p([xy])", "{}_mm")),
    ))  # fmt: skip
    path = write("rec.txt", text)
    assert recognise(path)[0] == "mine"
    log = read_log(path)
    assert list(log.frame) == ["time_s", "A_length_m", "B_length_m", "A_tension_n", "B_tension_n",
                               "x_m", "y_m"]  # fmt: skip
    np.testing.assert_allclose(log.frame.iloc[0], [0, 0.999998, 0.508, 9.80665, 19.6133, 0.1, 0.2])
    assert first_line("tick")("tick,a\n") == "its first line has 'tick'"


@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_a_bag_is_read_at_the_times_of_what_measures_cables(plugin, tmp_path):
    from rosbags.rosbag2 import StoragePlugin

    recorders.rosbag(tmp_path / "bag", StoragePlugin[plugin])
    log = import_log(tmp_path / "bag")
    (file,) = (path for path in (tmp_path / "bag").iterdir() if path.suffix != ".yaml")
    assert read_log(file).frame.equals(log.frame)
    np.testing.assert_allclose(log.time, 0.01 * np.arange(100), atol=READ)
    np.testing.assert_allclose(log.frame["C1_motor_angle_rad"], 0.1 * np.arange(100))
    np.testing.assert_allclose(log.frame["x_m"][1:99], 0.01 * np.arange(1, 99), atol=READ)
    assert np.isnan(log.frame["x_m"][0])
    assert any("joints of /winches: 0 is winch_left" in remark for remark in log.remarks)
    fates = dict(zip(log.ledger["header"], log.ledger["fate"], strict=True))
    assert fates["/note/data"] == "words"
    alone = import_log(tmp_path / "bag", topic=["/tracker/pose"])
    assert len(alone.frame) == 50
    with pytest.raises(LogFileError, match="topic: found /no; accepted: some of"):
        import_log(tmp_path / "bag", topic=["/no"])
    file.write_bytes(file.read_bytes()[:300])
    with pytest.raises(LogFileError, match=r"cannot be read as|found"):
        read_log(file)
