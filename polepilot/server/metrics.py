"""Figures about the service for Prometheus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from polepilot.core.robot.snapshot import STAGES, State

if TYPE_CHECKING:
    from polepilot.server.runner import Runner
    from polepilot.server.stream import Hub


class Metrics(Collector):
    """Reads the figures when somebody asks; nothing is counted twice."""

    def __init__(self, runner: Runner, hub: Hub) -> None:
        self._runner = runner
        self._hub = hub
        self._registry = CollectorRegistry()
        self._registry.register(self)

    def text(self) -> bytes:
        """The text exposition format."""
        return generate_latest(self._registry)

    def collect(self) -> Iterator[Metric]:
        """Called by the registry."""
        runner, hub = self._runner, self._hub
        yield _counter("polepilot_loop_ticks", "Ticks of the robot's thread.", runner.ticks)
        yield _counter(
            "polepilot_loop_failures", "Ticks that ended in an internal fault.", runner.failures
        )
        yield _gauge("polepilot_stream_clients", "Listeners of the stream.", hub.clients)
        yield _counter("polepilot_stream_messages", "Messages that were sent.", hub.sent)
        yield _counter(
            "polepilot_stream_skipped",
            "Messages that a slow listener did not get, because a newer one came.",
            hub.skipped,
        )
        yield _counter(
            "polepilot_stream_dropped", "Listeners that took nothing for too long.", hub.dropped
        )
        published = runner.latest
        if published is None:
            return
        snapshot, loop = published.snapshot, published.around.loop
        yield _gauge("polepilot_loop_rate_hertz", "Ticks per second.", loop.rate)
        yield _gauge(
            "polepilot_loop_lateness_p99_seconds",
            "99th percentile of how late a tick begins.",
            loop.lateness_p99,
        )
        yield _gauge("polepilot_loop_busy_ratio", "Share of time that ticks take.", loop.busy)
        stages = GaugeMetricFamily(
            "polepilot_tick_stage_seconds", "Time of the last tick's stages.", labels=["stage"]
        )
        for stage, seconds in zip(STAGES, snapshot.durations, strict=True):
            stages.add_metric([stage], seconds)
        yield stages
        state = GaugeMetricFamily("polepilot_state", "1 for the present state.", labels=["state"])
        for name in State:
            state.add_metric([name.value], float(snapshot.state is name))
        yield state
        if snapshot.estimate is not None:
            yield _gauge(
                "polepilot_position_sigma_meters",
                "Standard deviation of the position.",
                snapshot.estimate.position_sigma,
            )
        if snapshot.battery is not None:
            yield _gauge("polepilot_battery_volts", "Of the robot's battery.", snapshot.battery)
        yield _counter("polepilot_link_sent", "Packets sent to the board.", snapshot.link.sent)
        yield _counter("polepilot_link_lost", "Packets without an answer.", snapshot.link.lost)
        yield _counter(
            "polepilot_link_crc_errors", "Packets with a wrong checksum.", snapshot.link.crc_errors
        )


def _gauge(name: str, text: str, value: float) -> Metric:
    return GaugeMetricFamily(name, text, value=value)


def _counter(name: str, text: str, value: float) -> Metric:
    return CounterMetricFamily(name, text, value=value)
