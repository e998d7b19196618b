"""Table 1: the filter of each axis, and what a textbook's filter would do with the same numbers."""

from __future__ import annotations

from typing import Any

from polepilot.core.localization.kalman import AxisFilter

PRINTED = {
    "x": {"Z": (130.24, 138.84), "K": (0.647, 0.43), "X": (130.24, 133.93), "P": (0.352, 0.201)},
    "y": {"Z": (174.51, None), "K": (0.647, 0.43), "X": (174.51, 175.63), "P": (0.352, 0.201)},
}
"""As in the paper; centimetres. The second measurement of y is not printed."""
SECOND_Y = 177.11
"""What it must have been: (175.63 - 174.51) / 0.43 above the first one."""


def document() -> dict[str, Any]:
    """The filter's numbers for both axes, and where the gains go after many steps."""
    axes = {}
    for name, printed in PRINTED.items():
        axis, rows = AxisFilter(), []
        for measured in printed["Z"]:
            z = SECOND_Y if measured is None else measured
            x = axis.update(z)
            rows.append({"Z": z, "K": axis.gain, "X": x, "P": axis.variance})
        axes[name] = rows
    return {"axes": axes, "gains": {"as printed": _last_gain(0.0), "textbook": _last_gain(0.1)}}


def _last_gain(added: float) -> float:
    """Of 500 steps; ``added``: the Q of P = (1 - K)(P + Q), which the table drops."""
    axis = AxisFilter()
    for _ in range(500):
        axis.update(0.0)
        axis.variance += (1.0 - axis.gain) * added
    return axis.gain
