"""A real camera as a ``CameraPort``: the newest picture, never an old one, never a wait.

A thread of its own takes pictures as they come and keeps the last one, averaged down to the size
that the detector works on (as the paper does). When the camera goes away the thread looks for it
again, while ``read`` says what is wrong. Device adapters may read the clock: a picture is stamped
when it arrives.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

import cv2
import numpy as np

from polepilot.core.errors import CameraError
from polepilot.core.observation import Frame, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.devices import CameraControls
from polepilot.core.vision.sources import name_of, open_stream
from polepilot.core.vision.stream import Stream

SILENCE = 2.0
"""Seconds without a picture after which ``read`` says so."""
_BACKOFF = (0.25, 0.5, 1.0, 2.0, 5.0)
"""Seconds before the first, second, ... attempt to find a lost camera."""
_OLDEST = 1.0
"""Seconds; a driver's time stamp that lies further back is of another clock."""
_BROKEN = 30
"""Damaged pictures in a row after which the camera is opened anew."""

Opener = Callable[[], Stream]


class CameraCapture:
    """Pictures from a device, an address, a video file or a folder of pictures.

    A picture is stamped with the time at which the device's driver took it, where the driver says
    so, and with its arrival otherwise; ``latency`` leads from there to the middle of the exposure.

    Args:
        source: as in ``sources.open_stream``.
        camera: pictures are delivered with its ``width`` x ``height``, at most at its ``rate``.
        capture_size: columns and rows asked of a device.
        controls: how a device is set.
        latency: seconds from the middle of the exposure to the picture's time stamp.
        clock: the robot's monotonic time, seconds; it runs like ``time.monotonic``.
        notice: told once, in a sentence, of each thing that is otherwise than asked and still
            works, such as pictures of another shape; called in the camera's thread.
        opener: opens the stream instead of ``source``.
        backoff: seconds to wait before each attempt to find a lost camera; the last one repeats.

    Opening happens in the thread: a camera that is missing shows in ``read``.
    """

    def __init__(
        self,
        source: int | str,
        camera: Camera,
        *,
        capture_size: tuple[int, int] = (1600, 1200),
        controls: CameraControls | None = None,
        latency: float = 0.05,
        clock: Callable[[], float] = time.monotonic,
        notice: Callable[[str], None] | None = None,
        opener: Opener | None = None,
        silence: float = SILENCE,
        backoff: tuple[float, ...] = _BACKOFF,
    ) -> None:
        self._name = name_of(source)
        self._secret = str(source)
        self._open = opener or (
            lambda: open_stream(source, rate=camera.rate, size=capture_size, controls=controls)
        )
        self._size = (camera.width, camera.height)
        self._period = 1 / camera.rate
        self._latency = latency
        self._clock = clock
        self._notice = notice
        self._told: set[str] = set()
        self._silence = max(silence, 3 * self._period)
        self._backoff = backoff

        self._lock = threading.Lock()
        self._newest: Frame | None = None
        self._failure: CameraError | None = None
        self._last_arrival = clock()

        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def read(self) -> Frame | None:
        """The newest picture that was not read yet, or None; never blocks.

        Raises:
            CameraError: the camera is missing, forbidden, busy, silent or gone, or its file has
                ended. It is being looked for again; a later call may deliver pictures.
        """
        with self._lock:
            frame, self._newest = self._newest, None
            if frame is not None:
                return frame
            if self._failure is not None:
                # A fresh copy, so that tracebacks do not pile up on one object.
                failure = self._failure
                raise CameraError(failure.message, remedy=failure.remedy, code=failure.code)
            silent = self._clock() - self._last_arrival
        if silent > self._silence and not self._stop.is_set():
            raise CameraError(
                f"no picture from {self._name} for {silent:.0f} s.",
                remedy="Check cable and power of the camera, or unplug it and plug it in again.",
                code="camera_silent",
            )
        return None

    def close(self) -> None:
        """Stop the thread and give the device back. A hanging driver is not waited for."""
        self._stop.set()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        attempt = 0
        while not self._stop.is_set():
            stream: Stream | None = None
            arrived = self._last_arrival
            final = False
            try:
                stream = self._open()
                for note in stream.notes:
                    self._tell(note)
                self._take_from(stream)
                final = not stream.live
                if not self._stop.is_set():
                    self._fail(self._explain_end(final))
            except CameraError as error:
                final = stream is not None and not stream.live
                self._fail(error)
            except Exception as error:  # noqa: BLE001 - said, and tried again, not blind for ever
                final = stream is not None and not stream.live
                self._fail(CameraError(f"the camera {self._name} failed ({self._clean(error)})."))
            finally:
                if stream is not None:
                    with contextlib.suppress(OSError, cv2.error):
                        stream.release()
            if final:
                return
            attempt = 0 if self._last_arrival > arrived else attempt
            self._stop.wait(self._backoff[min(attempt, len(self._backoff) - 1)])
            attempt += 1

    def _take_from(self, stream: Stream) -> None:
        """Take pictures until there are none."""
        due = self._clock()
        broken = 0
        while not self._stop.is_set() and stream.grab():
            arrival = self._clock()
            # Decoding is what costs: a camera faster than asked for is thinned out before it.
            if stream.live and arrival < due - self._period / 4:
                continue
            age = self._age(stream)
            image = stream.retrieve()
            if image is None:
                broken += 1
                if broken >= _BROKEN:
                    raise CameraError(
                        f"the camera {self._name} sends nothing but damaged pictures.",
                        remedy="Use another cable or port, or ask for fewer pixels "
                        "(camera.capture_width, camera.capture_height).",
                        code="camera_broken",
                    )
                continue
            broken = 0
            due = max(due + self._period, arrival)
            self._tell(describe_fit(image.shape[1], image.shape[0], *self._size))
            frame = Frame(arrival - age - self._latency, fit(image, *self._size))
            with self._lock:
                self._newest = frame
                self._failure = None
                self._last_arrival = arrival

    @staticmethod
    def _age(stream: Stream) -> float:
        """Seconds since the driver took the picture; 0 where it does not say."""
        taken = stream.stamp()
        if taken is None:
            return 0.0
        age = time.monotonic() - taken
        return age if 0 <= age <= _OLDEST else 0.0

    def _tell(self, note: str) -> None:
        if note and note not in self._told and self._notice is not None:
            self._told.add(note)
            self._notice(note)

    def _clean(self, error: Exception) -> str:
        """What a library says, on one line and without the password of the camera."""
        words = " ".join(str(error).replace(self._secret, self._name).split())
        return words or type(error).__name__

    def _fail(self, error: CameraError) -> None:
        with self._lock:
            self._failure = error

    def _explain_end(self, final: bool) -> CameraError:
        if final:
            return CameraError(
                f"{self._name} has ended: there are no more pictures.", code="camera_ended"
            )
        return CameraError(
            f"the camera {self._name} has stopped sending pictures.",
            remedy="Check its cable and power; it is looked for by itself.",
            code="camera_gone",
        )


