"""The 3D panel: viser on a port of its own on this machine, shown by the server under /viser/.

It explains; it does not control. Without a viewer an update only keeps the trail and the covered
floor; with viewers, moving things go out with every update, growing things at most twice a second.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from typing import Any

import cv2
import numpy as np
import rich
import viser
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D
from polepilot.core.observation import Image
from polepilot.core.plan import Plan
from polepilot.core.robot.snapshot import Snapshot
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel
from polepilot.server import panel_shapes as shapes
from polepilot.server import panel_text as text
from polepilot.server.panel_text import INK, RGB

_SLOW = 0.5
"""Seconds between updates of what grows: trail, covered floor, measured points."""
_PICTURE = 0.2
"""Seconds between pictures on the cone."""
_CARD = 0.25
_SEEN = 0.6
"""Seconds for which a ray to a landmark is shown."""
_POINTS = 600
"""Measured points that are kept."""
_CONE = 1.0
"""Metres from the lens to the picture on the viewing cone."""
# Heights that keep flat things from flickering through each other, metres.
_FLOOR, _COVERED, _PLAN, _MEASURED, _TRAIL, _MARK = -0.004, 0.003, 0.006, 0.01, 0.016, 0.02


class _Server(viser.ViserServer):
    """viser without its public tunnel, which any viewer could ask for."""

    def request_share_url(self, verbose: bool = True) -> None:
        del verbose


class Panel:
    """The 3D picture of site and robot. Methods may be called from any one thread at a time.

    Args:
        model: the robot's body and camera, for their true sizes.
        simulated: whether there is a truth to show.
    """

    def __init__(self, model: RobotModel | None = None, *, simulated: bool = True) -> None:
        self._model = model or RobotModel()
        self._simulated = simulated
        self._tool_width = self._model.vehicle.tool_width
        self._lock = threading.Lock()
        self._server: viser.ViserServer | None = None
        self._site: Site | None = None
        self._trail = shapes.Trail()
        self._measured: deque[tuple[float, float, float]] = deque(maxlen=_POINTS)
        self._plan: NDArray[np.float64] = np.zeros((0, 2, 3))
        self._covered: shapes.Covered | None = None
        self._last_measured = -math.inf
        self._run: int | None = None
        self._watched: frozenset[int] = frozenset()
        self._due: dict[str, float] = {}
        self._card = ""

    @property
    def port(self) -> int:
        """The TCP port on 127.0.0.1; 0 before ``start`` and after ``stop``."""
        return 0 if self._server is None else int(self._server.get_port())

    def start(self) -> None:
        """Listen on a free port of 127.0.0.1. Starting twice does nothing."""
        with self._lock:
            if self._server is not None:
                return
            for name in ("websockets.server", "websockets"):
                # A browser that leaves in the middle of a handshake is no event for our log.
                logging.getLogger(name).setLevel(logging.CRITICAL)
            # viser greets and leaves through rich's shared console, which nobody else here uses.
            rich.get_console().quiet = True
            self._server = _Server(host="127.0.0.1", port=0, verbose=False)
            self._build(self._server)
            if self._site is not None:
                self._show_site(self._server, self._site)

    def stop(self) -> None:
        """Close the port and all viewers. Stopping twice does nothing."""
        with self._lock:
            server, self._server = self._server, None
        if server is not None:
            server.stop()

    def set_site(self, site: Site) -> None:
        """Show another site; trail, points and covered floor begin anew."""
        with self._lock:
            self._site = site
            low, high = _bounds(site)
            self._covered = shapes.Covered(low, high, (*text.COVERED, 115))
            self._trail.clear()
            self._measured.clear()
            self._run = None
            if self._server is not None:
                self._show_site(self._server, site)

    def set_plan(self, plan: Plan | None) -> None:
        """Show the path of a plan, whose tool width covered floor has from now on."""
        with self._lock:
            width = self._model.vehicle.tool_width if plan is None else plan.tool_width
            self._tool_width = width
            self._plan = np.zeros((0, 2, 3))
            if plan is not None:
                path = np.column_stack([plan.path, np.full(len(plan.path), _PLAN)])
                self._plan = shapes.chain(path)
            self._due.clear()

    def update(self, snapshot: Snapshot, truth: Pose2D | None, image: Image | None) -> None:
        """Show a tick, some ten times a second.

        Args:
            truth: where the robot really is, in a simulation.
            image: the newest picture, blue-green-red or monochrome.
        """
        with self._lock:
            self._remember(snapshot)
            server = self._server
            if server is None:
                return
            watched = frozenset(server.get_clients())
            if watched - self._watched:
                # Somebody new gets everything at once, also what is sent slowly otherwise.
                self._due.clear()
            self._watched = watched
            if not watched:
                return
            with server.atomic():
                self._show_moving(snapshot, truth)
                self._show_growing()
                self._show_picture(image)
                self._show_card(snapshot)

    def _remember(self, snapshot: Snapshot) -> None:
        """Keep what grows, whether or not somebody looks."""
        mission = snapshot.mission
        if mission is not None and mission.run_id != self._run:
            self._run = mission.run_id
            self._trail.clear()
            self._measured.clear()
            if self._covered is not None:
                self._covered.clear()
        measured = snapshot.measured
        if measured is not None and measured.stamp > self._last_measured:
            self._last_measured = measured.stamp
            self._measured.append((measured.pose.x, measured.pose.y, _MEASURED))
        if snapshot.estimate is None:
            return
        pose = snapshot.estimate.pose
        self._trail.add(pose)
        if self._covered is not None:
            if mission is not None and snapshot.state == "running":
                self._covered.sweep(pose.position, self._tool_width)
            else:
                self._covered.lift()

    def _build(self, server: viser.ViserServer) -> None:
        """Everything that does not depend on the site."""
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.set_panel_label("Polepilot")
        server.gui.main_panel.dock_right()
        # The default lights wash colours out, and here colours have a meaning.
        server.scene.configure_default_lights(enabled=False)
        server.scene.configure_environment_map(None)
        server.scene.add_light_ambient("/light/all", intensity=2.7)
        server.scene.add_light_directional(
            "/light/sun", intensity=0.8, position=(-2.0, -3.0, 4.0), cast_shadow=False
        )
        self._gui_card = server.gui.add_html(text.waiting())
        self._gui_legend = server.gui.add_html(text.legend(simulated=self._simulated))

        model = self._model
        radius, lens = model.vehicle.body_radius, model.camera.mount_height
        scene = server.scene
        self._robot = scene.add_frame("/robot", show_axes=False, visible=False)
        body = shapes.cylinder()
        scene.add_mesh_simple(
            "/robot/body",
            body.vertices * (2 * radius, 2 * radius, 0.10) + (0, 0, 0.07),
            body.faces,
            color=text.ESTIMATED,
            flat_shading=True,
        )
        scene.add_mesh_simple(
            "/robot/mast",
            body.vertices * (0.03, 0.03, lens - 0.12)
            + (model.camera.forward, 0, (lens + 0.12) / 2),
            body.faces,
            color=(150, 156, 164),
        )
        arrow = shapes.nose(radius, 0.125)
        scene.add_mesh_simple(
            "/robot/nose", arrow.vertices, arrow.faces, color=(255, 255, 255), side="double"
        )
        self._eye = scene.add_frame(
            "/robot/eye", show_axes=False, position=(model.camera.forward, 0, lens)
        )
        camera = model.camera
        vertical = 2 * math.atan2(camera.height / 2, camera.constant)
        # viser's frustum of scale 1 is this deep; the cone shall have the same depth at any lens.
        depth = _frustum_depth(vertical, camera.width / camera.height)
        self._cone = scene.add_camera_frustum(
            "/robot/eye/cone",
            fov=vertical,
            aspect=camera.width / camera.height,
            scale=_CONE / depth,
            thickness=1.5,
            thickness_units="screen",
            color=INK,
            wxyz=shapes.LOOK_AHEAD,
            format="jpeg",
            jpeg_quality=70,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._real = scene.add_frame("/real", show_axes=False, visible=False)
        ring = np.concatenate(
            [
                shapes.circle(radius * 1.35, _MARK),
                [[[radius * 1.35, 0, _MARK], [radius * 1.9, 0, _MARK]]],
            ]
        )
        _draw(_add_lines(scene, "/real/ring", INK, 3), ring)
        self._target = scene.add_frame("/target", show_axes=False, visible=False)
        _draw(_add_lines(scene, "/target/cross", text.TARGET, 6), shapes.cross(0.24, _MARK))
        self._plan_lines = _add_lines(scene, "/plan", (140, 145, 152), 1.5)
        self._trail_lines = _add_lines(scene, "/trail", text.ESTIMATED, 3)
        self._ellipse = _add_lines(scene, "/ellipse", text.ESTIMATED, 2)
        self._ray_lines = _add_lines(scene, "/rays", text.MEASURED, 2)
        self._points = scene.add_point_cloud(
            "/measured",
            np.zeros((1, 3), np.float32),
            text.MEASURED,
            point_size=0.025,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
            visible=False,
        )

    def _show_site(self, server: viser.ViserServer, site: Site) -> None:
        scene = server.scene
        self._due.clear()
        with server.atomic():
            scene.remove_by_name("/site")
            scene.add_frame("/site", show_axes=False)
            self._show_ground(scene, site)
            self._show_poles(scene, site)
        low, high = _bounds(site)
        middle = ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2)
        reach = max(high[0] - low[0], (high[1] - low[1]) * 1.2, 2.0)
        server.initial_camera.look_at = (*middle, 0.0)
        server.initial_camera.position = (middle[0], middle[1] - 0.62 * reach, 0.62 * reach)

    def _show_ground(self, scene: Any, site: Site) -> None:
        low, high = _bounds(site)
        floor = shapes.flat(site.floor(), _FLOOR)
        scene.add_mesh_simple(
            "/site/floor", floor.vertices, floor.faces, color=(255, 255, 255), side="double"
        )
        # Whole metres around the site, so that lines lie on round coordinates.
        west, south = math.floor(low[0]) - 1, math.floor(low[1]) - 1
        east, north = math.ceil(high[0]) + 1, math.ceil(high[1]) + 1
        scene.add_grid(
            "/site/grid",
            width=east - west,
            height=north - south,
            position=((west + east) / 2, (south + north) / 2, 0.0),
            cell_size=1.0,
            section_size=5.0,
            cell_color=(205, 209, 214),
            section_color=(168, 173, 180),
            shadow_opacity=0.0,
        )
        if self._covered is not None:
            self._floor = scene.add_image(
                "/site/covered",
                self._covered.picture(),
                *self._covered.size,
                format="png",
                position=(*self._covered.center, _COVERED),
                cast_shadow=False,
                receive_shadow=False,
            )
        walls = shapes.walls(site)
        scene.add_mesh_simple(
            "/site/walls",
            walls.vertices,
            walls.faces,
            color=(120, 128, 138),
            opacity=0.35,
            side="double",
            flat_shading=True,
            cast_shadow=False,
        )
        if (tops := shapes.island_tops(site)) is not None:
            scene.add_mesh_simple(
                "/site/islands",
                tops.vertices,
                tops.faces,
                color=(120, 128, 138),
                opacity=0.35,
                side="double",
                cast_shadow=False,
            )

    def _show_poles(self, scene: Any, site: Site) -> None:
        if not site.landmarks:
            return
        poles, unit = shapes.poles(site.landmarks), shapes.cylinder()
        scene.add_batched_meshes_simple(
            "/site/poles",
            unit.vertices,
            unit.faces,
            batched_wxyzs=np.tile([1.0, 0, 0, 0], (len(poles.positions), 1)),
            batched_positions=poles.positions,
            batched_scales=poles.scales,
            # viser 1.x takes the colours of batched meshes as linear light, all others as sRGB.
            batched_colors=np.where(
                poles.bright[:, None], text.linear(text.LANDMARK), text.linear(text.DARK)
            ).astype(np.uint8),
            lod="off",
            flat_shading=True,
            cast_shadow=False,
        )
        for mark in site.landmarks:
            scene.add_label(
                f"/site/number{mark.id}",
                str(mark.id),
                position=(mark.x, mark.y, mark.kind.height + 0.08),
                anchor="bottom-center",
            )

    def _show_moving(self, snapshot: Snapshot, truth: Pose2D | None) -> None:
        estimate = snapshot.estimate
        _place(self._robot, None if estimate is None else estimate.pose)
        _place(self._real, truth)
        target = snapshot.target
        _place(self._target, None if target is None else Pose2D(*target, 0.0))
        outline = np.zeros((0, 2, 3))
        if estimate is not None:
            outline = shapes.ellipse(estimate, _TRAIL)
            self._eye.wxyz = np.array(shapes.yaw(snapshot.pan or 0.0))
        _draw(self._ellipse, outline)
        _draw(self._ray_lines, self._rays(snapshot))

    def _rays(self, snapshot: Snapshot) -> NDArray[np.float64]:
        stamp, estimate = snapshot.detections_stamp, snapshot.estimate
        if estimate is None or stamp is None or snapshot.stamp - stamp > _SEEN:
            return np.zeros((0, 2, 3))
        lens = self._model.camera.mount_height
        eye = self._model.camera.pose_on(estimate.pose)
        known = {} if self._site is None else self._site.landmarks_by_id()
        ends = []
        for detection in snapshot.detections:
            mark = known.get(detection.id)
            if mark is not None:
                ends.append((mark.x, mark.y, mark.kind.height / 2))
            elif snapshot.pan is not None:
                heading = eye.heading + snapshot.pan + detection.bearing
                ends.append((*Pose2D(eye.x, eye.y, heading).ahead(detection.range), lens))
        return shapes.rays((eye.x, eye.y, lens), ends)

    def _show_growing(self) -> None:
        fresh = "growing" not in self._due
        if not self._is_due("growing", _SLOW):
            return
        if fresh:
            _draw(self._plan_lines, self._plan)
        if self._trail.changed or fresh:
            _draw(self._trail_lines, self._trail.segments(_TRAIL))
        _draw(self._points, np.array(self._measured, dtype=float).reshape(-1, 3))
        if self._covered is not None and (self._covered.changed or fresh):
            self._floor.image = self._covered.picture()

    def _show_picture(self, image: Image | None) -> None:
        if image is None or not self._is_due("picture", _PICTURE):
            return
        code = cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB
        self._cone.image = cv2.cvtColor(image, code)

    def _show_card(self, snapshot: Snapshot) -> None:
        if not self._is_due("card", _CARD):
            return
        card = text.card(snapshot)
        if card != self._card:
            self._card = card
            self._gui_card.content = card

    def _is_due(self, what: str, period: float) -> bool:
        """Whether ``what`` may be sent again. The wall clock paces sending, nothing else."""
        now = time.monotonic()
        if now < self._due.get(what, -math.inf):
            return False
        self._due[what] = now + period
        return True


def _place(frame: Any, pose: Pose2D | None) -> None:
    """Move a frame to a pose, or hide it."""
    if pose is not None:
        frame.position = np.array([pose.x, pose.y, 0.0])
        frame.wxyz = np.array(shapes.yaw(pose.heading))
    if frame.visible != (pose is not None):
        frame.visible = pose is not None


def _add_lines(scene: Any, name: str, color: RGB, thickness: float) -> Any:
    """Line segments that are drawn later; ``thickness`` in pixels of the screen."""
    return scene.add_line_segments(
        name,
        np.zeros((1, 2, 3), np.float32),
        colors=color,
        thickness=thickness,
        thickness_units="screen",
        visible=False,
    )


def _draw(lines: Any, points: NDArray[np.float64]) -> None:
    """Put other segments (or points) into a node, or hide it where there are none."""
    if len(points):
        lines.points = points.astype(np.float32)
    if lines.visible != (len(points) > 0):
        lines.visible = len(points) > 0


def _frustum_depth(fov: float, aspect: float) -> float:
    """How far from its tip viser 1.x draws the picture of a frustum of scale 1."""
    half_height = math.tan(fov / 2)
    return math.cbrt(3 / (aspect * half_height * half_height))


def _bounds(site: Site) -> tuple[tuple[float, float], tuple[float, float]]:
    points = np.asarray(site.boundary, dtype=float)
    low, high = points.min(axis=0), points.max(axis=0)
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
