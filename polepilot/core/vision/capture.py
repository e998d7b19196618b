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
from polepilot.core.vision.sources import Stream, open_stream

SILENCE = 2.0
"""Seconds without a picture after which ``read`` says so."""
_BACKOFF = (0.25, 0.5, 1.0, 2.0, 5.0)
"""Seconds before the first, second, ... attempt to find a lost camera."""

Opener = Callable[[], Stream]


class CameraCapture:
    """Pictures from a device, an address, a video file or a folder of pictures.

    Args:
        source: as in ``sources.open_stream``.
        camera: pictures are delivered with its ``width`` x ``height``, at most at its ``rate``.
        capture_size: columns and rows asked of a device.
        latency: seconds from the middle of the exposure to the arrival of the picture.
        clock: the robot's monotonic time, seconds.
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
        latency: float = 0.05,
        clock: Callable[[], float] = time.monotonic,
        opener: Opener | None = None,
        silence: float = SILENCE,
        backoff: tuple[float, ...] = _BACKOFF,
    ) -> None:
        self._name = f"/dev/video{source}" if isinstance(source, int) else source
        self._open = opener or (lambda: open_stream(source, rate=camera.rate, size=capture_size))
        self._size = (camera.width, camera.height)
        self._period = 1 / camera.rate
        self._latency = latency
        self._clock = clock
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
                remedy="Check the cable, or unplug the camera and plug it in again.",
                code="camera_silent",
            )
        return None

    def close(self) -> None:
        """Stop the thread and give the device back. A hanging driver is not waited for."""
        self._stop.set()
        self._thread.join(timeout=3.0)

    def _run(self) -> None:
        attempt = 0
        while not self._stop.is_set():
            stream: Stream | None = None
            taken = 0
            final = False
            try:
                stream = self._open()
                taken = self._take_from(stream)
                final = not stream.live
                if not self._stop.is_set():
                    self._fail(self._explain_end(final))
            except CameraError as error:
                final = stream is not None and not stream.live
                self._fail(error)
            except (OSError, cv2.error, ValueError) as error:
                self._fail(CameraError(f"the camera {self._name} failed ({error})."))
            finally:
                if stream is not None:
                    with contextlib.suppress(OSError, cv2.error):
                        stream.release()
            if final:
                return
            attempt = 0 if taken else attempt
            self._stop.wait(self._backoff[min(attempt, len(self._backoff) - 1)])
            attempt += 1

    def _take_from(self, stream: Stream) -> int:
        """Take pictures until there are none; returns how many."""
        taken = 0
        due = self._clock()
        while not self._stop.is_set() and stream.grab():
            arrival = self._clock()
            # Decoding is what costs: a camera faster than asked for is thinned out before it.
            if stream.live and arrival < due - self._period / 4:
                continue
            image = stream.retrieve()
            if image is None:
                continue
            due = max(due + self._period, arrival)
            taken += 1
            frame = Frame(arrival - self._latency, fit(image, *self._size))
            with self._lock:
                self._newest = frame
                self._failure = None
                self._last_arrival = arrival
        return taken

    def _fail(self, error: CameraError) -> None:
        with self._lock:
            self._failure = error

    def _explain_end(self, final: bool) -> CameraError:
        if final:
            return CameraError(
                f"{self._name} has ended: there are no more pictures.", code="camera_ended"
            )
        return CameraError(
            f"the camera {self._name} is gone.",
            remedy="Plug it in again; it is looked for by itself.",
            code="camera_gone",
        )


def fit(image: Image, width: int, height: int) -> Image:
    """``image`` as ``width`` x ``height``: cut to that shape around its middle, then averaged.

    Averaging whole areas is the paper's down-sampling; it keeps edges where they were, to a
    fraction of a pixel. A smaller picture is enlarged linearly.
    """
    rows, columns = image.shape[:2]
    if (columns, rows) == (width, height):
        return image
    # Integers, so that the picture's pixels stay square and its middle stays in the middle.
    kept_columns = min(columns, round(rows * width / height))
    kept_rows = min(rows, round(columns * height / width))
    left, top = (columns - kept_columns) // 2, (rows - kept_rows) // 2
    cut = image[top : top + kept_rows, left : left + kept_columns]
    method = cv2.INTER_AREA if kept_columns >= width else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(cut, (width, height), interpolation=method), dtype=np.uint8)
