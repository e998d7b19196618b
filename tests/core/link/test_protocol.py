"""The host's end against the simulated board, over a line that a test can cut and spoil."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import RefusedError
from polepilot.core.link.messages import (
    Ack,
    AckStatus,
    Arm,
    BoardKind,
    BoardState,
    Clear,
    Drive,
    Estop,
    Features,
    Heartbeat,
    HelloAck,
    HostMessage,
    MessageType,
    Pan,
    Ping,
    decode_host,
)
from polepilot.core.link.packets import Packet, PacketParser
from polepilot.core.link.protocol import HostLink
from polepilot.core.link.report import LinkEvent, LinkEventCode, LinkState
from polepilot.core.sim.board import Board, BoardInputs

TICK = 0.01
Spoil = Callable[[bytes], bytes]


def clean(data: bytes) -> bytes:
    return data


def silent(_data: bytes) -> bytes:
    return b""


class Line:
    """A host and a board, one tick of the owner's loop apart."""

    def __init__(self, start: float = 100.0) -> None:
        self.now = start
        self.board = Board(now=start)
        self.link = HostLink()
        self.to_board: Spoil = clean
        self.to_host: Spoil = clean
        self.events: list[LinkEvent] = []
        self.sent: list[tuple[float, Packet]] = []
        """What the host sent, and when; before the line spoils it."""
        self.inputs = BoardInputs()
        self._tap = PacketParser()

    def tick(self) -> None:
        self.now += TICK
        self.board.step(self.now, self.inputs)
        self.link.receive(self.to_host(self.board.transmit()), self.now)
        data = self.link.poll(self.now)
        self.sent += [(self.now, packet) for packet in self._tap.feed(data)]
        self.board.receive(self.to_board(data), self.now)
        self.events += self.link.events()

    def run(self, seconds: float, drive: tuple[int, int, int] | None = None) -> None:
        for _ in range(round(seconds / TICK)):
            if drive is not None:
                self.link.drive(*drive)
            self.tick()

    def armed(self) -> Line:
        self.run(0.1)
        self.link.arm()
        self.run(0.1)
        assert self.link.state is LinkState.ARMED
        return self

    def messages(self, kind: type[HostMessage], since: float = 0.0) -> list[tuple[float, int]]:
        """Time and number of each packet of this kind."""
        return [
            (at, packet.seq) for at, packet in self.sent if packet.type == kind.TYPE and at >= since
        ]

    def codes(self) -> list[LinkEventCode]:
        return [event.code for event in self.events]


@pytest.fixture
def line() -> Line:
    return Line()


# ---- handshake ---------------------------------------------------------------------------------


def test_handshake_before_anything_else(line: Line) -> None:
    assert line.link.state is LinkState.CONNECTING
    line.to_host = silent
    line.link.drive(500, 500, 0)
    line.link.pan(300)
    line.run(1.0)
    assert {packet.type for _, packet in line.sent} == {MessageType.HELLO}
    assert 4 <= len(line.sent) <= 5
    line.to_host = clean
    line.run(0.3)
    assert line.link.state is LinkState.IDLE
    assert line.link.ready
    assert line.link.board is not None
    assert line.link.board.board is BoardKind.SIMULATED
    assert Features.ENCODERS not in line.link.features
    assert line.codes() == [LinkEventCode.CONNECTED]
    assert line.board.outputs.left == 0, "DRIVE from before the handshake"
    assert line.board.outputs.pan == 300, "pan is kept up"


def answer(ok: bool, major: int) -> HelloAck:
    return HelloAck(
        major, 0, ok, BoardState.IDLE, 40, 20, 250, BoardKind.PIC18F4550, 1, 0, Features.NONE
    )


@pytest.mark.parametrize(
    "packet",
    [
        answer(False, 2).to_packet(0),
        answer(True, 2).to_packet(0),
        answer(False, 1).to_packet(0),
        Packet(type=MessageType.HELLO_ACK, seq=0, payload=b"?", major=2),
    ],
)
def test_another_version_is_told_once_and_never_armed(packet: Packet) -> None:
    link = HostLink()
    link.poll(0.0)
    for now in (0.1, 0.2):
        link.receive(packet.encode(), now)
    assert link.state is LinkState.CONNECTING
    assert [event.code for event in link.events()] == [LinkEventCode.VERSION_MISMATCH]
    with pytest.raises(RefusedError, match="does not answer"):
        link.arm()


