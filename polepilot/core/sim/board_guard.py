"""The simulated board below its packets: states, deadlines, outputs, and how it protects itself.

It does what ``firmware/core/robot.c`` does, and knows nothing of packets either. Time comes as
milliseconds since power-up.
"""

from __future__ import annotations

from polepilot.core.link.messages import (
    CLEAR_KEY,
    MAX_DUTY,
    AckStatus,
    Arm,
    BoardState,
    Clear,
    Drive,
    Faults,
    Features,
    Pan,
)
from polepilot.core.sim.board_motor import BoardMotor, approach
from polepilot.core.sim.board_pins import BoardInputs, BoardOutputs, BoardSettings

LINK_TIMEOUT_MS = 250
"""Without any valid packet: LINK_LOST, motors off."""
DRIVE_TIMEOUT_MS = 250
"""Without DRIVE: wheels off, heartbeats or not."""
STEERING_TIMEOUT_MS = 1000
"""Without DRIVE: the servo returns to its centre, long after the wheels stand."""
PAN_TIMEOUT_MS = 1000
"""Without PAN: the pan motor stops."""
_STAND = Drive(0, 0, 0)


class BoardGuard:
    """One robot from power-up on.

    Args:
        reset: why it has just started; shown as a fault until CLEAR.
    """

    def __init__(self, settings: BoardSettings, reset: Faults = Faults.NONE) -> None:
        self.state = BoardState.IDLE
        self.ready = False
        """HELLO has come, in our version of the protocol."""
        self.inputs = BoardInputs()
        """What the pins said last."""
        self._settings = settings
        self._reset_faults = reset
        self._low_battery = False
        self._ms = 0
        self._actuated_ms = 0
        self._packet_ms = 0
        self._drive_ms: int | None = None
        self._pan_ms = 0
        self._wanted = _STAND
        self._wanted_pan = 0
        self._steering = 0
        self._left = BoardMotor(settings.duty_slew)
        self._right = BoardMotor(settings.duty_slew)
        self._pan = BoardMotor(settings.pan_slew)
        self._pan_stuck = 0
        """Sign of the direction in which the pan motor did not move; 0 while it does."""
        self._pan_mark = (self.inputs.pan_adc, 0)
        """Potentiometer and time when the pan motor was last seen to move."""

    @property
    def faults(self) -> Faults:
        faults = self._reset_faults
        if self.inputs.stop_button:
            faults |= Faults.STOP_BUTTON
        if self._blocked():
            faults |= Faults.PROXIMITY_STOP
        if self._low_battery:
            faults |= Faults.LOW_BATTERY
        if self._pan_stuck:
            faults |= Faults.PAN_STUCK
        return faults

    @property
    def outputs(self) -> BoardOutputs:
        """What the motors get now."""
        return BoardOutputs(self._left.duty, self._right.duty, self._steering, self._pan.duty)

    # ---- time --------------------------------------------------------------------------------

    def advance(self, ms: int) -> None:
        """Let time pass until ``ms``: whatever has had its time without a command returns to its
        default. Before the bytes that came meanwhile: they cannot undo a missed deadline."""
        self._ms = ms
        if self.inputs.stop_button:
            self.stop(BoardState.ESTOP)
        if ms - self._packet_ms >= LINK_TIMEOUT_MS:
            self._pan_off()
            if self.state is BoardState.ARMED:
                self.stop(BoardState.LINK_LOST)
        if self._drive_ms is not None:
            age = ms - self._drive_ms
            if age >= DRIVE_TIMEOUT_MS:
                self._halt()
            if age >= STEERING_TIMEOUT_MS:
                self._wanted = _STAND
                self._drive_ms = None
        if ms - self._pan_ms >= PAN_TIMEOUT_MS:
            self._pan_off()

    def actuate(self) -> None:
        """After the commands of this moment: ramps, end stops, limits."""
        elapsed = self._ms - self._actuated_ms
        self._actuated_ms = self._ms
        self._actuate_wheels(elapsed)
        reach = self._settings.steering_slew * elapsed
        self._steering = approach(self._steering, self._wanted.steering, reach)
        self._watch_pan()
        self._actuate_pan(elapsed)
        self._watch_battery()

    # ---- commands ----------------------------------------------------------------------------

    def heard(self) -> None:
        """A valid packet of any kind has come."""
        self._packet_ms = self._ms

    def hello(self, ok: bool) -> None:
        """Everything off; ready if the host speaks our version. A latched stop stays."""
        self.ready = ok
        self.stop(BoardState.ESTOP if self.state is BoardState.ESTOP else BoardState.IDLE)
        self._wanted = _STAND
        self._steering = 0
        self._drive_ms = None
        self._pan_stuck = 0

    def stop(self, state: BoardState) -> None:
        """All motors off at once, and into ``state``."""
        self.state = state
        self._halt()
        self._pan_off()

    def drive(self, message: Drive) -> None:
        """Ignored unless armed; clamped."""
        if self.state is not BoardState.ARMED:
            return
        self._wanted = Drive(
            _clamp(message.left, MAX_DUTY),
            _clamp(message.right, MAX_DUTY),
            _clamp(message.steering, self._settings.max_steering),
        )
        self._drive_ms = self._ms

    def execute(self, message: Arm | Pan | Clear) -> AckStatus:
        """What becomes of a command that is acknowledged."""
        if isinstance(message, Clear) and message.key != CLEAR_KEY:
            return AckStatus.RANGE
        if not self.ready:
            return AckStatus.NOT_READY
        if isinstance(message, Clear):
            return self._clear()
        if isinstance(message, Arm):
            return self._arm()
        return self._turn(message)

    def _clear(self) -> AckStatus:
        if self.inputs.stop_button:
            return AckStatus.NOT_READY
        if self.state is not BoardState.LINK_LOST:
            self.stop(BoardState.IDLE)
        self._reset_faults = Faults.NONE
        self._pan_stuck = 0
        return AckStatus.OK

    def _arm(self) -> AckStatus:
        if self.state is BoardState.ESTOP:
            return AckStatus.NOT_READY
        if self.state is not BoardState.ARMED:
            self._halt()
        self.state = BoardState.ARMED
        return AckStatus.OK

    def _turn(self, message: Pan) -> AckStatus:
        if self.state not in (BoardState.IDLE, BoardState.ARMED):
            return AckStatus.NOT_READY
        self._wanted_pan = _clamp(message.rate, MAX_DUTY)
        self._pan_ms = self._ms
        if _sign(self._wanted_pan) != self._pan_stuck:
            self._pan_stuck = 0
        return AckStatus.OK

    # ---- outputs -----------------------------------------------------------------------------

    def _halt(self) -> None:
        """Wheels off at once; the servo stays, or a robot that still rolls would swerve."""
        self._wanted = Drive(0, 0, self._wanted.steering)
        self._left.off()
        self._right.off()

    def _pan_off(self) -> None:
        self._wanted_pan = 0
        self._pan.off()

    def _blocked(self) -> bool:
        if Features.PROXIMITY not in self._settings.features:
            return False
        pairs = zip(self.inputs.proximity_mm, self._settings.hard_limits_mm, strict=True)
        return any(reading < limit for reading, limit in pairs)

    def _actuate_wheels(self, elapsed: int) -> None:
        blocked = self._blocked()
        for motor, wanted in ((self._left, self._wanted.left), (self._right, self._wanted.right)):
            if blocked and motor.duty > 0:
                # Nothing turns forward before an obstacle, not even to slow down gently.
                motor.off()
            motor.run(min(wanted, 0) if blocked else wanted, elapsed)

    def _pan_forbidden(self, way: int) -> bool:
        """Whether the pan motor must not turn this way (the sign of a duty)."""
        settings, adc = self._settings, self.inputs.pan_adc
        if Features.PAN not in settings.features or (way != 0 and way == self._pan_stuck):
            return True
        rising = way if settings.pan_rising else -way
        return (rising < 0 and adc <= settings.pan_low) or (rising > 0 and adc >= settings.pan_high)

    def _actuate_pan(self, elapsed: int) -> None:
        wanted = 0 if self._pan_forbidden(_sign(self._wanted_pan)) else self._wanted_pan
        self._pan.run(wanted, elapsed)
        if wanted == 0 or self._pan_forbidden(_sign(self._pan.duty)):
            self._pan.off()

    def _watch_pan(self) -> None:
        settings, adc, duty = self._settings, self.inputs.pan_adc, self._pan.duty
        moved = abs(adc - self._pan_mark[0]) >= settings.pan_stuck_counts
        if moved or abs(duty) < settings.pan_stuck_duty:
            self._pan_mark = (adc, self._ms)
        elif self._ms - self._pan_mark[1] >= settings.pan_stuck_ms:
            self._pan_stuck = _sign(duty)
            self._pan.off()

    def _watch_battery(self) -> None:
        settings = self._settings
        if Features.BATTERY not in settings.features:
            return
        more = settings.battery_hysteresis_mv if self._low_battery else 0
        self._low_battery = self.inputs.battery_mv < settings.low_battery_mv + more


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)
