"""The `calibrate` commands, from pictures and recordings to robot.toml."""

from __future__ import annotations

import json
import math
import re
import shutil
import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from board_scenes import BOARD, CAMERA, LENS, views
from mcap.writer import Writer
from vision_scenes import HERE, pole, room

from polepilot.commands.calibrate_camera import parse_distances, starting_camera
from polepilot.commands.main import run
from polepilot.core.command import DriveCommand
from polepilot.core.errors import InputError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.observation import RangeBearing
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.snapshot import Snapshot, State
from polepilot.core.sim.render import Renderer
from polepilot.core.site import parse_site
from polepilot.core.vehicle import Camera
from polepilot.core.vision.charuco import Board, find_board
from polepilot.server.settings import load_settings

Captured = pytest.CaptureFixture[str]
TRUE = 610.0
TOML = "# our robot\n[camera]\nconstant_px = 600 # by the tape\n"


def shot(*poles: Landmark, seed: int = 0, camera: Camera | None = None) -> np.ndarray:
    camera = camera or Camera(constant=TRUE)
    rng = np.random.default_rng(seed)
    return Renderer(camera, poles, room(20.0), rng).render(HERE, 0.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures of landmark 13 at 2.5, 4 and 6 metres, and some others."""
    folder = tmp_path_factory.mktemp("pictures")
    for seed, (away, bearing) in enumerate([(2.5, 0.12), (4.0, -0.2), (6.0, 0.05)]):
        cv2.imwrite(str(folder / f"{away:g}m.png"), shot(pole(13, away, bearing), seed=seed))
    cv2.imwrite(str(folder / "two.png"), shot(pole(13, 3.0, 0.1), pole(5, 4.0, -0.2)))
    cv2.imwrite(str(folder / "none.png"), shot())
    half = cv2.resize(shot(pole(13, 3.0, 0.0)), (200, 150), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(folder / "small.png"), half)
    (folder / "text.png").write_text("hello")
    return folder


@pytest.fixture
def at(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def toml(tmp_path: Path) -> Path:
    path = tmp_path / "robot.toml"
    path.write_text(TOML)
    return path


THREE = ["2.5m.png", "4m.png", "6m.png"]
GIVEN = ["--distance", "2.5", "--distance", "4", "--distance", "6"]


def answer(arguments: list[str], capsys: Captured, status: int = 0) -> dict[str, Any]:
    assert run([*arguments, "--json"]) == status
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    document: dict[str, Any] = json.loads(out)
    return document


def test_the_constant_goes_to_robot_toml(at: Path, toml: Path, capsys: Captured) -> None:
    words = ["calibrate", "camera", *THREE, *GIVEN, "--config", str(toml), "--write"]
    found = answer(words, capsys)
    assert found["constant"] == pytest.approx(TRUE, rel=0.003)
    assert abs(found["constant"] - TRUE) < 4 * found["standard_error"]
    assert found["verdict"]["grade"] == "good"
    assert (found["width"], found["height"], found["center"]) == (400, 300, [199.5, 149.5])
    for entry, given in zip(found["pictures"], (2.5, 4.0, 6.0), strict=True):
        assert entry["file"] == f"{given:g}m.png"
        assert entry["id"] == 13
        assert entry["distance"] == given
        assert entry["residual"] == pytest.approx(entry["measured"] - given)
        assert abs(entry["residual_share"]) < 0.005
        assert entry["agrees"]
    written = load_settings(toml).camera.constant_px
    assert written == found["settings"]["camera"]["constant_px"]
    assert written == pytest.approx(found["constant"], abs=0.006)
    assert toml.read_text() == TOML.replace("600", str(written))
    assert found["written"] == str(toml)
    kept = toml.with_name("robot.toml.1")
    assert found["kept"] == str(kept)
    assert kept.read_text() == TOML


def test_without_write_nothing_is_changed(at: Path, toml: Path, capsys: Captured) -> None:
    assert run(["calibrate", "camera", *THREE, *GIVEN, "--config", str(toml)]) == 0
    out = capsys.readouterr().out
    assert "camera constant 61" in out
    assert "good: every picture agrees within 0." in out
    assert "[camera]\nconstant_px = 61" in out
    assert toml.read_text() == TOML
    assert list(toml.parent.iterdir()) == [toml]
    # What robot.toml says so far makes no difference to what is found.
    first = answer(["calibrate", "camera", *THREE, *GIVEN], capsys)
    toml.write_text("[camera]\nconstant_px = 400\n")
    second = answer(["calibrate", "camera", *THREE, *GIVEN, "--config", str(toml)], capsys)
    assert second["constant"] == pytest.approx(first["constant"], rel=1e-4)
    assert first["written"] is None


def test_a_picture_that_disagrees(at: Path, capsys: Captured) -> None:
    words = ["calibrate", "camera", *THREE, "--distance", "4m.png=4.3", "--distance", "2.5"]
    assert run([*words, "--distance", "6"]) == 0
    out = capsys.readouterr().out
    assert "left out" in out
    # 4 m of 4.3 m: 7 %, 30 cm.
    said = re.search(r"one picture disagrees: 4m.png by ([\d.]+) % \(([\d.]+) cm too near\)", out)
    assert said is not None
    assert float(said[1]) == pytest.approx(7.0, abs=0.3)
    assert float(said[2]) == pytest.approx(30.0, abs=1.3)


def test_one_distance_only(at: Path, capsys: Captured) -> None:
    assert run(["calibrate", "camera", "4m.png", "--distance", "4"]) == 0
    assert "goes straight into the constant" in capsys.readouterr().out


def test_a_poor_result_is_not_written(at: Path, toml: Path, capsys: Captured) -> None:
    words = ["calibrate", "camera", *THREE[:2], "--distance", "2.5", "--distance", "5"]
    assert run([*words, "--config", str(toml), "--write"]) == 2
    captured = capsys.readouterr()
    assert "poor: " in captured.out
    assert captured.err.count("\n") == 1
    assert f"{toml} was not changed, because the result is poor" in captured.err
    assert toml.read_text() == TOML
    found = answer([*words, "--config", str(toml), "--write"], capsys, status=2)
    assert found["written"] is None


def test_pictures_larger_than_the_robots(tmp_path: Path, toml: Path, capsys: Captured) -> None:
    large = Camera(constant=1.6 * TRUE, width=640, height=480, center_x=319.5, center_y=239.5)
    for away in (2.5, 5.0):
        cv2.imwrite(str(tmp_path / f"{away}.png"), shot(pole(7, away, 0.1), camera=large))
    words = ["calibrate", "camera", str(tmp_path / "2.5.png"), str(tmp_path / "5.0.png")]
    words += ["--distance", "2.5", "--distance", "5"]
    found = answer([*words, "--config", str(toml)], capsys)
    assert found["constant"] == pytest.approx(1.6 * TRUE, rel=0.003)
    assert found["settings"]["camera"]["constant_px"] == pytest.approx(TRUE, rel=0.003)
    assert run(words) == 0
    assert "for the robot's 400 x 300 pictures" in capsys.readouterr().out


def test_one_of_several_landmarks(at: Path, capsys: Captured) -> None:
    words = ["calibrate", "camera", "two.png", "--distance", "4"]
    assert run(words) == 2
    assert "two.png: shows landmarks" in capsys.readouterr().err
    assert answer([*words, "--id", "5"], capsys)["constant"] == pytest.approx(TRUE, rel=0.005)
    assert answer([*words, "--ids", "1-12"], capsys)["pictures"][0]["id"] == 5


def test_the_picture_of_what_was_found(at: Path, tmp_path: Path, capsys: Captured) -> None:
    out = tmp_path / "seen.png"
    words = ["calibrate", "camera", *THREE, *GIVEN, "--annotate", str(out)]
    assert run(words) == 0
    drawn = cv2.imread(str(out))
    assert drawn is not None
    green = (drawn[:, :, 1] > 200) & (drawn[:, :, 0] < 130) & (drawn[:, :, 2] < 130)
    for part in np.array_split(green, 3, axis=1):
        assert part.sum() > 100
    assert drawn.shape[1] == 3 * 800


@pytest.mark.parametrize("board", [[], ["--board"]])
@pytest.mark.parametrize("name", ["4m.png", "./4m.png", "link.png"])
def test_drawing_spares_the_pictures(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    board: list[str],
    name: str,
    capsys: Captured,
) -> None:
    shutil.copy(folder / "4m.png", tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("link.png").symlink_to("4m.png")
    before = Path("4m.png").read_bytes()
    # Told before anything else is looked at: the other picture is none.
    Path("text.png").write_text("hello")
    words = ["4m.png", "text.png", *(board or ["--distance", "4", "--id", "13"])]
    assert run(["calibrate", "camera", *words, "--annotate", name]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == f"--annotate {Path(name)}: is a picture to look at; expected a new file.\n"
    assert Path("4m.png").read_bytes() == before


def test_a_list_with_an_endless_field(at: Path, tmp_path: Path, capsys: Captured) -> None:
    tape = tmp_path / "tape.csv"
    tape.write_text(f"4m.png,{'4' * 140_000}\n")
    assert run(["calibrate", "camera", "4m.png", "--distance", str(tape)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith(f"--distance {tape}: cannot be read (field larger than")


def test_distances() -> None:
    files = ["a.png", "b/c.png", "d.png"]
    assert parse_distances(["3"], files) == [3, 3, 3]
    assert parse_distances(["3", "4.5", "6"], files) == [3, 4.5, 6]
    assert parse_distances(["c.png=5", "2"], files) == [2, 5, 2]
    assert parse_distances(["b/c.png=5", "2", "1"], files) == [2, 5, 1]
    with pytest.raises(InputError, match="given 2 times for 3 pictures"):
        parse_distances(["3", "4"], files)
    with pytest.raises(InputError, match=r"d\.png: its distance is missing"):
        parse_distances(["a.png=3", "c.png=4"], files)
    with pytest.raises(InputError, match=r"'x\.png' is none of the pictures"):
        parse_distances(["x.png=3"], files)
    with pytest.raises(InputError, match="could be several"):
        parse_distances(["a.png=3"], ["b/a.png", "c/a.png"])
    with pytest.raises(InputError, match="expected metres"):
        parse_distances(["3m"], files)


def test_distances_from_a_list(tmp_path: Path) -> None:
    path = tmp_path / "tape.csv"
    path.write_text('picture,metres\na.png,3.0\n\n"c.png", 4.5\n')
    assert parse_distances([str(path)], ["a.png", "x/c.png"]) == [3.0, 4.5]
    with pytest.raises(InputError, match=r"row 2: a\.png has a distance already, 2 m"):
        parse_distances(["a.png=2", str(path)], ["a.png", "x/c.png"])
    path.write_text("a.png,3.0\na.png,3.1\n")
    with pytest.raises(InputError, match=r"tape.csv: row 2: a\.png has a distance already, 3 m"):
        parse_distances([str(path)], ["a.png"])
    path.write_text("a.png,3.0\nc.png,far\n")
    with pytest.raises(InputError, match=r"tape.csv: row 2: expected metres"):
        parse_distances([str(path)], ["a.png", "c.png"])
    path.write_text("a.png\n")
    with pytest.raises(InputError, match=r"tape.csv: row 1: has 1 columns"):
        parse_distances([str(path)], ["a.png"])
    with pytest.raises(InputError, match="cannot be read"):
        parse_distances([str(tmp_path / "none.csv")], ["a.png"])


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "no picture"),
        (["4m.png"], "--distance is missing"),
        (["4m.png", "--distance", "0"], "4m.png: the distance is 0 m"),
        (["4m.png", "--distance", "nan"], "expected metres"),
        (["none.png", "4m.png", "--distance", "4"], "none.png: no landmark was found"),
        (["4m.png", "--distance", "4", "--id", "7"], "4m.png (it shows 13): no landmark 7"),
        (["4m.png", "--distance", "4", "--id", "99"], "--id is 99"),
        (["4m.png", "--distance", "4", "--bits", "7"], "--bits is 7"),
        (["4m.png", "--distance", "4", "--shape", "ball"], "--shape is 'ball'"),
        (["4m.png", "--distance", "4", "--diameter", "-9"], "--diameter is -9.0"),
        (["4m.png", "--distance", "4", "--write"], "--write is given without --config"),
        (["4m.png", "--distance", "4", "--config", "none.toml"], "none.toml: cannot be read"),
        (["4m.png", "--distance", "4", "--annotate", "a.txt"], "--annotate a.txt"),
        (["4m.png", "--distance", "4", "--annotate", "no/a.png"], "--annotate no/a.png"),
        (["4m.png", "small.png", "--distance", "4"], "small.png: has 200 x 150 pixels"),
        (["text.png", "gone.png", "--distance", "4"], "gone.png"),
        (["4m.png", "4m.png", "--distance", "4"], "4m.png: is given twice: expected"),
        (["4m.png", "./4m.png", "--distance", "4"], "./4m.png: is given twice, first as 4m.png"),
        (["4m.png", "./4m.png", "--board"], "./4m.png: is given twice, first as 4m.png"),
        (
            ["4m.png", "--distance", "4m.png=4", "--distance", "4m.png=5"],
            "--distance 4m.png=5: 4m.png has a distance already, 4 m",
        ),
        (["4m.png", "--board", "--distance", "4"], "--distance is given with --board"),
        (["4m.png", "--board"], "0 of 1 pictures show enough of the board"),
        (["4m.png", "--board", "--squares", "9"], "--squares is '9'"),
        (["4m.png", "--board", "--squares", "30x30"], "--squares 30x30: the board needs"),
        (["4m.png", "--board", "--square", "-1"], "--square is -1.0 m"),
        (["4m.png", "--board", "--dictionary", "QR"], "--dictionary is 'QR'"),
        (["--board-out", "board.gif"], "--board-out board.gif"),
        (["4m.png", "--board-out", "board.pdf"], "expected no pictures"),
        (["--board-out", "b.pdf", "--square", "0.5", "--marker", "0.3"], "larger than A0"),
        (["--board-out", "board.png", "--square", "2", "--marker", "1"], "take a .pdf"),
    ],
)
def test_bad_input_is_one_line(at: Path, words: list[str], expected: str, capsys: Captured) -> None:
    before = sorted(at.iterdir())
    assert run(["calibrate", "camera", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert expected in err
    assert sorted(at.iterdir()) == before


def test_the_lens_from_a_board(tmp_path: Path, capsys: Captured) -> None:
    files = []
    for number, image in enumerate(views()):
        files.append(str(tmp_path / f"{number}.png"))
        cv2.imwrite(files[-1], image)
    toml = tmp_path / "robot.toml"
    toml.write_text(
        "[camera]\nsource = 0\nwidth = 640\nheight = 480\n"
        '[link]\nboard = "serial"\nport = "/dev/ttyUSB0"\n'
    )
    seen = tmp_path / "seen.jpg"
    words = ["calibrate", "camera", "--board", *files, "--config", str(toml), "--write"]
    found = answer([*words, "--annotate", str(seen)], capsys)
    assert found["verdict"]["grade"] == "good"
    assert found["distortion"][0] == pytest.approx(LENS[0], abs=0.01)
    assert found["rms"] < 0.2
    camera = load_settings(toml).model.camera
    assert camera.constant == pytest.approx(CAMERA.constant, rel=0.003)
    assert camera.center_x == pytest.approx(CAMERA.center_x, abs=1.5)
    assert camera.distortion == pytest.approx(found["distortion"], abs=1e-6)
    assert cv2.imread(str(seen)) is not None
    # Half of the pixels: half of the constant, the same lens.
    toml.write_text("[camera]\nwidth = 320\nheight = 240\n")
    small = answer(words[:-1], capsys)["settings"]["camera"]
    assert small["constant_px"] == pytest.approx(found["constant"] / 2, abs=0.01)
    assert small["center"][0] == pytest.approx((found["center"][0] + 0.5) / 2 - 0.5, abs=0.01)
    assert small["distortion"] == pytest.approx(found["distortion"], abs=1e-6)
    # A picture without a board is said to be one.
    cv2.imwrite(files[0], np.full((480, 640), 99, np.uint8))
    assert run(words[:-3]) == 0
    assert "no board" in capsys.readouterr().out


def test_what_robot_toml_knows_of_the_lens_is_used(tmp_path: Path) -> None:
    toml = tmp_path / "robot.toml"
    toml.write_text(
        "[camera]\nconstant_px = 600\ncenter = [201, 151]\n"
        "distortion = [-0.1, 0, 0, 0, 0]\nheight_m = 0.5\n"
    )
    camera = starting_camera(load_settings(toml), 800, 600)
    assert camera.constant == pytest.approx(1200)
    assert (camera.center_x, camera.center_y) == pytest.approx((402.5, 302.5))
    assert camera.distortion == (-0.1, 0, 0, 0, 0)
    assert camera.mount_height == 0.5


def test_the_board_itself(tmp_path: Path, capsys: Captured) -> None:
    png = tmp_path / "board.png"
    assert run(["calibrate", "camera", "--board-out", str(png), "--squares", "7x5"]) == 0
    assert "210 x 150 mm" in capsys.readouterr().out
    picture = cv2.imread(str(png), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    small = cv2.resize(picture, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    view = find_board(small, Board(7, 5))
    assert view is not None
    assert len(view.pixels) == 24
    # Its size on paper is in the file: a square of 30 mm.
    data = png.read_bytes()
    place = data.index(b"pHYs") + 4
    across, down, unit = struct.unpack(">IIB", data[place : place + 9])
    assert (across, unit) == (down, 1)
    assert picture.shape[1] / across == pytest.approx(8 * 0.030, rel=1e-3)
    for name in ("board.pdf", "board.svg", "board.png"):
        out = tmp_path / name
        assert run(["calibrate", "camera", "--board-out", str(out)]) == 0
        assert ("297 x 210 mm" in capsys.readouterr().out) == (out.suffix != ".png")
        assert out.stat().st_size > 5000
        out.unlink()
        made = answer(["calibrate", "camera", "--board-out", str(out)], capsys)
        assert out.stat().st_size > 5000
        assert made["file"] == str(out)
        assert (made["squares"], made["square"], made["marker"]) == ([9, 6], 0.030, 0.022)
        assert (made["dictionary"], made["width"]) == ("4X4_50", pytest.approx(0.27))
        assert made["height"] == pytest.approx(0.18)
        if out.suffix != ".png":
            assert made["paper"] == pytest.approx([0.297, 0.210])
    assert Board() == BOARD


# The pan unit


def test_directions(toml: Path, capsys: Captured) -> None:
    # -130 degrees at 20 counts, 130 at 1000: 0.2653 degrees per count.
    known = [(20, -130.0), (255, -67.65), (510, 0.0), (740, 61.02), (1000, 130.0)]
    words = ["calibrate", "pan"]
    for adc, degrees in known[:-1]:
        words += ["--at", f"{adc}={degrees}"]
    # The same as the program tells it: with what it is calibrated to so far.
    words += ["--at", f"{math.radians(1000 / 1023 * 270 - 135)}rad=130"]
    found = answer([*words, "--config", str(toml), "--write"], capsys)
    assert found["verdict"]["grade"] == "good"
    assert found["radians_per_count"] == pytest.approx(math.radians(260 / 980), rel=1e-3)
    unit = load_settings(toml).model.pan
    for adc, degrees in known:
        assert unit.angle(adc) == pytest.approx(math.radians(degrees), abs=math.radians(0.1))
    assert toml.read_text().startswith(TOML)
    assert run(words) == 0
    out = capsys.readouterr().out
    assert "the camera looks at" in out
    assert "[pan]\nminimum_rad = " in out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "expected one of --at"),
        (["--at", "5=1"], "at least two"),
        (["--at", "5", "--at", "6=1"], "--at is '5'"),
        (["--at", "rad=5", "--at", "6=1"], "--at is 'rad=5'"),
        (["--at", "-9rad=5", "--at", "6=1"], "--at -9rad=5: "),
        (["--at", "5=left", "--at", "6=1"], "--at 5=left"),
        (["--at", "-5=1", "--at", "6=1"], "--at -5=1: -5 counts"),
        (["--at", "5=1", "--log", "x.mcap"], "expected one of"),
        (["--at", "5=1", "--at", "900=90", "--heading", "3"], "--heading go with"),
        (["--at", "5=200", "--at", "900=300"], "nothing of the range"),
        (["--log", "x.mcap"], "--log x.mcap: no such file"),
        (["--dataset", "nowhere"], "nowhere: expected a folder"),
        (["--dataset", "nowhere", "--heading", "north"], "--heading is 'north'"),
        (["--dataset", "nowhere", "--site", "gone.json"], "gone.json"),
    ],
)
def test_bad_input_for_pan_is_one_line(
    at: Path, words: list[str], expected: str, capsys: Captured
) -> None:
    assert run(["calibrate", "pan", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert expected in err


STANDS = Pose2D(3.0, 2.5, 0.4)
MARKS = [
    Landmark(5, 6.0, 2.2),
    Landmark(9, 5.2, 4.8),
    Landmark(14, 3.0, 5.7),
    Landmark(2, 0.6, 4.4),
    Landmark(11, 4.6, 0.5),
    Landmark(6, 2.2, 0.3),
]
HALF = math.radians(135)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The camera sweeps once; it turns 3 % farther than is read, and is mounted 2 degrees left."""
    folder = tmp_path_factory.mktemp("recording")
    camera = Camera()
    corners = [(0.0, 0.0), (7.0, 0.0), (7.0, 6.0), (0.0, 6.0)]
    walls = list(zip(corners, corners[1:] + corners[:1], strict=True))
    renderer = Renderer(camera, MARKS, walls, np.random.default_rng(7))
    lines: list[dict[str, Any]] = [{"t": 0.0, "kind": "drive", "speed": 0.3, "steering": 0.0}]
    lines.append({"t": 1.0, "kind": "drive", "speed": 0.0, "steering": 0.0})
    rate = math.radians(45)
    for index in range(64):
        stamp = round(1.6 + 0.09 * index, 6)
        read = -2.25 + rate * (stamp - 1.6)
        true = math.radians(2) + 1.03 * read
        name = f"{index:02}.png"
        cv2.imwrite(
            str(folder / name),
            renderer.render(STANDS.compose(Pose2D(camera.forward, 0.0, true)), 1.03 * rate),
        )
        lines.append({"t": stamp, "kind": "pan", "angle": read})
        lines.append({"t": stamp, "kind": "frame", "file": name})
    lines.append({"t": 7.5, "kind": "drive", "speed": 0.3, "steering": 0.0})
    document = {
        "camera": {
            "constant_px": camera.constant,
            "width": camera.width,
            "height": camera.height,
            "cx": camera.center_x,
            "cy": camera.center_y,
            "forward_m": camera.forward,
            "height_m": camera.mount_height,
            "pan_min_rad": -HALF,
            "pan_max_rad": HALF,
        },
        "vehicle": {"wheelbase_m": 0.2, "track_m": 0.2},
        "landmark": {"bits": 4, "segment_m": 0.05, "diameter_m": 0.07},
        "landmarks": [{"id": m.id, "x": m.x, "y": m.y} for m in MARKS],
    }
    (folder / "dataset.json").write_text(json.dumps(document))
    (folder / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder


def test_landmarks_of_a_site(recording: Path, toml: Path, capsys: Captured) -> None:
    words = ["calibrate", "pan", "--dataset", str(recording), "--config", str(toml)]
    found = answer([*words, "--heading", str(math.degrees(0.4)), "--write"], capsys)
    assert found["scale"] == pytest.approx(1.03, abs=0.004)
    assert found["offset"] == pytest.approx(math.radians(2), abs=math.radians(0.3))
    x, y, direction = found["camera"]
    lens = STANDS.compose(Pose2D(0.1, 0, 0))
    assert math.dist((x, y), lens.position) < 0.02
    assert direction == pytest.approx(0.4 + math.radians(2), abs=math.radians(0.3))
    assert {entry["id"] for entry in found["landmarks"]} == {m.id for m in MARKS}
    assert found["verdict"]["grade"] in ("good", "fair")
    # With what was written, what was read as -90 degrees is put right.
    unit = load_settings(toml).model.pan
    for read in (-1.5, 0.0, 1.5):
        counts = (read + HALF) / (2 * HALF) * 1023
        true = math.radians(2) + 1.03 * read
        assert unit.angle(counts) == pytest.approx(true, abs=math.radians(0.5))
    # The recording was read with the old one.
    assert run(words) == 2
    assert "expected the same calibration" in capsys.readouterr().err


def test_landmarks_without_a_heading(recording: Path, capsys: Captured) -> None:
    assert run(["calibrate", "pan", "--dataset", str(recording)]) == 0
    out = capsys.readouterr().out
    assert "standing from 1.5 to 7.5 s" in out
    assert "says +0.0° the camera looks at +0.0°: that is right" in out
    assert "says +135.0° the camera looks at +13" in out
    assert "Give --heading" in out


def test_a_site_with_other_landmarks(recording: Path, tmp_path: Path, capsys: Captured) -> None:
    site = tmp_path / "site.json"
    square = [[0, 0], [7, 0], [7, 6], [0, 6]]
    marks = [{"id": m.id, "x": m.x, "y": m.y} for m in MARKS[:2]]
    site.write_text(json.dumps({"name": "room", "boundary": square, "landmarks": marks}))
    words = ["calibrate", "pan", "--dataset", str(recording), "--site", str(site)]
    assert run(words) == 2
    err = capsys.readouterr().err
    assert "seen while standing: 5, 9; expected at least 3" in err


def test_a_recording_that_never_stands(recording: Path, tmp_path: Path, capsys: Captured) -> None:
    folder = tmp_path / "driving"
    shutil.copytree(recording, folder)
    lines = (folder / "samples.jsonl").read_text().replace('"speed": 0.0', '"speed": 0.1')
    (folder / "samples.jsonl").write_text(lines)
    assert run(["calibrate", "pan", "--dataset", str(folder)]) == 2
    assert "never stood" in capsys.readouterr().err


def test_the_log_of_a_run(tmp_path: Path, capsys: Captured) -> None:
    """A robot that drives, stands for six seconds, and drives on; it turns 4 % farther."""
    square = [[0, 0], [7, 0], [7, 6], [0, 6]]
    marks = [{"id": m.id, "x": m.x, "y": m.y} for m in MARKS]
    site = parse_site({"boundary": square, "landmarks": marks, "start": [1, 1, 0]}, "the site")
    path = tmp_path / "run.mcap"
    recorder = Recorder(path)
    recorder.begin(0.0, site, plan_scan(site, PlanOptions()))
    rng = np.random.default_rng(1)
    camera = STANDS.compose(Pose2D(0.1, 0, 0))
    for tick in range(500):
        stamp = 0.02 * tick
        driving = not 2.0 <= stamp < 8.5
        read = 2.2 * math.sin(2 * math.pi * stamp / 12)
        command = DriveCommand(0.2 if driving else 0.0, 0.0)
        recorder.snapshot(
            Snapshot(tick, stamp, State.RUNNING, "", command=command, pan=read - 0.01)
        )
        seen = []
        for mark in MARKS:
            inside = wrap_angle(camera.bearing_to(mark.position) - 1.04 * read)
            if abs(inside) < 0.3 and tick % 3 == 0:
                away = camera.distance_to(mark.position)
                # While it drives it is somewhere else.
                bearing = read + inside + 0.0005 * rng.normal() + 0.5 * driving
                seen.append(RangeBearing(stamp, mark.id, away, bearing, 0.005, 0.0005, read))
        recorder.sighting(stamp, seen, None)
    recorder.close()
    words = ["calibrate", "pan", "--log", str(path), "--heading", str(math.degrees(0.4))]
    found = answer(words, capsys)
    assert found["scale"] == pytest.approx(1.04, abs=0.004)
    assert found["offset"] == pytest.approx(0, abs=math.radians(0.3))
    assert math.dist(found["camera"][:2], camera.position) < 0.01
    assert run(words) == 0
    assert "standing from 2.5 to 8.5 s" in capsys.readouterr().out


def test_a_log_without_sightings(tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "run.mcap"
    Recorder(path).close()
    assert run(["calibrate", "pan", "--log", str(path)]) == 2
    assert "holds no sightings" in capsys.readouterr().err
    path.write_bytes(b"no log at all")
    assert run(["calibrate", "pan", "--log", str(path)]) == 2
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("snapshot", "json", 0)
        writer.add_message(channel, 0, b'{"t": 1}', 0)
        writer.finish()
    assert run(["calibrate", "pan", "--log", str(path)]) == 2
    assert "is no log of a run" in capsys.readouterr().err
