"""robot.toml: defaults, what it means for the core, and one clear line for everything wrong."""

from __future__ import annotations

import math
import string
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.control.supervisor import Limits
from polepilot.core.errors import ConfigError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.usb import PortAddress
from polepilot.core.localization.localizer import LocalizerSettings
from polepilot.core.robot.robot import RobotSettings
from polepilot.core.sim.motion import Disturbances
from polepilot.core.vehicle import RobotModel
from polepilot.server import settings_docs
from polepilot.server.settings import Settings, load_settings, parse_settings
from polepilot.server.settings_errors import key_lines

HARDWARE = '[camera]\nsource = 0\n[link]\nboard = "serial"\nport = "/dev/polepilot"\n'


def complaint(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_settings(text, "robot.toml")
    return str(caught.value)


def test_no_file_is_the_simulated_robot() -> None:
    assert load_settings(None) == Settings()
    assert Settings().model == RobotModel()
    assert Settings().calibration == DriveCalibration()
    assert Settings().localization == LocalizerSettings()
    assert Settings().supervision == Limits()
    assert Settings().robot == RobotSettings()
    assert Settings().port_address is None


def test_values_reach_the_core() -> None:
    read = parse_settings(
        """
        [camera]
        source = "/dev/video2"
        constant_px = 700
        width = 640
        height = 480
        rate_hz = 30
        distortion = [-0.2, 0.05, 0, 0.001, 0]
        [pan]
        maximum_rad = 2.0
        [vehicle]
        wheelbase_m = 0.3
        max_speed_m_s = 0.5
        [landmark]
        detector = "paper"
        [link]
        board = "serial"
        port = "0403:6001:A7"
        [drive]
        full_speed_right_m_s = 0.52
        counts_per_m = 1200
        [localizer]
        method = "paper"
        lost_after_s = 5
        [limits]
        max_speed_m_s = 0.2
        max_link_age_s = 0.4
        [proximity]
        angles_rad = [0.5, 0, -0.5]
        """,
        "robot.toml",
    )
    model = read.model
    assert (model.camera.constant, model.camera.rate) == (700, 30)
    # Without a given centre the optical axis goes through the middle of the picture.
    assert (model.camera.center_x, model.camera.center_y) == (319.5, 239.5)
    assert model.camera.distortion == (-0.2, 0.05, 0, 0.001, 0)
    assert model.pan.maximum == 2.0
    assert model.vehicle.wheelbase == 0.3
    assert model.vehicle.max_speed == 0.2
    assert read.landmark.detector == "paper"
    assert read.port_address == PortAddress(vendor=0x0403, product=0x6001, serial_number="A7")
    assert read.calibration.full_speed_right == 0.52
    assert read.calibration.counts_per_metre == 1200
    assert read.localization == LocalizerSettings(method="paper", lost_after=5)
    assert read.robot.limits == Limits(max_speed=0.2, max_link_age=0.4)
    assert read.robot.model == model
    assert model.proximity.angles == (0.5, 0, -0.5)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[camra]\n", "line 1: camra is not known: did you mean camera?"),
        ("[camera]\nwidht = 400\n", "line 2: camera.widht is not known: did you mean camera.width"),
        ("[vehicle]\ndetector = 1\n", "vehicle.detector is not known: did you mean landmark.det"),
        ("[server]\nqqq = 1\n", "server.qqq is not known: the keys are port, data, panel."),
        ("\n[camera]\n\nwidth = 3", "line 4: camera.width is 3: expected a whole number from 32 "),
        ('[camera]\nwidth = "400"', 'camera.width is "400": expected a whole number from 32 to'),
        ("[camera]\nwidth = 400.5", "camera.width is 400.5: expected a whole number"),
        ("[camera]\nwidth = true", "camera.width is true: expected a whole number"),
        ("[camera]\ncenter = [1]", "camera.center holds [1]: expected a list of 2 numbers"),
        ('[camera]\ncenter = [1, "b"]', 'camera.center holds "b": expected a list of 2 numbers'),
        ("[camera]\ncenter = [400, 0]", "camera.center is [400.0, 0.0]: expected a place inside"),
        ("[camera]\ndistortion = [1]", "camera.distortion holds [1]: expected a list of 5 numbers"),
        (
            "[camera]\ndistortion = [-9, 0, 0, 0, 0]",
            "camera.distortion is [-9.0, 0.0, 0.0, 0.0, 0.0]: expected a lens that shows each",
        ),
        ("[camera]\ndistortion = [1e9, 0, 0, 0, 0]", "camera.distortion is [1000000000.0, 0.0, "),
        ("[camera]\nsource = 1.5", "camera.source is 1.5: expected a whole number or text"),
        ("[camera]\nsource = -1", "camera.source is -1: expected a device number of 0 or more"),
        ('[camera]\nsource = ""', 'camera.source is "": expected "simulated", a device'),
        ("camera = 3", "line 1: camera is 3: expected a table of keys"),
        ("[vehicle]\nwheelbase_m = 0", "vehicle.wheelbase_m is 0: expected a number more than 0"),
        ("[vehicle]\nwheelbase_m = -inf", "vehicle.wheelbase_m is -inf: expected a number"),
        ("[vehicle]\ntrack_m = nan", "vehicle.track_m is nan: expected a number"),
        ("[vehicle]\nclearance_m = 0.1", "vehicle.clearance_m is 0.1: expected at least body_rad"),
        ("[pan]\nminimum_rad = 3", "pan.minimum_rad is 3.0: expected less than maximum_rad"),
        ("pan = { minimum_rad = 3 }", "line 1: pan.minimum_rad is 3.0: expected less than"),
        ("pan.minimum_rad = 3", "line 1: pan.minimum_rad is 3.0: expected less than"),
        ("[pan]\nadc_at_maximum = 0", "pan.adc_at_maximum is 0: expected another number than"),
        (
            '[landmark]\ndetector = "x"',
            'landmark.detector is "x": expected one of "default", "paper"',
        ),
        ('[landmark]\nbright = "beige"', 'landmark.bright is "beige": expected a bright colour'),
        ('[landmark]\nbright = "#d0a0a0"', 'landmark.bright is "#d0a0a0": expected a bright col'),
        (
            '[landmark]\ndetector = "paper"\nbright = "green"',
            'line 3: landmark.bright is "green": expected "orange", because landmark.detector is',
        ),
        ("[drive]\nservo_scale = 0", "drive.servo_scale is 0.0: expected another number than 0"),
        ("[drive]\nservo_center_rad = 1", "drive.servo_center_rad is 1.0: expected within servo_"),
        ("[localizer]\nlost_after_s = 1", "localizer.lost_after_s is 1.0: expected at least degr"),
        ("[proximity]\nangles_rad = [-1, 0, 1]", "angles_rad is [-1.0, 0.0, 1.0]: expected left, "),
        ("[proximity]\nhard_limit_m = 2", "proximity.hard_limit_m is 2.0: expected less than max_"),
        ('[link]\nboard = "usb"', 'link.board is "usb": expected one of "simulated", "host"'),
        ('[link]\nboard = "serial"', 'link.port is "": expected a serial port, because link.boa'),
        ('[link]\nport = "COM3"', 'link.port is "COM3": expected a path such as "/dev/polepilot"'),
        (
            '[link]\nboard = "serial"\nport = "/dev/ttyUSB0"',
            'camera.source is "simulated": expected a real camera, because link.board is "serial"',
        ),
        ("[camera]\nsource = 0", 'camera.source is 0: expected "simulated", as long as link.board'),
        (
            '[camera]\nsource = "rtsp://robin:secret@cam/live"',
            'camera.source is "rtsp://...@cam/live": expected "simulated", as long as link.board',
        ),
        ('[camera]\nsource = ["a:secret@b"]', 'camera.source is ["...@b"]: expected a whole'),
        (
            "[camera]\nautofocus = true\nfocus = 9",
            "camera.focus is 9: expected -1, because camera.",
        ),
        ("[camera]\nlatency_s = -1", "camera.latency_s is -1: expected a number from -0.1 to 5"),
        ("[camera]\nwidth = ", "line 2, at the end: this is no TOML: Invalid value."),
        ("[camera\n", "line 1, column 8: this is no TOML"),
        ("[camera]\nwidth = 400\nwidth = 500\n", "this is no TOML: Cannot overwrite a value."),
    ],
)
def test_one_clear_line(text: str, expected: str) -> None:
    message = complaint(text)
    assert message.startswith("robot.toml: ")
    assert expected in message
    assert "\n" not in message


