"""Logs as recorders write them: what is read is what was recorded, or is refused in one line."""

import sys

import numpy as np
import pytest
from scipy.io import savemat

from cdpr_drake.analyses.logs.clocks import join_logs
from cdpr_drake.analyses.logs.dialects import DIALECTS, Dialect, first_line, read_log, recognise
from cdpr_drake.analyses.logs.import_log import axes_rotation, import_log, is_log, with_mapping
from cdpr_drake.analyses.logs.log import Facts
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.analyses.reporting.exported_logs import LOG_WRITERS
from cdpr_drake.errors import CdprError, LogFileError
from tests.analyses.logs import recorders
from tests.figure_faults import figure_faults

DIGITS = 5.1e-5
"""Controllers write lengths with four digits behind the point [m]."""

PRINTED = 2e-6
"""Times have six digits behind the point, and the sled moves at 2 m/s at most [m]."""

READ = 1e-9
"""Times of bags are whole nanoseconds [s]."""

CHORD = 1e-6
"""Quaternions between messages lie on chords of 0.02 rad, of 1 / 4 and 3 / 4 [-]."""

FILES = {
    "gtgraffiti": ("log.txt", recorders.gtgraffiti), "motive": ("take.csv", recorders.motive),
    "grab": ("raw.log", recorders.grab), "maslow": ("serial.log", recorders.maslow),
    "hangprinter": ("simulation.py", recorders.hangprinter_script),
    "ros": ("echo.csv", recorders.ros), "csv": ("log.csv", recorders.columns),
}  # fmt: skip

TOLD = Facts(units={"length": "m"}, rate=100.0)


def fates(log):
    return dict(zip(log.ledger["header"], log.ledger["fate"], strict=True))


def cables(log, ending, names):
    return log.table([f"{name}_{ending}" for name in names])


@pytest.mark.parametrize("format", FILES)
def test_a_file_is_told_by_what_is_in_it_and_read_by_calibrations(format, write, tmp_path):
    assert {*FILES, "mat", "mcap", "rosbag"} == set(DIALECTS)
    file, make = FILES[format]
    path = write(file, make())
    name, why = recognise(path)
    assert (name, bool(why)) == (format, True)
    log = read_log(path, TOLD)
    log.write(tmp_path / "out.csv")
    again = read_log(tmp_path / "out.csv")
    assert list(again.frame) == list(log.frame)
    np.testing.assert_allclose(again.frame, log.frame, rtol=1e-11)
    if format == "grab":
        read = read_measurements(tmp_path / "out.csv", log.cables())
        np.testing.assert_allclose(read.lengths[:, 2], log.frame["C3_length_m"], rtol=1e-11)
        np.testing.assert_allclose(read.tensions[:, 1], log.frame["C2_tension_n"], rtol=1e-11)


def test_a_controller_and_a_tracker_are_one_log(write):
    first = read_log(write("log.txt", recorders.gtgraffiti()), TOLD)
    take = write("take.csv", recorders.motive())
    axes = Facts(units={"length": "m"}, R_WF=axes_rotation("-z,-x,y"))
    log = join_logs(first, read_log(take, axes))
    clocks = log.clocks
    at = 5.0 + clocks["shift_s"] + clocks["drift"] * (5.0 - clocks["reference_s"])
    assert abs(at - (5.0 + recorders.MOTIVE_SHIFT)) < 5.0 * clocks["shift_sigma_s"] + 1e-6
    assert clocks["shift_sigma_s"] < 1e-3
    rows, true = np.isfinite(log.frame["x_m"]), recorders.positions(log.time)
    assert np.max(np.abs(log.table(["x_m", "y_m", "z_m"]) - true)[rows]) < 1e-3
    lengths = cables(log, "length_m", ("C1", "C2", "C3", "C4"))
    np.testing.assert_allclose(lengths, recorders.lengths(true), atol=DIGITS)
    assert any("sigma" in words for words in log.remarks)


def test_a_tracker_in_other_axes_and_units(write):
    path = write("take.csv", recorders.motive(units="Millimeters"))
    log = read_log(path, Facts(R_WF=axes_rotation("-z,-x,y")))
    rows = np.isfinite(log.frame["x_m"])
    assert np.count_nonzero(~rows) == 16  # without the body
    true = recorders.positions(log.time + recorders.MOTIVE_SHIFT)
    np.testing.assert_allclose(log.table(["x_m", "z_m"])[rows], true[rows][:, ::2], atol=PRINTED)
    np.testing.assert_allclose(log.frame["marker_Corner_1_y_m"], 0.1)
    np.testing.assert_allclose(log.frame["qw"][rows], 1.0)


