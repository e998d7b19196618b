"""Round trip of PING between Python and the firmware's host program, over a pseudo-terminal.

    PYTHONPATH=tests python tests/bench/ping.py [COUNT]

In real time: encoded, written, carried by the kernel, obeyed by the C core, answered, read and
parsed. Telemetry goes on meanwhile, as in a session. Prints one JSON document; the load says how
much else the computer had to do.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from firmware.boards import HOST, make

from polepilot.core.link.messages import Hello, Ping
from polepilot.core.link.packets import PacketParser

PONG = 0x84
PATIENCE = 10.0


def trips(line: Path, count: int) -> list[float]:
    """Seconds from the first byte written until PONG is parsed, ``count`` times."""
    descriptor = os.open(line, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    parser, out = PacketParser(), []
    os.write(descriptor, b"\0" + Hello().to_packet(0).encode())
    for number in range(count):
        # At no fixed distance from the telemetry, as commands are.
        time.sleep(0.001 + 0.007 * (number * 0.618 % 1.0))
        while select.select([descriptor], [], [], 0)[0]:
            parser.feed(os.read(descriptor, 4096))
        began = time.perf_counter()
        os.write(descriptor, Ping(number).to_packet(number & 0xFF).encode())
        answered = False
        while not answered:
            assert time.perf_counter() - began < PATIENCE, "no answer"
            select.select([descriptor], [], [], 1.0)
            packets = parser.feed(os.read(descriptor, 4096))
            answered = any(packet.type == PONG for packet in packets)
        out.append(time.perf_counter() - began)
    os.close(descriptor)
    return out


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    make("host", of="host")
    with tempfile.TemporaryDirectory() as folder:
        line = Path(folder) / "line"
        program = subprocess.Popen([HOST, "--link", line])
        try:
            end = time.monotonic() + PATIENCE
            while not line.exists():
                assert time.monotonic() < end, "it does not start"
                time.sleep(0.01)
            milliseconds = 1000 * np.array(trips(line, count))
        finally:
            program.terminate()
            program.wait()
    median, p99 = np.percentile(milliseconds, [50, 99])
    said = {
        "count": count,
        "median_ms": round(float(median), 3),
        "p99_ms": round(float(p99), 3),
        "max_ms": round(float(milliseconds.max()), 3),
        "load": round(os.getloadavg()[0], 1),
    }
    print(json.dumps(said))


if __name__ == "__main__":
    main()