def test_the_first_problem_is_told_and_the_others_are_named() -> None:
    message = complaint("[server]\nport = 99999\n[pan]\nminimum_rad = 3\n[camera]\nwidth = 1\n")
    assert message.startswith("robot.toml: line 2: server.port is 99999")
    assert message.endswith("Also wrong: pan.minimum_rad, camera.width.")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "cannot be read (No such file or directory): expected a robot.toml."),
        (b"\xff\xfe\x00", "byte 0 is no UTF-8 text: expected a TOML file."),
    ],
)
def test_file_that_cannot_be_read(tmp_path: Path, content: bytes | None, expected: str) -> None:
    path = tmp_path / "robot.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        load_settings(path)
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)


def test_folder_and_windows_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        load_settings(tmp_path)
    path = tmp_path / "robot.toml"
    path.write_bytes(b"\xef\xbb\xbf[server]\r\nport = 9000\r\n")
    assert load_settings(path).server.port == 9000


def test_the_simulated_camera_has_an_ideal_lens() -> None:
    hardware = parse_settings(
        HARDWARE.replace("source = 0", "source = 0\ndistortion = [-0.2, 0, 0, 0, 0]"), "robot.toml"
    )
    assert hardware.model.camera.distortion == (-0.2, 0, 0, 0, 0)
    assert hardware.with_board("simulated").model.camera.distortion == ()