def test_gaps_and_rows_twice_are_told(write):
    rows = read_log(write("raw.log", recorders.grab())).rows_summary()
    assert rows["gaps"] == 1
    assert [rows["longest_gap_s"], rows["longest_gap_at_s"]] == pytest.approx([5.1, 13.0])
    lines = recorders.columns().split("\n")
    twice = read_log(write("twice.csv", "\n".join([*lines[:7], *lines[6:]])))
    assert (twice.repeated, len(twice.frame)) == (1, 20)


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


@pytest.mark.parametrize(("text", "words"), [
    ("columns: []", "columns: found .*accepted: a list of headers"),
    ("columns: [a]\nskip_rows: -1", "skip_rows: found -1; accepted: a whole number from 0"),
    ("columns: [a]\nseparator: ';;'", "separator: found ;;; accepted: one sign"),
    ("columns: [a]\nrate_hz: 0", "rate_hz: found 0; accepted: a number above 0"),
    ("colums: [a]", "found 'colums'; did you mean columns"), ("[", "cannot be read"),
])  # fmt: skip
def test_a_mapping_that_is_wrong_is_refused(text, words, write):
    with pytest.raises(LogFileError, match=words):
        with_mapping(Facts(), write("map.yaml", text))


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
    savemat(path, {"st": {f"{name}_r": st[name] for name in ("t", "epsilon", "tensions")}})
    log = read_log(path)
    np.testing.assert_allclose(log.frame["pitch_rad"], np.radians(0.1))
    assert "epsilon_r in deg" in log.units["variables"]
    savemat(path, {"st": st | {"swivel": np.zeros((4, 49))}})
    with pytest.raises(LogFileError, match="swivel: found 49 rows; accepted: 50"):
        read_log(path)


def test_a_recorder_with_seven_columns_and_its_own_units_is_one_entry(write, monkeypatch):
    text = "rec v2\ntick,beltA,beltB,pullA,pullB,px,py\n0,39.37,20,1,2,100,200\n10,40,21,1,2,1,2\n"
    monkeypatch.setitem(DIALECTS, "mine", Dialect(
        "my recorder", first_line("rec v2"), above=1,
        columns=(("tick", "time_ms"), (r"belt(\w)", "{}_length_in"),
                 (r"pull(\w)", "{}_tension_kgf"), (r"p([xy])", "{}_mm")),
    ))  # fmt: skip
    log = read_log(write("rec.txt", text))
    assert (log.dialect, log.why) == ("mine", "its first line has 'rec v2'")
    assert list(log.frame) == ["time_s", "A_length_m", "B_length_m", "A_tension_n", "B_tension_n",
                               "x_m", "y_m"]  # fmt: skip
    np.testing.assert_allclose(log.frame.iloc[0], [0, 0.999998, 0.508, 9.80665, 19.6133, 0.1, 0.2])


@pytest.mark.parametrize("kind", ["MCAP", "SQLITE3", "ros1"])
def test_a_bag_is_read_at_the_times_of_what_measures_cables(kind, tmp_path, monkeypatch):
    path = file = tmp_path / ("run.bag" if kind == "ros1" else "run")
    recorders.rosbag(path, kind)
    log = import_log(path)
    if path.is_dir():
        (file,) = (entry for entry in path.iterdir() if entry.suffix != ".yaml")
        assert read_log(file).frame.equals(log.frame)
    np.testing.assert_allclose(log.time, 0.01 * np.arange(100), atol=READ)
    np.testing.assert_allclose(log.frame["C1_motor_angle_rad"], 0.1 * np.arange(100))
    np.testing.assert_allclose(log.frame["x_m"][1:99], 0.01 * np.arange(1, 99), atol=READ)
    turned = np.sin(0.01 * np.arange(1, 99))
    np.testing.assert_allclose(log.frame["qx"][1:99], turned, atol=CHORD)
    assert np.isnan(log.frame["x_m"][0])
    assert any("joints of /winches: 0 is winch_left" in remark for remark in log.remarks)
    assert fates(log)["/note/data"] == "words"
    assert is_log(file)  # as cdpr check and the studio have it
    alone = import_log(path, topic=["/tracker/pose"])
    assert len(alone.frame) == 50
    assert fates(alone)["/winches"] == "another topic"
    with pytest.raises(LogFileError, match="topic: found /no; accepted: some of"):
        import_log(path, topic=["/no"])
    raw = file.read_bytes()
    file.write_bytes(raw[:300])
    with pytest.raises(LogFileError, match=r"cannot be read as|found"):
        read_log(file)
    file.write_bytes(raw)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(LogFileError, match=r"needs rosbags, .*pip install '\.\[ros\]'"):
        read_log(path)


