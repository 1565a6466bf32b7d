"""Logs as recorders write them: what is read is what was recorded, or is refused in one line."""

import numpy as np
import pytest
from scipy.io import savemat

from cdpr_drake.analyses.logs.clocks import join_logs
from cdpr_drake.analyses.logs.dialects import DIALECTS, Dialect, first_line, read_log, recognise
from cdpr_drake.analyses.logs.import_log import axes_rotation, import_log, with_mapping
from cdpr_drake.analyses.logs.log import Facts
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import CdprError, LogFileError
from tests.analyses.logs import recorders
from tests.figure_faults import figure_faults

DIGITS = 5.1e-5
"""Controllers write lengths with four digits behind the point [m]."""

PRINTED = 2e-6
"""Times have six digits behind the point, and the sled moves at 2 m/s at most [m]."""

READ = 1e-9
"""Times of bags are whole nanoseconds [s]."""

FILES = {
    "gtgraffiti": ("log.txt", recorders.gtgraffiti),
    "motive": ("take.csv", recorders.motive),
    "grab": ("raw.log", recorders.grab),
    "hangprinter": ("simulation.py", recorders.hangprinter_script),
    "maslow": ("serial.log", recorders.maslow),
    "ros": ("echo.csv", recorders.ros),
    "csv": ("log.csv", recorders.columns),
}

TOLD = Facts(units={"length": "m"}, rate=100.0)


def test_every_reader_has_a_file_here():
    assert {*FILES, "mat", "mcap", "rosbag"} == set(DIALECTS)


@pytest.mark.parametrize("format", FILES)
def test_a_file_is_told_by_what_is_in_it_and_read_by_calibrations(format, write, tmp_path):
    file, make = FILES[format]
    path = write(file, make())
    name, why = recognise(path)
    assert (name, bool(why)) == (format, True)
    log = read_log(path, TOLD)
    log.write(tmp_path / "out.csv")
    again = read_log(tmp_path / "out.csv")
    assert list(again.frame) == list(log.frame)
    for header, values in log.frame.items():
        np.testing.assert_allclose(again.frame[header], values, rtol=1e-11)
    if format == "grab":
        read = read_measurements(tmp_path / "out.csv", log.cables())
        np.testing.assert_allclose(read.lengths[:, 2], log.frame["C3_length_m"], rtol=1e-11)
        np.testing.assert_allclose(read.tensions[:, 1], log.frame["C2_tension_n"], rtol=1e-11)


def test_a_controller_and_a_tracker_are_one_log(write):
    first = read_log(write("log.txt", recorders.gtgraffiti()), TOLD)
    take = write("take.csv", recorders.motive())
    asked = Facts(units={"length": "m"}, R_WF=axes_rotation("-z,-x,y"))
    log = join_logs(first, read_log(take, asked))
    clocks = log.clocks
    at = 5.0 + clocks["shift_s"] + clocks["drift"] * (5.0 - clocks["reference_s"])
    assert abs(at - (5.0 + recorders.MOTIVE_SHIFT)) < 5.0 * clocks["shift_sigma_s"] + 1e-6
    assert clocks["shift_sigma_s"] < 1e-3
    seen = np.isfinite(log.frame["x_m"])
    true = recorders.positions(log.time)
    for k, header in enumerate(("x_m", "y_m", "z_m")):
        assert np.max(np.abs(log.frame[header] - true[:, k])[seen]) < 1e-3
    np.testing.assert_allclose(
        log.table([f"C{k}_length_m" for k in (1, 2, 3, 4)]), recorders.lengths(true), atol=DIGITS
    )
    assert any("sigma" in words for words in log.remarks)


def test_a_tracker_in_other_axes_and_units(write):
    path = write("take.csv", recorders.motive(units="Millimeters"))
    log = read_log(path, Facts(R_WF=axes_rotation("-z,-x,y")))
    seen = np.isfinite(log.frame["x_m"])
    assert np.count_nonzero(~seen) == 16  # rows in which the body was not seen
    true = recorders.positions(log.time + recorders.MOTIVE_SHIFT)
    np.testing.assert_allclose(log.frame["z_m"][seen], true[seen, 2], atol=PRINTED)
    np.testing.assert_allclose(log.frame["x_m"][seen], true[seen, 0], atol=PRINTED)
    np.testing.assert_allclose(log.frame["marker_Corner_1_y_m"], 0.1)
    np.testing.assert_allclose(log.frame["qw"][seen], 1.0)