def test_an_answer_to_somebody_else_is_no_handshake() -> None:
    link = HostLink()
    link.poll(0.0)
    link.receive(answer(True, 1).to_packet(77).encode(), 0.1)
    assert link.state is LinkState.CONNECTING


# ---- commands ----------------------------------------------------------------------------------


def test_heartbeats_at_ten_hertz_or_more(line: Line) -> None:
    line.run(3.0)
    beats = [at for at, _ in line.messages(Heartbeat)]
    assert max(np.diff(beats)) <= 0.1
    assert len(beats) <= 80


def test_drive_is_sent_once_per_call_and_only_when_armed(line: Line) -> None:
    line.run(0.2, drive=(100, 100, 0))
    assert line.messages(Drive) == []
    line.armed()
    line.run(0.5, drive=(2000, -2000, 20000))
    assert len(line.messages(Drive)) == 50
    drive = decode_host(next(p for _, p in line.sent if p.type == MessageType.DRIVE))
    assert drive == Drive(1000, -1000, 9000)
    since = line.now
    line.run(0.3)
    assert line.messages(Drive, since + TICK / 2) == []
    assert line.board.outputs.left == 0
    assert line.link.state is LinkState.ARMED


def test_a_lost_command_is_resent_with_its_number_and_carried_out_once(line: Line) -> None:
    line.run(0.1)
    line.link.arm()
    line.to_host = silent
    line.run(0.15)
    line.to_host = clean
    line.run(0.1)
    numbers = [seq for _, seq in line.messages(Arm)]
    assert len(numbers) >= 3
    assert len(set(numbers)) == 1
    assert list(line.board.executed) == [Arm()]
    assert line.link.state is LinkState.ARMED
    stamps = [at for at, _ in line.messages(Arm)]
    assert min(np.diff(stamps)) >= 0.06 - 1e-9


def test_a_command_that_nobody_answers_is_given_up(line: Line) -> None:
    line.run(0.1)
    line.to_board = silent
    line.link.arm()
    line.run(0.45)
    assert len(line.messages(Arm)) == 5
    assert LinkEventCode.UNANSWERED in line.codes()
    assert line.link.statistics.unanswered == 1
    line.to_board = clean
    line.run(0.5)
    assert line.link.state is LinkState.IDLE
    assert list(line.board.executed) == []


def test_after_a_pause_of_the_owner_an_old_command_is_not_repeated(line: Line) -> None:
    """Half a second later the board would take the repetition for a new command."""
    line.run(0.1)
    line.link.arm()
    line.to_host = silent
    line.tick()
    line.now += 0.45
    line.to_host = lambda data: b"".join(
        packet.encode()
        for packet in PacketParser().feed(data)
        if packet.type == MessageType.TELEMETRY
    )
    line.run(0.2)
    assert len(line.messages(Arm)) == 1
    assert LinkEventCode.UNANSWERED in line.codes()


def test_a_replayed_acknowledgement_does_not_pretend_to_be_armed(line: Line) -> None:
    """ARM was taken, the link was lost meanwhile, and the ACK says both."""
    line.run(0.1)
    line.link.arm()
    line.tick()
    seq = line.messages(Arm)[0][1]
    line.link.receive(
        Ack(seq, MessageType.ARM, AckStatus.OK, BoardState.LINK_LOST).to_packet(seq).encode(),
        line.now,
    )
    assert line.link.state is LinkState.LINK_LOST
    refused = [e for e in line.link.events() if e.code is LinkEventCode.REFUSED]
    assert len(refused) == 1
    assert "LINK_LOST" in refused[0].message


