"""The words beside the 3D picture: state, pose, coverage, legend. HTML, everything escaped."""

from __future__ import annotations

import math
from html import escape

from polepilot.core.observation import PoseEstimate
from polepilot.core.robot.snapshot import Snapshot, State

RGB = tuple[int, int, int]

INK: RGB = (38, 42, 48)
MEASURED: RGB = (0xE6, 0x9F, 0x00)
ESTIMATED: RGB = (0x00, 0x72, 0xB2)
TARGET: RGB = (0x00, 0x9E, 0x73)
COVERED: RGB = (0x56, 0xB4, 0xE9)
LANDMARK: RGB = (0xF0, 0x6A, 0x00)
DARK: RGB = (24, 24, 24)

_PILL = {
    State.IDLE: "#6b7280",
    State.FIXING: "#6b7280",
    State.READY: "#0072B2",
    State.RUNNING: "#1a7f4b",
    State.PAUSED: "#b45309",
    State.STOPPED: "#c62828",
    State.LOST: "repeating-linear-gradient(45deg,#c62828 0 8px,#8e1b1b 8px 16px)",
}
_DASH = "–"
_STALE = 1.0
"""Seconds after which a value shows its age."""


def linear(color: RGB) -> RGB:
    """An sRGB colour as linear light, 0 to 255 (IEC 61966-2-1)."""
    red, green, blue = (
        round(255 * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4))
        for c in (part / 255 for part in color)
    )
    return red, green, blue


def length(metres: float | None) -> str:
    """Centimetres under 10 m, else metres with one decimal; a dash where it is unknown."""
    if metres is None:
        return _DASH
    return f"{metres * 100:.0f} cm" if abs(metres) < 9.995 else f"{metres:.1f} m"


def degrees(radians: float | None) -> str:
    """Whole degrees; a dash where it is unknown."""
    # Adding zero keeps "-0" away.
    return _DASH if radians is None else f"{round(math.degrees(radians)) + 0}°"


def duration(seconds: float | None) -> str:
    """Minutes and seconds; a dash where it is unknown."""
    if seconds is None:
        return _DASH
    return f"{int(seconds) // 60}:{int(seconds) % 60:02} min"


def card(snapshot: Snapshot) -> str:
    """State, reason, pose and progress."""
    estimate = snapshot.estimate
    rows: list[tuple[str, str]] = []
    if estimate is None:
        rows += [("Place", _DASH), ("Heading", _DASH)]
    else:
        age = snapshot.stamp - estimate.stamp
        aged = f" ({age:.0f} s ago)" if age > _STALE else ""
        pose = estimate.pose
        rows += [
            ("Place", f"{length(pose.x)}, {length(pose.y)}{aged}"),
            ("Heading", f"{degrees(pose.heading)}{aged}"),
            ("Known to", _spread(estimate)),
        ]
    rows.append(("Speed", f"{snapshot.command.speed * 100:.0f} cm/s"))
    rows.append(("Camera", degrees(snapshot.pan)))
    seen = ", ".join(str(detection.id) for detection in snapshot.detections)
    rows.append(("Sees", f"landmark {seen}" if seen else _DASH))
    mission = snapshot.mission
    if mission is not None:
        if mission.coverage is not None:
            rows.append(("Covered", f"{mission.coverage:.0%}"))
        rows.append(("Driven", f"{length(mission.travelled)} of {length(mission.length)}"))
        rows.append(("Time left", duration(mission.eta)))
    table = "".join(
        f"<tr><td style='opacity:.65;padding:1px 12px 1px 0'>{escape(name)}</td>"
        f"<td>{escape(value)}</td></tr>"
        for name, value in rows
    )
    reason = f"<div style='margin:6px 0'>{escape(snapshot.reason)}</div>" if snapshot.reason else ""
    return (
        "<div style='padding:4px 12px 8px;font-size:13px;font-variant-numeric:tabular-nums'>"
        f"<span style='background:{_PILL[snapshot.state]};color:#fff;border-radius:10px;"
        f"padding:2px 10px;font-weight:600'>{snapshot.state.value.capitalize()}</span>"
        f"{reason}<table style='margin-top:6px'>{table}</table></div>"
    )


def waiting() -> str:
    """What stands there before the first snapshot."""
    return "<div style='padding:4px 12px 8px;font-size:13px'>Waiting for the robot.</div>"


def legend(*, simulated: bool) -> str:
    """Colour, shape and word of everything in the picture."""
    entries = [
        ("◯", INK, "real (simulation only)"),
        ("●", MEASURED, "measured, and rays to what is seen"),
        ("▲", ESTIMATED, "estimated: robot, trail, 95 % ellipse"),
        ("✕", TARGET, "target"),
        ("■", COVERED, "covered floor"),
        ("▮", LANDMARK, "landmark with its number"),
    ]
    rows = "".join(
        f"<div><span style='color:{_hex(color)};display:inline-block;width:20px'>{sign}</span>"
        f"{escape(words)}</div>"
        for sign, color, words in entries
        if simulated or color != INK
    )
    return f"<div style='padding:4px 12px 8px;font-size:13px;line-height:1.5'>{rows}</div>"


def _spread(estimate: PoseEstimate) -> str:
    """Standard deviations, finer than the values themselves: a good pose is not known to 0 cm."""
    heading = math.degrees(estimate.heading_sigma)
    return f"± {estimate.position_sigma * 100:.1f} cm, {heading:.1f}°"


def _hex(color: RGB) -> str:
    return "#" + "".join(f"{part:02x}" for part in color)
