"""A run's log read back, also one that a power cut or ``kill -9`` left without its end."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel, DataEnd, Footer, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

_LARGEST_RECORD = 64 * 2**20
"""Bytes. A longer record is a damaged length: the recorder's chunks hold 32 KiB and a picture."""
_DAMAGE = (McapError, ZstdError, struct.error, KeyError, ValueError, OverflowError, MemoryError)


class LogReader:
    """All messages of a log that reached the disk, in the order in which they were written.

    Iterate once; afterwards ``cut`` says whether the file ends too early. Nothing is raised for
    what is in the file, only for a file that cannot be opened (OSError).
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.count = 0
        """Messages so far."""
        self.cut = ""
        """Why reading ended before the log did, as a sentence's end; empty for a whole log."""

    def __iter__(self) -> Iterator[tuple[str, int, bytes]]:
        """Channel, log time (nanoseconds) and data of each message."""
        channels: dict[int, str] = {}
        ended = False
        with self._path.open("rb") as file:
            reader = StreamReader(file, validate_crcs=True, record_size_limit=_LARGEST_RECORD)
            try:
                for record in reader.records:
                    if isinstance(record, Channel):
                        channels[record.id] = record.topic
                    elif isinstance(record, Message):
                        topic = channels[record.channel_id]
                        self.count += 1
                        yield topic, record.log_time, record.data
                    elif isinstance(record, (DataEnd, Footer)):
                        ended = True
            except _DAMAGE as error:
                # The end of a file that was never finished: what came before it is good.
                if not ended:
                    self.cut = f"cut off or damaged after {self.count} messages ({_words(error)})"


def read_messages(path: Path) -> Iterator[tuple[str, int, bytes]]:
    """Channel, log time (nanoseconds) and data of all messages; none where there is no file."""
    if path.is_file():
        yield from LogReader(path)


def finish_log(path: Path, out: Path | None = None) -> int:
    """Give a log that was cut off its end, so that every MCAP reader opens it.

    The whole log replaces ``path``, or goes to ``out``, in one step. Returns how many messages
    there were to keep; with none, nothing is written.
    """
    target = path if out is None else out
    whole = target.with_name(f"{target.name}.part")
    count = 0
    try:
        with whole.open("wb") as file:
            writer = Writer(file, compression=CompressionType.ZSTD)
            writer.start(profile="", library="polepilot")
            channels: dict[str, int] = {}
            for channel, stamp, data in read_messages(path):
                if channel not in channels:
                    schema = writer.register_schema(channel, "jsonschema", b'{"type":"object"}')
                    channels[channel] = writer.register_channel(channel, "json", schema)
                writer.add_message(channels[channel], stamp, data, stamp)
                count += 1
            writer.finish()  # type: ignore[no-untyped-call]
            file.flush()
            os.fsync(file.fileno())
        if count:
            whole.replace(target)
    finally:
        whole.unlink(missing_ok=True)
    return count


def _words(error: Exception) -> str:
    return str(error).strip().rstrip(".") or type(error).__name__
