"""A bad line between the real host and the C core: bytes flipped, dropped and doubled both ways."""

from __future__ import annotations

import binascii
import contextlib
from pathlib import Path

import numpy as np
import pytest
from firmware.boards import HOST, make

from polepilot.core.link.messages import MessageType
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


class _Frames:
    """Counts whole and broken frames with a decoder and a checksum of its own."""

    def __init__(self) -> None:
        self._rest = b""
        self.whole = self.broken = self.telemetry = 0

    def feed(self, data: bytes) -> None:
        *ended, self._rest = (self._rest + data).split(b"\0")
        for frame in ended:
            if not frame:
                continue
            body, at = b"", 0
            while at < len(frame):
                body += frame[at + 1 : at + frame[at]] + b"\0"
                at += frame[at]
            body = body[:-1]
            good = (
                at == len(frame)
                and len(body) >= 5
                and binascii.crc_hqx(body[:-2], 0xFFFF) == int.from_bytes(body[-2:], "little")
            )
            self.whole += good
            self.broken += not good
            self.telemetry += good and body[1] == MessageType.TELEMETRY


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
    whole, told_whole = PacketParser(), PacketParser()
    at_board, at_host = _Frames(), _Frames()
    clean: list[Packet] = []
    told_clean = 0
    errors, last_errors, moving, ticks, rearmed = 0, 0, 0, 0, 0
    with contextlib.closing(BoardProcess(command)) as board:
        host, now = HostLink(), 0.0
        while now < seconds:
            now += TICK
            ticks += 1
            said = board.transmit()
            told_clean += sum(p.type == MessageType.TELEMETRY for p in told_whole.feed(said))
            heard = spoiled(said, rng, 0.01)
            at_host.feed(heard)
            host.receive(heard, now)
            if host.ready and not host.armed and ticks % 25 == 0:
                host.arm()
                rearmed += 1
            if host.armed:
                duty = int(rng.integers(200, 1000))
                host.drive(duty, duty, int(rng.integers(-4500, 4500)))
                host.pan(int(rng.integers(-200, 200)))
            data = host.poll(now)
            clean += whole.feed(data)
            arriving = spoiled(data, rng, 0.01)
            at_board.feed(arriving)
            board.receive(arriving, now)
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
    # Both sides count what an independent decoder finds whole and broken among the same bytes; the
    # board's own count comes with its telemetry, of which the last few may be missing.
    assert len(obeyed) == at_board.whole
    assert errors == pytest.approx(at_board.broken, abs=3)
    statistics = host.statistics
    assert (statistics.received, statistics.rejected) == (at_host.whole, at_host.broken)
    # Lost is what the gaps in the telemetry's numbers tell: of what a handshake is in the way of,
    # which takes half a second at most, nobody knows.
    unknown = 0.5 * told_clean / seconds * statistics.handshakes
    assert statistics.lost == pytest.approx(told_clean - at_host.telemetry, abs=unknown)
    print(
        f"{seconds:.0f} s, seed {seed}: {len(bodies)} packets sent, {len(obeyed)} obeyed, "
        f"{len(wrong)} wrong; the board counted {errors} errors, the host "
        f"{host.statistics.crc_errors}; moving {100 * moving / ticks:.2f} % of the time, "
        f"armed anew {rearmed} times; {statistics.lost} of the board's telemetry lost, really "
        f"{told_clean - at_host.telemetry}"
    )
    assert host.statistics.crc_errors > 0
    assert host.statistics.board_rejected == pytest.approx(errors, abs=3)
    assert rearmed < seconds / 10
