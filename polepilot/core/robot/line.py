"""The line to the microcontroller: a port with the protocol on it, and its troubles told."""

from __future__ import annotations

from polepilot.core.errors import LinkError
from polepilot.core.link.protocol import HostLink, LinkState, TelemetrySample
from polepilot.core.robot.journal import Journal
from polepilot.core.robot.ports import LinkPort
from polepilot.core.robot.snapshot import Level, LinkStatus


class Line:
    """Moves bytes between ``port`` and ``host``; an unplugged port is waited for."""

    def __init__(self, port: LinkPort, journal: Journal) -> None:
        self.host = HostLink()
        self._port = port
        self._journal = journal
        self._generation = port.generation

    @property
    def stopped(self) -> bool:
        """A stop is latched, or on its way to the board."""
        return self.host.estop_pending or self.host.state is LinkState.ESTOP

    def read(self, now: float) -> list[TelemetrySample]:
        """Take in what has come; the telemetry in it, oldest first."""
        host = self.host
        try:
            chunks = self._port.read()
            if self._port.generation != self._generation:
                self._generation = self._port.generation
                host.reset(now)
            for chunk in chunks:
                host.receive(chunk.data, chunk.stamp)
            if host.ready:
                self._journal.over("link")
        except LinkError as error:
            self._lost(now, error)
        samples = host.samples()
        for event in host.events():
            level: Level = "info" if event.state in (LinkState.IDLE, LinkState.ARMED) else "warning"
            self._journal.say(now, f"link_{event.code}", level, event.message)
        return samples

    def write(self, now: float) -> None:
        """Send what is due."""
        try:
            data = self.host.poll(now)
            if data:
                self._port.write(data)
        except LinkError as error:
            self._lost(now, error)

    def close(self) -> None:
        self._port.close()

    def status(self, now: float) -> LinkStatus:
        """For the snapshot."""
        statistics = self.host.statistics
        trip = statistics.best_round_trip_ms
        return LinkStatus(
            state=self.host.state.value,
            age=self.host.telemetry_age(now),
            sent=statistics.sent,
            lost=statistics.lost,
            crc_errors=statistics.crc_errors,
            round_trip=None if trip is None else trip / 1000,
        )

    def _lost(self, now: float, error: LinkError) -> None:
        self.host.port_lost(now, str(error))
        self._journal.trouble(now, "link", str(error))
