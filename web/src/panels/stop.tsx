/** STOP: always there, above everything, also when the robot cannot be reached. */

import { stale, stop, stopping } from "../state/robot";

export function StopButton() {
  const unreachable = stale.value || stopping.value === "unreachable";
  const word = unreachable ? "cannot reach robot" : stopping.value === "asking" ? "asking…" : "";
  return (
    <button
      type="button"
      class={`stop ${unreachable ? "unreachable" : ""}`}
      aria-label="STOP"
      aria-describedby="stop-note"
      title="Stop the robot at once (Shift+Space)"
      // On press, not on release: a stop must not wait for the finger to leave.
      onPointerDown={(event) => event.button === 0 && void stop()}
      onClick={(event) => event.detail === 0 && void stop()}
    >
      <span class="stop-word">STOP</span>
      <span class="stop-note" id="stop-note">
        {word}
      </span>
    </button>
  );
}