def fit(image: Image, width: int, height: int) -> Image:
    """``image`` as ``width`` x ``height``: cut to that shape around its middle, then averaged.

    Averaging whole areas is the paper's down-sampling; it keeps edges where they were, to a
    fraction of a pixel. A smaller picture is enlarged linearly. Pixels stay square and the middle
    stays the middle, so that one camera constant holds for both directions.
    """
    rows, columns = image.shape[:2]
    if (columns, rows) == (width, height):
        return image
    kept_columns, kept_rows = _kept(columns, rows, width, height)
    left, top = (columns - kept_columns) // 2, (rows - kept_rows) // 2
    cut = image[top : top + kept_rows, left : left + kept_columns]
    method = cv2.INTER_AREA if kept_columns >= width else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(cut, (width, height), interpolation=method), dtype=np.uint8)


def describe_fit(columns: int, rows: int, width: int, height: int) -> str:
    """What ``fit`` loses, in a sentence for a person; "" where that is nothing to speak of."""
    kept_columns, kept_rows = _kept(columns, rows, width, height)
    if kept_columns < width:
        return (
            f"the camera's pictures of {columns}x{rows} pixels are smaller than the {width}x"
            f"{height} of robot.toml: they are enlarged, which does not make ranges better."
        )
    if kept_columns < columns - 1:
        sides, share = "left and right", 1 - kept_columns / columns
    elif kept_rows < rows - 1:
        sides, share = "top and bottom", 1 - kept_rows / rows
    else:
        return ""
    return (
        f"the camera's pictures of {columns}x{rows} pixels lose {share:.0%} at {sides} to have the "
        f"shape of {width}x{height}; the camera constant holds for this size of pictures only."
    )


def _kept(columns: int, rows: int, width: int, height: int) -> tuple[int, int]:
    """Columns and rows of the part around the middle that has the shape of width x height."""
    kept_columns = min(columns, max(1, round(rows * width / height)))
    return kept_columns, min(rows, max(1, round(columns * height / width)))