def test_gaps_and_rows_twice_are_told(write):
    log = read_log(write("raw.log", recorders.grab()))
    rows = log.rows_summary()
    assert rows["gaps"] == 1
    assert rows["longest_gap_s"] == pytest.approx(5.1)
    assert rows["longest_gap_at_s"] == pytest.approx(13.0)
    lines = recorders.columns().split("\n")
    lines.insert(7, lines[6])
    twice = read_log(write("twice.csv", "\n".join(lines)))
    assert twice.repeated == 1
    assert len(twice.frame) == 20


def test_series_of_a_hangprinter(write):
    log = read_log(write("simulation.py", recorders.hangprinter_script()))
    again = read_log(write("samples.csv", recorders.hangprinter_columns()))
    angles = log.table([f"{name}_motor_angle_rad" for name in "ABCD"])
    np.testing.assert_allclose(angles, np.radians(recorders.MOTOR_ANGLES))
    np.testing.assert_allclose(again.table([f"{n}_motor_angle_rad" for n in "ABCD"]), angles)
    np.testing.assert_allclose(log.frame["x_m"][:2], 1e-3 * recorders.POINTS[:, 0])
    assert np.isnan(log.frame["x_m"][2])
    assert "raw_force_A" in log.frame
    path = write("simulation.py", recorders.hangprinter_script())
    told = read_log(path, Facts(units={"force": "n"}))
    assert told.frame["A_tension_n"][0] == 13.7


def test_columns_without_a_header_need_a_mapping(write):
    path = write("real.csv", "1,2.5,3\n2,3.5,3\n3,4.5,4\n")
    with pytest.raises(LogFileError, match="no reader of logs recognises"):
        read_log(path)
    with pytest.raises(LogFileError, match="3 columns of numbers without a header"):
        read_log(path, dialect="csv")
    mapping = write("map.yaml", "columns: [commanded_x_mm, C1_length_cm, '']\nrate_hz: 10\n")
    log = read_log(path, with_mapping(Facts(), mapping))
    np.testing.assert_allclose(log.frame["commanded_x_m"], [1e-3, 2e-3, 3e-3])
    np.testing.assert_allclose(log.frame["C1_length_m"], [0.025, 0.035, 0.045])
    np.testing.assert_allclose(log.time, [0.0, 0.1, 0.2])
    assert "rows/s, as told" in log.units["time"]


def test_a_unit_that_nobody_says_is_told_as_assumed(write):
    path = write("log.csv", "time,C1_length\n0,1000\n1,1001\n")
    assert "since neither header nor user" in str(read_log(path).units)
    log = read_log(path, Facts(units={"length": "mm"}))
    np.testing.assert_allclose(log.frame["C1_length_m"], [1.0, 1.001])


def test_parsed_logs_of_grab(tmp_path):
    t = np.arange(50) * 0.1
    path = tmp_path / "parsed.mat"
    st = {"t": t, "epsilon": 0.1 + np.zeros((3, 50)), "cable_length": np.ones((4, 50)),
          "swivel": np.zeros((4, 50)), "tensions": 90.0 + np.arange(4)[:, None] + 0.0 * t,
          "other": np.zeros(7)}  # fmt: skip
    savemat(path, {"st": st})
    log = read_log(path)
    assert log.dialect == "mat"
    np.testing.assert_allclose(log.frame["C4_tension_n"], 93.0)
    np.testing.assert_allclose(log.frame["roll_rad"], 0.1)
    assert "st.other" in log.remarks[0]
    # What was taken at 1 kHz has its turns in degrees, as the inclinometer sends them.
    fast = {f"{name}_r": st[name] for name in ("t", "epsilon", "tensions")}
    savemat(path, {"st": fast})
    log = read_log(path)
    np.testing.assert_allclose(log.frame["pitch_rad"], np.radians(0.1))
    assert "epsilon_r in deg" in log.units["variables"]
    st["swivel"] = np.zeros((4, 49))
    savemat(path, {"st": st})
    with pytest.raises(LogFileError, match="swivel: found 49 rows; accepted: 50"):
        read_log(path)


def test_the_last_list_of_a_maslow_has_all_poses(write):
    path = write("serial.log", recorders.maslow())
    log = read_measurements(path, ["tl", "tr", "bl", "br"])
    assert log.lengths.shape == (8, 4)
    np.testing.assert_allclose(log.lengths[7], [2.78087, 1.69887, 2.3495, 1.0004])
    assert log.headers == {"cable lengths": ("bl", "br", "tr", "tl")}


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


