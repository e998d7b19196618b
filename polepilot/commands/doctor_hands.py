"""What `polepilot doctor --link` tries with somebody's hands and eyes: each input, each output."""

from __future__ import annotations

from collections.abc import Callable

from polepilot.commands.doctor_link import SENSORS, LinkDoctor
from polepilot.commands.person import Person, agrees, choice
from polepilot.core.errors import RefusedError
from polepilot.core.link.messages import NO_SENSOR, Faults, Features
from polepilot.core.link.report import LinkState
from polepilot.core.link.workbench import Motion

_PATIENCE = 20.0
"""For a hand to do what was asked, seconds."""
_DUTY = 300
_PAN_DUTY = 400
_TWITCH = 0.4
_STEERING = 1000
"""Centidegrees."""
_TURNED = 40
"""Counts of the potentiometer: about ten degrees."""
_NEAR_MM = 250


def try_inputs(checks: LinkDoctor, person: Person) -> None:
    """Stop button, potentiometer and proximity sensors, each if the person wants."""
    features = checks.bench.board.features
    person.say("\nThe inputs, one by one; nothing is driven. Enter tries it, s skips it.")
    _try(checks, person, "stop button", "Press the robot's stop button and hold it.", _button)
    if Features.PAN in features:
        _try(
            checks,
            person,
            "potentiometer",
            "Turn the camera by hand, some way to the left and then to the right.",
            _potentiometer,
        )
    if Features.PROXIMITY in features:
        for index, name in enumerate(SENSORS):
            _try(
                checks,
                person,
                f"proximity {name}",
                f"Hold your hand 15 cm in front of the {name} sensor alone.",
                lambda checks, person, index=index: _proximity(checks, person, index),  # type: ignore[misc]
            )
    _release(checks, person)


def try_outputs(checks: LinkDoctor, person: Person) -> None:
    """Each motor and the servo, for a moment, after a yes for each."""
    bench = checks.bench
    person.say(
        "\nThe outputs. Put the robot on a box, so that NO WHEEL TOUCHES THE GROUND, and keep "
        "fingers and cables away. Each one twitches for less than half a second; any key stops it."
    )
    if not agrees(person, "Are all wheels in the air?"):
        checks.note("outputs", "skipped", "not tried")
        return
    for side, left, right in (("left", _DUTY, 0), ("right", 0, _DUTY)):
        for way, sign in (("forward", 1), ("backward", -1)):
            _twitch(
                checks,
                person,
                f"{side} wheel {way}",
                lambda sign=sign, left=left, right=right: bench.drive(  # type: ignore[misc]
                    sign * left, sign * right, 0, _TWITCH
                ),
                lambda motion: max(max(map(abs, s.telemetry.duty)) for s in motion.samples) > 100,
            )
    for side, angle in (("left", _STEERING), ("right", -_STEERING)):
        _twitch(
            checks,
            person,
            f"front wheel to the {side}",
            lambda angle=angle: bench.drive(0, 0, angle, _TWITCH),  # type: ignore[misc]
            lambda motion: max(abs(s.telemetry.steering) for s in motion.samples) > 500,
        )
    if Features.PAN in bench.board.features:
        for side, rate in (("left", _PAN_DUTY), ("right", -_PAN_DUTY)):
            _twitch_pan(checks, person, side, rate)


# ---- inputs ----------------------------------------------------------------------------------


def _try(
    checks: LinkDoctor,
    person: Person,
    name: str,
    request: str,
    seen: Callable[[LinkDoctor, Person], str],
) -> None:
    if person.ask(f"{request} [Enter/s]").lower().startswith("s"):
        checks.note(name, "skipped", "not tried")
        return
    found = seen(checks, person)
    person.show("")
    if found:
        checks.note(name, "good", found)
    else:
        checks.note(name, "bad", f"nothing was noticed within {_PATIENCE:.0f} s: check its wires")


def _button(checks: LinkDoctor, _: Person) -> str:
    bench = checks.bench

    def pressed() -> bool:
        return Faults.STOP_BUTTON in checks.telemetry.faults

    bench.watch(_PATIENCE, pressed)
    if not pressed():
        return ""
    bench.watch(0.3)
    return "stops the board" if bench.state is LinkState.ESTOP else ""