def test_pan_latest_wins_and_is_kept_up(line: Line) -> None:
    line.run(0.1)
    line.to_host = silent
    for rate in range(100, 110):
        line.link.pan(rate)
        line.tick()
    line.to_host = clean
    line.run(0.1)
    assert line.board.outputs.pan == 109
    since = line.now
    line.run(3.0)
    assert line.board.outputs.pan == 109, "the board's limit of one second was not renewed"
    renewals = line.messages(Pan, since)
    assert 5 <= len(renewals) <= 7
    assert len({seq for _, seq in renewals}) == len(renewals), "a repetition renews nothing"
    line.link.pan(0)
    line.run(0.1)
    assert line.board.outputs.pan == 0
    since = line.now
    line.run(2.0)
    assert line.messages(Pan, since + TICK / 2) == [], "standing needs no renewal"


def test_pan_goes_on_after_a_stop_was_cleared(line: Line) -> None:
    line.armed()
    line.link.pan(-400)
    line.run(0.2)
    line.link.estop()
    since = line.now + TICK
    line.run(0.5)
    assert line.board.outputs.pan == 0
    assert line.messages(Pan, since) == []
    line.link.clear()
    line.run(0.1)
    assert line.board.outputs.pan == -400


def test_ping_measures_the_round_trip(line: Line) -> None:
    line.run(3.5)
    assert 3 <= len(line.messages(Ping)) <= 4
    assert line.link.statistics.round_trip_ms == pytest.approx(1000 * TICK)


# ---- emergency stop ----------------------------------------------------------------------------


def test_estop_goes_out_at_the_next_poll_and_overtakes_arm(line: Line) -> None:
    line.armed()
    line.run(0.5, drive=(800, 800, 0))
    line.link.drive(800, 800, 0)
    line.link.estop()
    assert line.link.state is LinkState.ESTOP, "nobody may drive on until it is acknowledged"
    line.tick()
    assert line.board.state is BoardState.ESTOP
    assert line.board.outputs.left == 0
    line.run(0.1)
    assert not line.link.estop_pending
    with pytest.raises(RefusedError, match="latched"):
        line.link.arm()


def test_estop_is_repeated_until_acknowledged_however_long_it_takes(line: Line) -> None:
    line.armed()
    line.to_board = silent
    line.link.estop()
    line.run(3.0)
    assert len(line.messages(Estop)) >= 40
    assert line.codes().count(LinkEventCode.UNANSWERED) == 1
    line.to_board = clean
    line.run(0.5)
    assert line.board.state is BoardState.ESTOP
    assert line.link.state is LinkState.ESTOP
    assert not line.link.estop_pending


def test_calling_estop_in_every_tick_is_acknowledged_as_well(line: Line) -> None:
    line.armed()
    for _ in range(5):
        line.link.estop()
        line.tick()
    assert len({seq for _, seq in line.messages(Estop)}) <= 3
    line.run(0.1)
    assert not line.link.estop_pending


def test_estop_before_the_handshake_and_without_a_port(line: Line) -> None:
    line.link.port_lost(line.now, "unplugged")
    line.link.estop()
    assert line.link.poll(line.now) == b""
    assert line.link.state is LinkState.CLOSED
    assert line.link.estop_pending
    line.link.reset(line.now)
    line.tick()
    assert line.sent[0][1].type == MessageType.ESTOP
    assert line.board.state is BoardState.ESTOP
    line.run(0.3)
    assert line.link.state is LinkState.ESTOP
    assert not line.link.estop_pending


def test_clear_leads_to_idle_and_never_arms(line: Line) -> None:
    line.armed()
    line.link.clear()
    line.run(0.2)
    assert line.messages(Clear) == [], "there was no stop"
    line.link.estop()
    line.link.clear()
    line.run(0.3)
    assert line.link.state is LinkState.IDLE
    kinds = [p.type for _, p in line.sent if p.type in (MessageType.ESTOP, MessageType.CLEAR)]
    assert kinds == [MessageType.ESTOP, MessageType.CLEAR]