ACCIDENTS = (
    lambda raw, at, rng: raw[:at],
    lambda raw, at, rng: raw[at:],
    lambda raw, at, rng: raw[:at] + b"," + raw[at:],
    lambda raw, at, rng: raw[:at] + bytes(rng.integers(0, 256, 40, dtype=np.uint8)) + raw[at:],
    lambda raw, at, rng: b"\n".join(sorted(raw.split(b"\n"), key=lambda line: rng.random())),
    lambda raw, at, rng: raw.replace(b",", b";", int(rng.integers(1, 50))),
    lambda raw, at, rng: raw.replace(b"\n", b"\r\n", int(rng.integers(1, 500))),
    lambda raw, at, rng: raw.replace(b"1", b"nan", int(rng.integers(1, 5))),
)
"""What happens to the bytes of a file, at a place of it."""


@pytest.mark.parametrize("format", [*FILES, "mat"])
def test_damaged_files_are_read_or_refused(format, tmp_path):
    """Whatever happened to a file, a reader gives finite times that grow, or says what is wrong."""
    if format == "mat":
        path = tmp_path / "log.mat"
        savemat(path, {"st": {"t": np.arange(30.0), "tensions": np.ones((4, 30))}})
        raw = path.read_bytes()
    else:
        name, make = FILES[format]
        path = tmp_path / name
        raw = make(**({"count": 40} if format in ("gtgraffiti", "motive", "grab") else {})).encode()
    for seed in range(64):
        rng = np.random.default_rng(seed)
        path.write_bytes(ACCIDENTS[seed % len(ACCIDENTS)](raw, int(rng.integers(len(raw))), rng))
        for how in ("auto", format):
            words, log = "", None
            try:
                log = read_log(path, TOLD, how)
            except CdprError as problem:
                words = str(problem)
            if log is None:
                assert "\n" not in words
                assert str(path) in words
            else:
                assert len(log.frame) > 0
                assert log.ledger["fate"].astype(bool).all()
                assert log.time is None or np.all(np.diff(log.time) > 0.0)
                assert not np.isinf(log.frame.to_numpy()).any()


@pytest.mark.parametrize("raw", [b"", b"\n\n", b"\x89PNG\r\n\x1a\n\0\0", b"#\n#\n", b"\xff" * 100])
def test_nonsense_is_refused_by_every_reader(raw, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(raw)
    for how in ("auto", *DIALECTS):
        with pytest.raises(LogFileError, match=r"log\.csv.*found|log\.csv: cannot be read"):
            read_log(path, dialect=how)


def test_a_part_of_a_log(write):
    path = write("raw.log", recorders.grab())
    log = import_log(path, start=11.0, until=12.0, every=2)
    np.testing.assert_allclose(log.time, 11.0 + 0.2 * np.arange(6))
    with pytest.raises(LogFileError, match="no rows from 100"):
        import_log(path, start=100.0)


@pytest.mark.parametrize("words", ["x,y", "x,x,z", "y,x,z", "a,b,c", "x,y,-z"])
def test_axes_are_right_handed(words):
    with pytest.raises(LogFileError, match="right-handed"):
        axes_rotation(words)


# Figures.


def drawn(write, header, row):
    """The figure of a log of a few rows, and its axes by their labels."""
    rows = [",".join(str(value * (k + 1)) for value in row) for k in range(5)]
    figure = import_log(write("recorded.csv", "\n".join([header, *rows]) + "\n")).plot()
    assert figure_faults(figure) == []
    return figure, {axes.get_ylabel(): axes for axes in figure.axes}


def test_motor_angles_in_degrees_of_cables_with_any_names_are_drawn(write):
    figure, panels = drawn(
        write, "A_motor_deg,B_motor_deg,C1_motor_angle_rad,x_mm,y_mm,z_mm",
        (90.0, 180.0, 2.0, 1.0, 2.0, 3.0),
    )  # fmt: skip
    assert list(panels) == ["motor angle [rad]", "position [m]"]
    angles = panels["motor angle [rad]"]
    labels = angles.get_legend().get_texts()
    assert [text.get_text() for text in labels] == [f"{c}_motor_angle" for c in ("A", "B", "C1")]
    assert np.allclose(angles.lines[1].get_ydata(), np.pi * np.arange(1, 6))
    assert "not drawn" not in figure.get_suptitle()


def test_columns_that_are_not_drawn_are_said(write):
    header = "time_s,C1_length_m,supply_voltage," + ",".join(f"aux{k}" for k in range(9))
    figure, panels = drawn(write, header, range(1, 13))
    assert list(panels) == ["cable length [m]"]
    title = " ".join(figure.get_suptitle().split())
    assert title.endswith("not drawn: supply_voltage, aux0, aux1, aux2, aux3, aux4, aux5, aux6 "
                          "and 2 more")  # fmt: skip
