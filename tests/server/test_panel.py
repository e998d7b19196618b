"""The 3D panel: its shapes, its words, what reaches a viewer, and what it costs."""

from __future__ import annotations

import http.client
import math
import socket
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from polepilot.core.command import DriveCommand
from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark, LandmarkKind
from polepilot.core.observation import Detection, PoseEstimate, Status
from polepilot.core.robot.snapshot import Measured, MissionStatus, Snapshot, State
from polepilot.core.site import Site, Start
from polepilot.server import panel_shapes as shapes
from polepilot.server import panel_text as text
from polepilot.server.panel import Panel

SITE = Site(
    boundary=((0, 0), (6, 0), (6, 4), (0, 4)),
    islands=(((2, 1), (3, 1), (3, 2), (2, 2)),),
    walls=(((4, 0), (4, 1.5)),),
    landmarks=(Landmark(13, 0, 3), Landmark(5, 6, 3, LandmarkKind(segment=0.1, diameter=0.2))),
    start=Start(1, 1, 0),
)
PICTURE = np.full((300, 400, 3), (40, 200, 90), np.uint8)


def snapshot(tick: int, **changes: object) -> Snapshot:
    """A robot that drives along y = 3 in the middle of a scan."""
    stamp = 0.1 * tick
    pose = Pose2D(1 + 0.02 * (tick % 150), 3.0, 0.0)
    plain = Snapshot(
        seq=tick,
        stamp=stamp,
        state=State.RUNNING,
        reason="",
        estimate=PoseEstimate(stamp, pose, np.diag([4e-4, 4e-4, 1e-3]), Status.TRACKING),
        measured=Measured(stamp, Pose2D(pose.x + 0.02, pose.y - 0.01, 0.0)),
        target=(pose.x + 0.5, 3.0),
        command=DriveCommand(0.2, 0.0),
        pan=0.5,
        detections=(Detection(13, 2.0, 0.1, 200, 50, 120, 0.01, 0.001),),
        detections_stamp=stamp,
        mission=MissionStatus(1, "scan", 0.5, 3.0, 12.0, 0.31, 2.0, 0.1, 30.0, 75.0),
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


@pytest.fixture
def panel() -> Iterator[Panel]:
    made = Panel()
    made.start()
    yield made
    made.stop()


def faces_area(mesh: shapes.Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_walls_stand_on_every_line_of_the_site() -> None:
    mesh = shapes.walls(SITE)
    # Boundary 20 m, island 4 m, wall 1.5 m, each raised by 0.30 m.
    assert faces_area(mesh) == pytest.approx(25.5 * 0.30)
    assert set(mesh.vertices[:, 2]) == {0.0, 0.30}


def test_floor_leaves_islands_out_and_faces_up() -> None:
    mesh = shapes.flat(SITE.floor(), -0.004)
    assert faces_area(mesh) == pytest.approx(24 - 1)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    assert np.all(np.cross(b - a, c - a)[:, 2] > 0)
    assert shapes.island_tops(Site(boundary=SITE.boundary)) is None
    tops = shapes.island_tops(SITE)
    assert tops is not None
    assert faces_area(tops) == pytest.approx(1)


def test_poles_have_their_true_size_and_code() -> None:
    poles = shapes.poles(SITE.landmarks)
    first = poles.bright[:13][::-1]
    assert "".join("1" if bright else "0" for bright in first) == "1101000101011"
    assert poles.positions[0] == pytest.approx([0, 3, 0.025])
    assert poles.scales[0] == pytest.approx([0.07, 0.07, 0.05])
    # The large one is thirteen segments of 10 cm, its top at 1.30 m.
    assert poles.positions[-1][2] + poles.scales[-1][2] / 2 == pytest.approx(1.30)
    assert shapes.poles([]).positions.shape == (0, 3)


def test_cylinder_is_closed_and_faces_outwards() -> None:
    mesh = shapes.cylinder(64)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    # Gauss: the sum of signed tetrahedra is the volume only where every face looks outwards.
    volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
    assert volume == pytest.approx(math.pi / 4, rel=0.01)


@given(
    along=st.floats(0.01, 1),
    across=st.floats(0.01, 1),
    turn=st.floats(-3, 3),
)
@settings(deadline=None)
def test_ellipse_lies_at_the_95_percent_distance(along: float, across: float, turn: float) -> None:
    cos, sin = math.cos(turn), math.sin(turn)
    rotation = np.array([[cos, -sin], [sin, cos]])
    covariance = np.eye(3)
    covariance[:2, :2] = rotation @ np.diag([along**2, across**2]) @ rotation.T
    estimate = PoseEstimate(0, Pose2D(5, -2, 1), covariance, Status.TRACKING)
    points = shapes.ellipse(estimate, 0.1)[:, 0, :2] - (5, -2)
    squared = np.einsum("ij,jk,ik->i", points, np.linalg.inv(covariance[:2, :2]), points)
    # 95 % of a plane's normal distribution lie within -2 ln(0.05).
    assert squared == pytest.approx(-2 * math.log(0.05), rel=1e-3)


def test_covered_is_the_strip_that_the_tool_swept() -> None:
    covered = shapes.Covered((0, 0), (6, 4), (1, 2, 3, 100))
    covered.sweep((1, 1), 0.4)
    for step in range(1, 301):
        covered.sweep((1 + step * 0.01, 1), 0.4)
    expected = Polygon([(1, 0.8), (4, 0.8), (4, 1.2), (1, 1.2)]).area + math.pi * 0.2**2
    assert covered.share * 24 == pytest.approx(expected, rel=0.05)
    picture = covered.picture()
    row, column = round(1 / covered.cell), round(2.5 / covered.cell)
    assert tuple(picture[row, column]) == (1, 2, 3, 100)
    assert tuple(picture[-row, column]) == (0, 0, 0, 0)
    assert not covered.changed


def test_covered_does_not_join_what_was_not_driven() -> None:
    covered = shapes.Covered((0, 0), (6, 4), (1, 2, 3, 100))
    covered.sweep((1, 1), 0.4)
    covered.lift()
    covered.sweep((5, 3), 0.4)
    assert covered.share * 24 == pytest.approx(2 * math.pi * 0.2**2, rel=0.15)


def test_covered_of_a_large_site_stays_small() -> None:
    covered = shapes.Covered((0, 0), (5000, 10), (1, 2, 3, 100))
    assert max(covered.picture().shape) <= 1025
    assert covered.size[0] == pytest.approx(5000, rel=0.01)


def test_trail_is_thinned_bounded_and_leaves_jumps_out() -> None:
    trail = shapes.Trail(step=0.1, most=100)
    for k in range(1000):
        trail.add(Pose2D(k * 0.01, 0, 0))
    segments = trail.segments(0.0)
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    assert len(segments) <= 100
    assert lengths == pytest.approx(0.1, abs=0.011)
    assert segments[-1, 1, 0] == pytest.approx(9.9, abs=0.1)
    trail.add(Pose2D(50, 50, 0))
    assert len(trail.segments(0.0)) == len(segments)


@pytest.mark.parametrize(
    ("metres", "shown"),
    [(None, "–"), (0.004, "0 cm"), (5.234, "523 cm"), (-9.99, "-999 cm"), (12.34, "12.3 m")],
)
def test_lengths_are_written_for_people(metres: float | None, shown: str) -> None:
    assert text.length(metres) == shown


def test_card_says_what_is_known() -> None:
    card = text.card(snapshot(0))
    for words in ("Running", "100 cm, 300 cm", "20 cm/s", "29°", "31%", "1:15 min"):
        assert words in card
    assert "landmark 13" in card
    assert "± 2.0 cm, 1.8°" in card
    assert "Covered" not in text.card(snapshot(0, mission=None))


def test_card_shows_dashes_ages_and_escapes() -> None:
    unknown = text.card(snapshot(0, estimate=None, state=State.LOST, reason="<script>1</script>"))
    assert unknown.count("–") == 2
    assert "<script>" not in unknown
    assert "&lt;script&gt;" in unknown
    assert "(4 s ago)" in text.card(snapshot(10, stamp=5.0))


def test_linear_light_of_a_colour() -> None:
    # Mid grey of sRGB is 21.6 % of the light of white.
    assert text.linear((128, 0, 255)) == (55, 0, 255)


def test_legend_names_the_four_kinds_of_points() -> None:
    legend = text.legend(simulated=True)
    for color, word in (
        ("#e69f00", "measured"),
        ("#0072b2", "estimated"),
        ("#009e73", "target"),
        ("#262a30", "real"),
    ):
        assert color in legend
        assert word in legend
    assert "real" not in text.legend(simulated=False)


def test_panel_listens_on_this_machine_alone(panel: Panel) -> None:
    assert panel.port > 0
    connection = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=10)
    connection.request("GET", "/")
    response = connection.getresponse()
    assert response.status == 200
    assert b"<title>Viser</title>" in response.read()
    connection.close()
    # Another address of this machine, as a neighbour in the network would use it.
    with pytest.raises(OSError), socket.create_connection(("127.0.0.2", panel.port), timeout=2):  # noqa: PT011
        pass


def test_two_panels_do_not_share_a_port_and_stop_is_final() -> None:
    first, second = Panel(), Panel()
    assert first.port == 0
    first.start()
    second.start()
    first.start()
    assert first.port != second.port
    first.stop()
    first.stop()
    assert first.port == 0
    first.update(snapshot(1), None, None)
    second.stop()


def test_no_viewer_can_open_the_public_tunnel(panel: Panel) -> None:
    server = panel._server
    assert server is not None
    assert server.request_share_url() is None
    assert server._share_tunnel is None


def test_without_a_viewer_an_update_costs_next_to_nothing(panel: Panel) -> None:
    panel.set_site(SITE)
    begin = time.process_time()
    for tick in range(300):
        panel.update(snapshot(tick), Pose2D(1, 3, 0), PICTURE)
    # 300 updates are 30 seconds: well below a tenth of a core.
    assert time.process_time() - begin < 1.5
    assert panel._cone.image is None


def test_covered_floor_follows_the_mission(panel: Panel) -> None:
    panel.set_site(SITE)
    panel.update(snapshot(0, mission=None, state=State.READY), None, None)
    assert panel._covered is not None
    assert panel._covered.share == 0
    for tick in range(100):
        panel.update(snapshot(tick), None, None)
    swept = panel._covered.share * 24
    assert swept == pytest.approx(0.4 * 1.98 + math.pi * 0.2**2, rel=0.05)
    for tick in range(100, 120):
        panel.update(snapshot(tick, state=State.PAUSED), None, None)
    assert panel._covered.share * 24 == swept
    mission = snapshot(0).mission
    assert mission is not None
    panel.update(snapshot(121, mission=replace(mission, run_id=2)), None, None)
    assert panel._covered.share * 24 == pytest.approx(math.pi * 0.2**2, rel=0.15)


def test_a_viewer_gets_the_robot_where_it_is(panel: Panel) -> None:
    panel.set_site(SITE)
    panel.update(snapshot(10), Pose2D(1.25, 3.05, 0.1), PICTURE)
    _pretend_to_watch(panel)
    panel.update(snapshot(20), Pose2D(1.45, 3.05, 0.1), PICTURE)
    assert panel._robot.visible
    assert panel._robot.position == pytest.approx([1.4, 3.0, 0.0])
    assert panel._real.position == pytest.approx([1.45, 3.05, 0.0])
    assert panel._target.position == pytest.approx([1.9, 3.0, 0.0])
    assert panel._ray_lines.points[0, 1] == pytest.approx([0, 3, 0.325])
    assert len(panel._points.points) == 2
    assert panel._floor.image.max() > 0
    # Blue-green-red became red-green-blue.
    assert panel._cone.image is not None
    assert tuple(panel._cone.image[0, 0]) == (90, 200, 40)
    assert "140 cm, 300 cm" in panel._gui_card.content

    panel.update(snapshot(30, estimate=None, target=None, detections=()), None, None)
    assert not panel._robot.visible
    assert not panel._real.visible
    assert not panel._ray_lines.visible


def _pretend_to_watch(panel: Panel) -> None:
    """A viewer counts once its browser has sent its camera, as the test below does."""
    server = panel._server
    assert server is not None
    server.get_clients = lambda: {0: None}  # type: ignore[method-assign, assignment, dict-item, return-value]


@pytest.mark.browser
def test_a_browser_shows_poles_robot_and_covered_floor(panel: Panel, tmp_path: Path) -> None:
    import cv2
    from playwright.sync_api import sync_playwright

    panel.set_site(SITE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium",
            args=["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"],
        )
        page = browser.new_page(viewport={"width": 1000, "height": 700})
        page.goto(f"http://127.0.0.1:{panel.port}")
        wanted = {
            "landmark": text.LANDMARK,
            "measured": text.MEASURED,
            "estimated": text.ESTIMATED,
            "target": text.TARGET,
        }
        missing = set(wanted)
        end = time.monotonic() + 90
        tick = 0
        while missing and time.monotonic() < end:
            for _ in range(5):
                panel.update(snapshot(tick), Pose2D(1, 3, 0), PICTURE)
                tick += 1
            page.wait_for_timeout(500)
            file = tmp_path / "panel.png"
            page.screenshot(path=file)
            picture = cv2.imread(str(file))
            assert picture is not None
            # The legend at the right has the same colours: look at the scene alone.
            scene = picture[:, :640, ::-1].astype(int)
            missing = {
                name
                for name, color in wanted.items()
                if np.count_nonzero(np.abs(scene - color).max(axis=2) < 40) < 12
            }
        assert not missing
        assert page.get_by_text("Running", exact=True).is_visible()
        assert page.get_by_text("landmark 13").is_visible()
        browser.close()


def test_the_panel_says_nothing_on_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    panel = Panel()
    panel.start()
    try:
        print("ours")
    finally:
        panel.stop()
    assert capfd.readouterr().out == "ours\n"