def test_clear_is_refused_while_the_button_is_pressed(line: Line) -> None:
    line.armed()
    line.inputs = BoardInputs(stop_button=True)
    line.run(0.1)
    assert line.link.state is LinkState.ESTOP
    line.link.clear()
    line.run(0.1)
    assert line.link.state is LinkState.ESTOP
    assert LinkEventCode.REFUSED in line.codes()


def test_disarm_keeps_a_latched_stop(line: Line) -> None:
    line.armed()
    line.link.disarm()
    line.run(0.2)
    assert line.link.state is LinkState.IDLE
    line.armed()
    line.inputs = BoardInputs(stop_button=True)
    line.board.step(line.now + TICK / 2, line.inputs)
    line.inputs = BoardInputs()
    line.link.disarm()
    line.run(0.2)
    assert line.link.state is LinkState.ESTOP


# ---- silence, unplugging, restarts ---------------------------------------------------------------


def test_silence_leads_to_a_new_handshake_and_never_to_arming(line: Line) -> None:
    line.armed()
    line.to_host = line.to_board = silent
    line.run(0.45, drive=(500, 500, 0))
    assert line.link.state is LinkState.ARMED, "half a second may pass"
    line.run(0.2, drive=(500, 500, 0))
    assert line.link.state is LinkState.CONNECTING
    assert line.board.state is BoardState.LINK_LOST
    assert LinkEventCode.SILENT in line.codes()
    line.to_host = line.to_board = clean
    line.run(1.0, drive=(500, 500, 0))
    assert line.link.state is LinkState.IDLE
    assert line.board.outputs.left == 0
    assert len(line.messages(Arm)) == 1
    assert line.link.statistics.handshakes == 2


def test_a_short_gap_loses_the_link_on_the_board_alone(line: Line) -> None:
    line.armed()
    line.to_board = silent
    line.run(0.3)
    line.to_board = clean
    line.run(0.1)
    assert line.link.state is LinkState.LINK_LOST
    line.link.arm()
    line.run(0.1)
    assert line.link.state is LinkState.ARMED


def test_unplugged_while_arming_is_not_armed_afterwards(line: Line) -> None:
    line.run(0.1)
    line.link.arm()
    line.link.port_lost(line.now, "unplugged")
    line.link.reset(line.now + 1.0)
    line.now += 1.0
    line.run(0.5)
    assert line.link.state is LinkState.IDLE
    assert line.messages(Arm) == []


def test_a_restarted_board_is_noticed_at_once(line: Line) -> None:
    line.armed()
    line.run(1.0, drive=(500, 500, 0))
    line.board.power_up(line.now)
    line.run(0.1, drive=(500, 500, 0))
    assert LinkEventCode.BOARD_RESET in line.codes()
    assert line.link.state is LinkState.IDLE
    assert line.board.outputs.left == 0


def test_refused_without_a_board() -> None:
    link = HostLink()
    for command in (link.arm, link.clear):
        with pytest.raises(RefusedError) as told:
            command()
        assert told.value.code == "link_not_ready"


# ---- telemetry and figures ---------------------------------------------------------------------


def test_telemetry_latest_age_and_all_samples(line: Line) -> None:
    assert line.link.telemetry is None
    assert line.link.telemetry_age(line.now) is None
    line.run(1.2)
    line.link.samples()
    line.run(1.0)
    samples = line.link.samples()
    assert len(samples) == 50
    assert line.link.samples() == []
    assert np.diff([s.telemetry.t_ms for s in samples]).tolist() == [20] * 49
    assert line.link.telemetry == samples[-1]
    assert line.link.telemetry_age(line.now + 1) == pytest.approx(1.0, abs=0.03)
    assert line.link.statistics.telemetry_rate == pytest.approx(50, abs=1)
    for sample in samples:
        assert sample.stamp == pytest.approx(100.0 + sample.telemetry.t_ms / 1000, abs=0.011)


