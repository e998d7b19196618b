"""A bad line between the real host and the C core: bytes flipped, dropped and doubled both ways."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from firmware.boards import HOST, make

from polepilot.core.link.packets import Packet, PacketParser
from polepilot.core.link.protocol import HostLink
from polepilot.core.sim.board import BoardInputs
from polepilot.core.sim.board_process import LINK, BoardProcess

TICK = 0.02


def spoiled(data: bytes, rng: np.random.Generator, share: float) -> bytes:
    """``share`` of the bytes flipped in one bit, dropped or doubled."""
    hits = rng.random(len(data)) < share
    if not hits.any():
        return data
    out = bytearray()
    for byte, hit, kind in zip(data, hits, rng.integers(0, 3, len(data)), strict=True):
        if not hit:
            out.append(byte)
        elif kind == 0:
            out.append(byte ^ (1 << int(rng.integers(0, 8))))
        elif kind == 1:
            out += bytes((byte, byte))
    return bytes(out)


@pytest.mark.parametrize(
    ("seconds", "seed"),
    [(60.0, 1), *(pytest.param(600.0, seed, marks=pytest.mark.soak) for seed in (2, 3))],
)
def test_no_wrong_command_is_obeyed_and_motion_goes_on(
    tmp_path: Path, seconds: float, seed: int
) -> None:
    make("host", of="host")
    journal = tmp_path / "journal"
    command = [str(HOST), "--link", LINK, "--in-step", "--journal", str(journal)]
    rng = np.random.default_rng(seed)
    sent, whole = bytearray(), PacketParser()
    clean: list[Packet] = []
    errors, last_errors, moving, ticks, rearmed = 0, 0, 0, 0, 0
    with contextlib.closing(BoardProcess(command)) as board:
        host, now = HostLink(), 0.0
        while now < seconds:
            now += TICK
            ticks += 1
            host.receive(spoiled(board.transmit(), rng, 0.01), now)
            if host.ready and not host.armed and ticks % 25 == 0:
                host.arm()
                rearmed += 1
            if host.armed:
                duty = int(rng.integers(200, 1000))
                host.drive(duty, duty, int(rng.integers(-4500, 4500)))
                host.pan(int(rng.integers(-200, 200)))
            data = host.poll(now)
            sent += data
            clean += whole.feed(data)
            board.receive(spoiled(data, rng, 0.01), now)
            board.step(now, BoardInputs())
            moving += board.outputs.left > 0
            sample = host.telemetry
            if sample is not None:
                told = sample.telemetry.rx_errors
                errors += (told - last_errors) & 0xFF
                last_errors = told
    bodies = [bytes((p.major, p.type, p.seq)).hex() + p.payload.hex() for p in clean]
    obeyed = journal.read_text().split()
    waiting = iter(bodies)
    wrong = [body for body in obeyed if body not in waiting]
    assert wrong == [], "obeyed what was never sent, or in another order"
    assert 0.75 < len(obeyed) / len(bodies) < 0.97
    assert moving / ticks > 0.95
    # A frame is lost and counted; two that run together count once.
    lost = len(bodies) - len(obeyed)
    assert 0.7 * lost < errors < 1.3 * lost
    print(
        f"{seconds:.0f} s, seed {seed}: {len(bodies)} packets sent, {len(obeyed)} obeyed, "
        f"{len(wrong)} wrong; the board counted {errors} errors, the host "
        f"{host.statistics.crc_errors}; moving {100 * moving / ticks:.2f} % of the time, "
        f"armed anew {rearmed} times"
    )
    assert host.statistics.crc_errors > 0
    assert host.statistics.board_rejected == pytest.approx(errors, abs=3)
    assert rearmed < seconds / 10
