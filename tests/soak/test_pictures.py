"""Long campaigns, by ``./run soak``: damaged picture files of every kind, read and looked at."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from picture_zoo import damaged, zoo
from vision_scenes import picture, pole

from polepilot.core.errors import ImageError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.images import read_image

pytestmark = pytest.mark.soak

SCENE = np.ascontiguousarray(picture([pole(13, 3.0, 0.1)])[80:220, 60:220])
ZOO = zoo(SCENE)
KINDS = dict.fromkeys(range(1, 16), LandmarkKind())


def look(path: Path) -> bool:
    """Read the file and look for landmarks in it; False where it is refused as it should be."""
    begin = time.thread_time()
    try:
        image = read_image(path)
    except ImageError as error:
        message = error.message
    else:
        message = ""
        rows, columns = image.shape[:2]
        camera = Camera(
            width=columns, height=rows, center_x=(columns - 1) / 2, center_y=(rows - 1) / 2
        )
        assert all(found.id in KINDS for found in LandmarkDetector(camera, KINDS).detect(image))
    assert not message or (message.startswith(str(path)) and message.isprintable())
    # A damaged head may claim a hundred million pixels; even those do not take long.
    assert time.thread_time() - begin < 60
    return not message


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", ZOO)
@pytest.mark.parametrize("seed", range(3))
def test_damaged_files(tmp_path: Path, name: str, seed: int) -> None:
    path = tmp_path / name
    for data in damaged(ZOO[name], np.random.default_rng(seed), 400):
        path.write_bytes(data)  # of a crash, this file remains
        look(path)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", [n for n in ZOO if not n.startswith("several")])
def test_files_cut_short_everywhere(tmp_path: Path, name: str) -> None:
    path, data = tmp_path / name, ZOO[name]
    step = max(len(data) // 1500, 1)
    for length in (*range(0, 400), *range(400, len(data) - 2, step)):
        path.write_bytes(data[:length])
        assert not look(path), length