def test_lost_and_spoiled_packets_are_counted(line: Line) -> None:
    line.armed()
    before = line.link.statistics
    line.to_host = silent
    line.run(0.2)
    line.to_host = clean
    line.run(0.1)
    assert line.link.statistics.lost - before.lost == 10
    line.to_host = lambda data: data[:2] + bytes([data[2] ^ 0x40 or 1]) + data[3:] if data else data
    line.run(0.1)
    line.to_host = clean
    assert line.link.statistics.rejected > before.rejected
    line.to_board = lambda data: b"\x05\x01\x00" + data
    line.run(0.1)
    line.run(0.1)
    assert line.link.statistics.board_rejected > 0


def spoiler(rng: np.random.Generator, share: float) -> Spoil:
    """Flips, drops and doubles a share of the bytes."""

    def spoil(data: bytes) -> bytes:
        out = bytearray()
        for byte, luck in zip(data, rng.random(len(data)), strict=True):
            if luck < share / 3:
                out.append(byte ^ (1 << int(rng.integers(8))))
            elif luck < 2 * share / 3:
                continue
            elif luck < share:
                out += bytes((byte, byte))
            else:
                out.append(byte)
        return bytes(out)

    return spoil


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_percent_of_bad_bytes_both_ways(seed: int) -> None:
    """No wrong command is carried out, each at most once, and the robot gets on."""
    rng = np.random.default_rng(seed)
    line = Line()
    line.to_board, line.to_host = spoiler(rng, 0.01), spoiler(rng, 0.01)
    moving = 0
    ticks = 3000
    for index in range(ticks):
        if line.link.state in (LinkState.IDLE, LinkState.LINK_LOST):
            line.link.arm()
        line.link.pan((index // 200 % 2 * 2 - 1) * 700)
        line.link.drive(400, 400, 1000)
        line.tick()
        outputs = line.board.outputs
        assert outputs.left in range(401)
        assert outputs.steering in range(1001)
        assert outputs.pan in range(-700, 701)
        moving += outputs.left == 400
    assert moving > 0.95 * ticks
    sent = {(p.type, p.payload) for _, p in line.sent}
    assert {(m.TYPE, m.pack()) for m in line.board.executed} <= sent
    distinct = {(p.type, p.seq, at // 1.0) for at, p in line.sent if p.type == MessageType.PAN}
    assert sum(isinstance(m, Pan) for m in line.board.executed) <= len(distinct)
    assert line.link.statistics.rejected > 20
    assert line.link.statistics.board_rejected > 10


OWNER = st.lists(
    st.tuples(
        st.sampled_from(
            ["arm", "disarm", "estop", "clear", "lost", "reset", "drive", "cut", "mend"]
        ),
        st.integers(0, 60),
    ),
    max_size=15,
)


@settings(deadline=None, max_examples=60)
@given(OWNER)
def test_whatever_the_owner_does_nothing_arms_by_itself(deeds: list[tuple[str, int]]) -> None:
    line = Line()
    allowed = 0
    for deed, ticks in deeds:
        if deed == "lost":
            line.link.port_lost(line.now, "test")
        elif deed == "reset":
            line.link.reset(line.now)
        elif deed == "cut":
            line.to_board = line.to_host = silent
        elif deed == "mend":
            line.to_board = line.to_host = clean
        elif deed in ("arm", "clear"):
            try:
                getattr(line.link, deed)()
                allowed += deed == "arm"
            except RefusedError:
                pass
        elif deed != "drive":
            getattr(line.link, deed)()
        for _ in range(ticks):
            if deed == "drive":
                line.link.drive(500, 500, 0)
            line.tick()
            if line.link.estop_pending:
                assert not line.link.armed
    assert line.board.executed.count(Arm()) <= allowed
    line.to_board = line.to_host = clean
    line.link.reset(line.now)
    line.link.estop()
    line.run(1.0)
    assert line.link.state is LinkState.ESTOP
    assert line.board.state is BoardState.ESTOP


@settings(deadline=None)
@given(st.lists(st.binary(max_size=80), max_size=20))
def test_garbage_from_the_line_changes_nothing(pieces: list[bytes]) -> None:
    link = HostLink()
    for index, piece in enumerate(pieces):
        link.receive(piece, index * 0.01)
        link.poll(index * 0.01)
    assert link.state is LinkState.CONNECTING