def _potentiometer(checks: LinkDoctor, person: Person) -> str:
    low = high = checks.telemetry.pan_adc

    def both_ways() -> bool:
        nonlocal low, high
        now = checks.telemetry.pan_adc
        low, high = min(low, now), max(high, now)
        person.show(f"  {checks.pan_in_words(now)}; so far from {low} to {high}")
        return high - low >= 2 * _TURNED

    checks.bench.watch(_PATIENCE, both_ways)
    return f"from {low} to {high} counts" if high - low >= 2 * _TURNED else ""


def _proximity(checks: LinkDoctor, person: Person, index: int) -> str:
    def near() -> bool:
        person.show(f"  sees {checks.telemetry.proximity_mm[index] / 10:.0f} cm")
        return checks.telemetry.proximity_mm[index] < _NEAR_MM

    checks.bench.watch(_PATIENCE, near)
    readings = checks.telemetry.proximity_mm
    if not near():
        return ""
    others = [
        SENSORS[i]
        for i, reading in enumerate(readings)
        if i != index and reading != NO_SENSOR and reading < readings[index]
    ]
    also = f"; but the {others[0]} one sees more: swapped?" if others else ""
    return f"sees {readings[index] / 10:.0f} cm{also}"


def _release(checks: LinkDoctor, person: Person) -> None:
    """A stop that is latched by now ends only if somebody says so."""
    bench = checks.bench
    if bench.state is not LinkState.ESTOP:
        return
    if agrees(person, "The board is stopped. Is the button released, and shall the stop end?"):
        released = bench.release()
        checks.note(
            "release",
            "good" if released else "bad",
            "the stop has ended" if released else "the board stays stopped: is the button pressed?",
        )


# ---- outputs ---------------------------------------------------------------------------------


def _twitch(
    checks: LinkDoctor,
    person: Person,
    name: str,
    move: Callable[[], Motion],
    applied: Callable[[Motion], bool],
) -> Motion | None:
    """One output for a moment, if the person agrees; what the board applied and what was seen."""
    if not agrees(person, f"Twitch: {name}?"):
        checks.note(name, "skipped", "not tried")
        return None
    _release(checks, person)
    try:
        with person.at_the_keys() as pressed:
            motion = checks.bench.watched_by(pressed, move)
    except RefusedError as error:
        checks.note(name, "bad", error.message)
        return None
    if motion.stopped:
        checks.note(name, "skipped", motion.stopped)
        return None
    if Faults.PROXIMITY_STOP in motion.faults:
        checks.note(name, "warning", "held back: something is near a proximity sensor")
        return None
    if not motion.samples or not applied(motion):
        checks.note(name, "bad", "the board did not drive it")
        return None
    seen = choice(person, "Did it do that: yes, no, or something else (o)?", "yno")
    if seen == "y":
        checks.note(name, "good", "driven and seen")
    elif seen == "n":
        checks.note(name, "bad", "driven, but nothing turned: check motor supply, bridge, wires")
    else:
        checks.note(name, "bad", "something else turned, or the other way: swap the wires")
    return motion


def _twitch_pan(checks: LinkDoctor, person: Person, side: str, rate: int) -> None:
    name = f"camera to the {side}"
    before = checks.telemetry.pan_adc
    motion = _twitch(checks, person, name, lambda: checks.bench.pan(rate, _TWITCH), lambda _: True)
    if motion is None:
        return
    turned = checks.telemetry.pan_adc - before
    rising = checks.pan.adc_at_maximum > checks.pan.adc_at_minimum
    if abs(turned) < 5:
        words = f"the potentiometer did not follow ({before} to {before + turned} counts)"
        checks.note("potentiometer", "bad", words)
    elif (turned > 0) != ((rate > 0) == rising):
        checks.note("potentiometer", "bad", "it runs the other way than robot.toml's [pan] says")
    else:
        checks.note("potentiometer", "good", f"followed: {before} to {before + turned} counts")
