/** Drive: where it is, whether it is safe, whether it is getting done. */

import type { EventModel, RobotState, Snapshot } from "../api/types";
import {
  age as ageText,
  area,
  clock,
  degrees,
  duration,
  fine,
  length,
  percent,
  speed,
  UNKNOWN,
  volts,
} from "../core/format";
import { saved } from "../state/draft";
import { go } from "../state/location";
import {
  about,
  age,
  end,
  mission,
  missionPlan,
  removePeople,
  STATE_WORDS,
  simulationTool,
  snapshot,
  stale,
} from "../state/robot";
import { KIND_WORDS, POINT_KINDS } from "../state/runs";
import { Button, Empty, Fact, Facts, Figure, Section } from "../ui/controls";
import { CameraPicture } from "./camera";

function Mission({ now }: { now: Snapshot }) {
  const job = now.mission;
  if (!job) return null;
  const scan = job.mode === "scan";
  return (
    <>
      <Figure
        value={percent(scan ? (job.coverage ?? job.progress) : job.progress)}
        name={scan ? "of the area covered" : `of the route “${job.route ?? ""}” driven`}
      />
      {job.pausing_reason && job.pausing_reason !== now.reason && (
        <p class="hint">{job.pausing_reason}</p>
      )}
      <Facts>
        <Fact name="Driven">
          {length(job.travelled)} of {length(job.length)}
        </Fact>
        <Fact name="Time">
          {duration(job.elapsed)}
          {job.eta !== null && `, ${duration(job.eta)} left`}
        </Fact>
        {scan && <Fact name="Swept">{area(job.swept_area)}</Fact>}
        {scan && <Fact name="Still open">{area(job.missed_area)}</Fact>}
        {missionPlan.value && (
          <Fact name="Predicted">{duration(missionPlan.value.predicted.duration)}</Fact>
        )}
      </Facts>
    </>
  );
}

/** The age of a value that was stamped on the robot's clock. */
function ageOf(now: Snapshot, stamp: number | null | undefined): string {
  if (stamp === null || stamp === undefined) return "";
  return ageText(now.stamp - stamp + (age.value ?? 0));
}

/** What a proximity sensor says; where it sees nothing it reads its range. */
function near(reading: number | null): string {
  const longest = about.value?.model.proximity.max_range ?? Infinity;
  return reading !== null && reading >= longest ? `> ${length(longest)}` : length(reading);
}

/** What the marks on the map are. */
function Legend({ now }: { now: Snapshot }) {
  return (
    <ul class="legend" aria-label="Marks on the map">
      {POINT_KINDS.filter((kind) => kind !== "real" || now.real !== null).map((kind) => (
        <li key={kind}>
          <span class={`mark ${kind}`} aria-hidden="true" />
          {KIND_WORDS[kind]}
        </li>
      ))}
    </ul>
  );
}

function Pose({ now }: { now: Snapshot }) {
  const { pose, real } = now;
  const apart = pose && real ? Math.hypot(pose.x - real.x, pose.y - real.y) : null;
  return (
    <Section title="Position">
      <Facts>
        <Fact name="Estimated" age={ageOf(now, pose?.stamp)}>
          {pose ? `${length(pose.x)}, ${length(pose.y)}` : UNKNOWN}
        </Fact>
        <Fact name="Heading">{degrees(pose?.heading)}</Fact>
        <Fact name="Uncertain by">
          {pose ? `${fine(pose.position_sigma)}, ${degrees(pose.heading_sigma, 1)}` : "–"}
        </Fact>
        {real && <Fact name="Real error">{fine(apart)}</Fact>}
        <Fact name="Speed">{speed(now.command.speed)}</Fact>
        <Fact name="Sees" age={ageOf(now, now.detections_stamp)}>
          {now.detections.length > 0
            ? now.detections.map((d) => `${d.id} (${length(d.range)})`).join(", ")
            : "–"}
        </Fact>
        <Fact name="Near">{now.proximity.map(near).join(" · ")}</Fact>
        <Fact name="Battery">{volts(now.battery)}</Fact>
      </Facts>
    </Section>
  );
}

function Events({ now }: { now: Snapshot }) {
  const wallOf = (event: EventModel) => now.wall - (now.stamp - event.stamp);
  const newest = [...now.events].reverse();
  return (
    <Section title="Events">
      {newest.length === 0 && <p class="quiet">Nothing has happened yet.</p>}
      <ol class="events">
        {newest.map((event) => (
          <li key={event.seq} class={event.level}>
            <time class="quiet number">{clock(wallOf(event))}</time> {event.text}
          </li>
        ))}
      </ol>
    </Section>
  );
}

function Simulation({ now }: { now: Snapshot }) {
  if (!about.value?.simulated) return null;
  const use = (tool: "person" | "lift") => {
    simulationTool.value = simulationTool.value === tool ? null : tool;
  };
  return (
    <Section title="Simulation" open={false}>
      <div class="buttons">
        <Button pressed={simulationTool.value === "person"} onClick={() => use("person")}>
          Put a person in the way
        </Button>
        {now.obstacles.length > 0 && <Button onClick={removePeople}>Remove people</Button>}
        <Button pressed={simulationTool.value === "lift"} onClick={() => use("lift")}>
          Lift the robot
        </Button>
      </div>
    </Section>
  );
}

/** What there is to say where the robot gives no reason. */
const CALM_WORDS: Partial<Record<RobotState, string>> = {
  ready: "It knows its place and waits for a job.",
  running: "On its way.",
};

export function Drive() {
  const now = snapshot.value;
  if (!now) {
    return (
      <Empty text="No word from the robot yet. Look whether its service runs; this page tries again by itself." />
    );
  }
  return (
    <div class={stale.value ? "dimmed" : ""}>
      <div class="row">
        <h3>{STATE_WORDS[now.state]}</h3>
        {mission.value && <Button onClick={end}>End run</Button>}
      </div>
      {/* While it drives, the reason comes and goes: its place is kept, so that nothing moves. */}
      <p class={`state-line ${now.state === "running" ? "" : "whole"}`} title={now.reason}>
        {now.reason || CALM_WORDS[now.state]}
      </p>
      {stale.value && (
        <p class="hint">
          Last news {duration(age.value)} ago. The robot stops by itself when it loses its program.
        </p>
      )}
      {now.state === "stopped" && (
        <p class="hint">
          Look whether the way is free, then Release stop{mission.value ? ", then Resume" : ""}.
        </p>
      )}
      {now.state === "idle" && (
        <Empty text="The robot has no site yet.">
          <Button onClick={() => go({ place: "draw", id: saved.value?.id ?? null })}>
            Choose a site
          </Button>
        </Empty>
      )}
      <Mission now={now} />
      <CameraPicture />
      <Legend now={now} />
      <Pose now={now} />
      <Simulation now={now} />
      <Events now={now} />
      <p>
        <a href="/viser/" target="_blank" rel="noopener">
          Open the 3D panel
        </a>
      </p>
    </div>
  );
}
