"""What the detector can read, and how well: one model for the simulator and for predictions.

The sigmas are those of the detector on pictures of two other programs, with photographs behind the
landmarks (docs/results: 95 % of the errors are within two of them). In plain rooms it is about
two thirds as far off.

Formulas take numbers or numpy arrays alike. Distances are horizontal, from the pan axis to the
landmark's axis; a bearing is measured from the optical axis, and its cosine is what counts here.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import LandmarkKind
from polepilot.core.vehicle import Camera

FARTHEST = 16.0
"""The detector reads a 65 cm landmark no farther away than this, metres; others in proportion."""
NEAREST = 0.2
"""Nothing nearer than this is a landmark in front of the camera, metres."""
RANGE_SHARE = 0.0005
"""Range error that does not depend on the distance, as a share of the range."""
EDGE_PIXELS = 0.16
"""Error of the code's length in the picture, pixels."""
BEARING_SIGMA = math.radians(0.042)
DROP_OUT = 0.03
"""Share of the whole landmarks in view that are not read."""
SIGHT_MARGIN = 0.10
"""The line of sight ends this far short of a pole's axis: poles standing at a wall are seen."""
BORDER = 2.0
"""Pixels that a code has to stay away from the picture's edges."""
_REFERENCE_HEIGHT = 0.65

Number = TypeVar("Number", float, NDArray[np.float64])


def farthest(kind: LandmarkKind) -> float:
    """From how far away landmarks of this kind are read, metres."""
    return FARTHEST * kind.height / _REFERENCE_HEIGHT


def scale_of(camera: Camera, kind: LandmarkKind, distance: Number, cosine: Number) -> Number:
    """Pixels per metre of a landmark's front."""
    return camera.constant / ((distance - kind.axis_depth) * cosine)


def nearest_depth(camera: Camera, kind: LandmarkKind) -> float:
    """Depth of a landmark's front from which on the whole code is in the picture, metres."""
    above = kind.height - camera.mount_height
    up = camera.center_y - BORDER
    down = camera.height - 1 - BORDER - camera.center_y
    return camera.constant * max(above / up, camera.mount_height / down)


def range_sigma(camera: Camera, kind: LandmarkKind, distance: Number, cosine: Number) -> Number:
    """Standard deviation of one measured range, metres."""
    pixels = scale_of(camera, kind, distance, cosine) * kind.height
    edges = EDGE_PIXELS / pixels
    relative: Number = (RANGE_SHARE * RANGE_SHARE + edges * edges) ** 0.5
    return distance * relative