def test_mcap_of_a_run_is_read_as_its_text_is(tmp_path, monkeypatch):
    log, path = recorders.run_files(tmp_path), tmp_path / "log.mcap"
    LOG_WRITERS["mcap"](tmp_path, path)
    assert recognise(path)[0] == "mcap"
    read, text = read_log(path), read_log(tmp_path / "log.csv")
    assert list(read.frame) == list(text.frame)
    np.testing.assert_array_equal(read.frame, text.frame)
    assert fates(read)["/tf of platform"] == "another topic"
    poses = import_log(path, topic=["/tf of platform"])  # transforms alone are poses
    columns = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
    np.testing.assert_allclose(poses.table(columns), log["X_WP"], rtol=1e-15)
    np.testing.assert_allclose(poses.time, log["time"], atol=1e-12)
    for row in (0, 3):  # what is not finite is in no message
        log["tensions"][row, 1] = np.nan
    np.savez(tmp_path / "log.npz", **log)
    LOG_WRITERS["mcap"](tmp_path, path)
    assert np.flatnonzero(np.isnan(read_log(path).frame["C2_tension_n"])).tolist() == [0, 3]
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(LogFileError, match=r"log.mcap: cannot be read as MCAP"):
        read_log(path)
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(LogFileError, match=r"pip install '\.\[mcap\]'"):
        read_log(path)


def test_channels_in_json_have_times_of_their_own(tmp_path):
    from mcap.writer import Writer

    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        a, b = (writer.register_channel(name, "json", schema) for name in ("/a", "/b"))
        for k in range(4):
            writer.add_message(a, 10**9 * k, b'{"C1_length_m": %d}' % k, 0)
            writer.add_message(b, 10**9 * k + 5 * 10**8, b'{"x_m": %d}' % k, 0)
        writer.add_message(writer.register_channel("/image", "protobuf", schema), 0, b"\1\2", 0)
        writer.finish()
    log = read_log(path)
    np.testing.assert_allclose(log.time, np.arange(4.0))
    np.testing.assert_allclose(log.frame["x_m"], [np.nan, 0.5, 1.5, 2.5])
    assert fates(log)["/image"] == "no numbers in JSON"
    assert any("/image" in words for words in log.remarks)


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
    file, make = FILES.get(format, ("log.mat", None))
    path = tmp_path / file
    if make is None:
        savemat(path, {"st": {"t": np.arange(30.0), "tensions": np.ones((4, 30))}})
    else:
        path.write_text(make(40) if format in ("gtgraffiti", "motive", "grab") else make())
    raw = path.read_bytes()
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
                continue
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


@pytest.mark.parametrize(("header", "row", "panels", "title"), [
    ("A_motor_deg,B_motor_deg,C1_motor_angle_rad,x_mm,y_mm,z_mm", (90.0, 180.0, 2.0, 1.0, 2.0, 3.0),
     ["motor angle [rad]", "position [m]"], "5 rows without times"),
    ("time_s,C1_length_m,supply_voltage," + ",".join(f"aux{k}" for k in range(9)), range(1, 13),
     ["cable length [m]"],
     "not drawn: supply_voltage, aux0, aux1, aux2, aux3, aux4, aux5, aux6 and 2 more"),
])  # fmt: skip
def test_a_figure_has_a_panel_for_each_quantity_and_says_what_is_not_drawn(
    header, row, panels, title, write
):
    rows = [",".join(str(value * (k + 1)) for value in row) for k in range(5)]
    figure = import_log(write("recorded.csv", "\n".join([header, *rows]) + "\n")).plot()
    assert figure_faults(figure) == []
    assert [axes.get_ylabel() for axes in figure.axes] == panels
    assert " ".join(figure.get_suptitle().split()).endswith(title)
    if "motor" in header:
        labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
        assert labels == [f"{cable}_motor_angle" for cable in ("A", "B", "C1")]
        assert np.allclose(figure.axes[0].lines[1].get_ydata(), np.pi * np.arange(1, 6))
