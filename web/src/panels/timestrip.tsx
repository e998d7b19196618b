/** The line at the bottom: what happens, how far it is, and on a finished run the slider. */

import { counter, duration, length, percent } from "../core/format";
import { fewest } from "../core/site";
import { hint, type Sketch } from "../core/sketch";
import { check, site } from "../state/draft";
import { finishSketch, pointer, pressKey, resolution, sketch } from "../state/editor";
import { location } from "../state/location";
import { hush, notice, work } from "../state/notice";
import { plan, planning, waiting } from "../state/plan";
import { mission, simulationTool, snapshot, stale } from "../state/robot";
import { moment, play, playing, run, span } from "../state/runs";
import { Button, IconButton } from "../ui/controls";

const BARS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];

function ScaleBar() {
  const metres = BARS.find((bar) => bar / resolution.value >= 48) ?? 1000;
  const text = metres < 1 ? `${Math.round(metres * 100)} cm` : `${metres} m`;
  return (
    <div class="scale-bar" title="Scale">
      <span class="scale-line" style={{ width: `${metres / resolution.value}px` }} />
      {text}
    </div>
  );
}

function TimeSlider() {
  const range = span.value;
  if (!range || moment.value === null) return null;
  return (
    <div class="slider">
      <IconButton
        icon={playing.value ? "pause" : "play"}
        label={playing.value ? "Halt playing" : "Play the run"}
        onClick={play}
      />
      <input
        type="range"
        aria-label="Time in the run"
        aria-valuetext={counter(moment.value - range[0])}
        min={range[0]}
        max={range[1]}
        step="any"
        value={moment.value}
        onInput={(event) => {
          playing.value = false;
          moment.value = Number(event.currentTarget.value);
        }}
      />
      <span class="number">
        {counter(moment.value - range[0])} / {counter(range[1] - range[0])}
      </span>
    </div>
  );
}

function Progress() {
  const now = mission.value;
  if (!now) {
    const last = snapshot.value?.events[snapshot.value.events.length - 1];
    return <span class="line">{last?.text ?? "No mission runs."}</span>;
  }
  return (
    <div class="progress-line">
      <progress max={1} value={now.progress} aria-label="Progress" />
      <span class="number">{percent(now.progress)}</span>
      <span class="quiet">
        {now.eta === null ? duration(now.elapsed) : `${duration(now.eta)} left`}
        {now.coverage !== null && ` · ${percent(now.coverage)} covered`}
      </span>
    </div>
  );
}

const noMouse = window.matchMedia("(hover: none)");

/** What to do next, and for fingers what the keys would do. */
function DrawingLine() {
  const tool = sketch.value;
  const enough = tool && tool.points.length >= fewest(tool.kind);
  const text = noMouse.matches && enough ? "Tap the next corner, or Finish." : drawingLine(tool);
  return (
    <>
      <span class="line">{noMouse.matches ? text.replace("Click", "Tap") : text}</span>
      {tool && tool.points.length > 0 && (
        <span class="strip-buttons">
          <IconButton icon="undo" label="Take back one corner" onClick={() => pressKey("Escape")} />
          <Button disabled={!enough} onClick={finishSketch}>
            Finish
          </Button>
        </span>
      )}
    </>
  );
}

function drawingLine(tool: Sketch | null): string {
  const problems = check.value?.problems.length ?? 0;
  if (tool) return hint(tool);
  if (site.value.boundary.length === 0) return "Draw the boundary first, or open a site.";
  if (problems > 0)
    return `${problems === 1 ? "One thing has" : `${problems} things have`} to be mended before the site can be driven.`;
  return noMouse.matches
    ? "Tap a thing to select it, then drag its corners."
    : "Click a thing to select it, drag its corners. Hold Alt to place freely.";
}

/** What belongs to the place at the moment. */
export function StripLine() {
  const said = notice.value;
  const waits = waiting.value === null ? null : "The robot looks for its place, then it starts";
  const busy = planning.value ?? work.value ?? waits;
  if (busy) {
    return (
      <div class="strip-line" role="status">
        <progress aria-label={busy} />
        <span class="line">{busy}…</span>
      </div>
    );
  }
  // While somebody draws, the next step matters more than the last one.
  if (said && !(said.level === "info" && sketch.value)) {
    return (
      <div
        class={`strip-line notice ${said.level}`}
        role={said.level === "fault" ? "alert" : "status"}
      >
        <span class="line">{said.text}</span>
        <IconButton icon="close" label="Dismiss" onClick={hush} />
      </div>
    );
  }
  return (
    <div class="strip-line">
      <Line />
    </div>
  );
}

function Line() {
  switch (location.value.place) {
    case "draw":
      return <DrawingLine />;
    case "check":
      return (
        <span class="line">
          {plan.value
            ? `Plan ${plan.value.id}: ${duration(plan.value.predicted.duration)}.`
            : "Choose what to do: the plan is shown before a wheel turns."}
        </span>
      );
    case "drive":
      if (simulationTool.value === "person")
        return <span class="line">Click where the person stands.</span>;
      if (simulationTool.value === "lift")
        return <span class="line">Click where the robot is put down, then where it looks to.</span>;
      return stale.value ? (
        <span class="line">The robot cannot be reached. Everything drawn stays.</span>
      ) : (
        <Progress />
      );
    case "prove":
      return run.value ? (
        <TimeSlider />
      ) : (
        <span class="line">Choose a run to see what it did.</span>
      );
    case "setup":
      return <span class="line">Shift+Space stops the robot from any place.</span>;
  }
}

export function TimeStrip() {
  const at = pointer.value;
  return (
    <footer class="strip panel">
      <ScaleBar />
      <StripLine />
      <span class="where number" aria-hidden="true">
        {at ? `${length(at.at[0])}, ${length(at.at[1])}` : ""}
      </span>
    </footer>
  );
}