def test_another_board() -> None:
    hardware = parse_settings(HARDWARE, "robot.toml")
    simulated = hardware.with_board("simulated")
    assert simulated.camera.source == "simulated"
    assert simulated.link.port == "/dev/polepilot"
    hosted = hardware.with_board("host")
    assert (hosted.link.board, hosted.camera.source) == ("host", "simulated")
    assert hardware.with_board("serial") == hardware
    with pytest.raises(ConfigError, match=r"^--board: link.port is"):
        Settings().with_board("serial")
    with pytest.raises(ConfigError, match=r'^--board: link.board is "toaster": expected one of'):
        Settings().with_board("toaster")
    assert Settings().override({"server": {"port": 0}}, "--port").server.port == 0


def test_imperfection_scales_the_disturbances() -> None:
    def drawn(factor: float) -> Disturbances:
        read = parse_settings(f"[simulation]\nimperfection = {factor}", "robot.toml")
        return read.disturbances(np.random.default_rng(7))

    plain = Disturbances.drawn(np.random.default_rng(7))
    assert drawn(1.0) == plain
    assert drawn(2.0).speed_scale == pytest.approx(2 * plain.speed_scale)
    assert drawn(2.0).rear_grip == plain.rear_grip
    assert drawn(0.0) == Disturbances(
        **{**dict.fromkeys(Disturbances.__dataclass_fields__, 0.0), "rear_grip": plain.rear_grip}
    )


def test_example_holds_every_key_with_its_default() -> None:
    text = settings_docs.EXAMPLE.read_text(encoding="utf-8")
    assert parse_settings(text, "robot.example.toml") == Settings()
    found = set(key_lines(text))
    for section, values in Settings():
        for key in type(values).model_fields:
            assert (section, key) in found
    assert max(map(len, text.splitlines())) <= 100


def test_example_and_documentation_are_those_of_the_program() -> None:
    remedy = "run python -m polepilot.server.settings_docs"
    assert settings_docs.EXAMPLE.read_text(encoding="utf-8") == settings_docs.example(), remedy
    page = settings_docs.PAGE.read_text(encoding="utf-8")
    assert page == settings_docs.with_tables(page), remedy
    assert "| `pan.minimum_rad` | `-2.356194490192345` (-135 degrees) |" in page


def test_examples_in_the_documentation_work() -> None:
    page = settings_docs.PAGE.read_text(encoding="utf-8")
    blocks = [part.partition("```")[0] for part in page.split("```toml\n")[1:]]
    assert blocks
    for block in blocks:
        assert parse_settings(block, "docs").link.board == "serial"


def test_lines_of_keys() -> None:
    lines = key_lines('a.b = 1\n\n[ camera ] # x\n"width" = 3\n[x.y]\nz = [\n 1,\n]\nq = 2\n')
    assert lines[("a", "b")] == lines[("a",)] == 1
    assert lines[("camera",)] == 3
    assert lines[("camera", "width")] == 4
    assert lines[("x", "y", "z")] == 6
    assert lines[("x", "y", "q")] == 9


VALUES = st.one_of(
    st.integers(-(10**9), 10**9).map(str),
    st.floats().map(lambda x: repr(x) if math.isfinite(x) else "nan"),
    st.booleans().map(lambda x: str(x).lower()),
    st.text(string.ascii_letters + " /:.", max_size=20).map(lambda x: f'"{x}"'),
    st.lists(st.integers(-5, 5), max_size=4).map(str),
    st.just("{ a = 1 }"),
    st.just("1979-05-27"),
)
KEYS = st.sampled_from(
    [(name, key) for name, values in Settings() for key in type(values).model_fields]
    + [("camera", "nonsense"), ("nonsense", "width"), ("pan", "adc-at")]
)


@given(st.dictionaries(KEYS, VALUES, max_size=4))
@settings(deadline=None, max_examples=200)
def test_any_value_is_taken_or_refused_in_one_line(changes: dict[tuple[str, str], str]) -> None:
    text = "\n".join(f"{section}.{key} = {value}" for (section, key), value in changes.items())
    try:
        read = parse_settings(text, "robot.toml")
    except ConfigError as error:
        message = str(error)
        assert message.startswith("robot.toml: line ")
        assert "\n" not in message
        assert any(f"{section}" in message for section, _ in changes)
    else:
        # What is taken can be used: nothing fails later in the core.
        assert read.model.vehicle.min_turn_radius > 0
        assert read.robot.model == read.model


@given(st.text(max_size=200))
@settings(deadline=None)
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse_settings(text, "robot.toml")
    except ConfigError as error:
        assert "\n" not in str(error)  # noqa: PT017
