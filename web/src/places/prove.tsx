/** Prove: what a run did, what it missed, and the next job that comes of it. */

import { runLogAddress } from "../api/client";
import type { RunDetail, RunRecord, Track } from "../api/types";
import { area, clock, counter, duration, fine, length, percent } from "../core/format";
import { positionErrors, summary } from "../core/trail";
import { saved } from "../state/draft";
import { go, location } from "../state/location";
import { planPending } from "../state/plan";
import { mission } from "../state/robot";
import { sites } from "../state/sites";
import {
  KIND_WORDS,
  missedArea,
  moment,
  POINT_KINDS,
  run,
  runs,
  shown,
  track,
} from "../state/runs";
import { Button, Empty, Fact, Facts, Figure, IconButton, Section } from "../ui/controls";
import { ErrorChart } from "./chart";

const OUTCOMES: Record<string, string> = {
  done: "Done",
  ended: "Ended by hand",
  paused: "Ended early",
  timeout: "Ran out of time",
  failed: "Failed",
  interrupted: "Interrupted",
};

const outcomeOf = (record: RunRecord): string =>
  record.outcome === null ? "Running" : (OUTCOMES[record.outcome] ?? record.outcome);

const jobOf = (record: RunRecord): string =>
  record.mode === "scan" ? "Scan" : `Route “${record.route ?? ""}”`;

/** The name of the run's site; one that was deleted has none any more. */
const siteOf = (record: RunRecord): string =>
  sites.value?.find(({ id }) => id === record.site_id)?.name || "a deleted site";

function RunRow({ record, several }: { record: RunRecord; several: boolean }) {
  return (
    <li>
      <button
        type="button"
        class="run-row"
        onClick={() => go({ place: "prove", id: record.id, detail: null })}
      >
        <strong>
          {jobOf(record)}
          {several && `, ${siteOf(record)}`}
        </strong>
        <span class="number quiet">{clock(record.started_at)}</span>
        <span>
          {outcomeOf(record)}
          {record.coverage !== null && `, ${percent(record.coverage)} covered`}
        </span>
        <span class="quiet">
          {length(record.travelled)} in {duration(record.duration)}
        </span>
      </button>
    </li>
  );
}

function RunList() {
  const list = runs.value;
  if (list?.length === 0) {
    return (
      <Empty text="No run yet. A run appears here as soon as it begins.">
        <Button kind="primary" onClick={() => go({ place: "check", id: saved.value?.id ?? null })}>
          Choose a job
        </Button>
      </Empty>
    );
  }
  const several = new Set(list?.map((record) => record.site_id)).size > 1;
  return (
    <ul class="runs" aria-label="Runs">
      {list?.map((record) => (
        <RunRow key={record.id} record={record} several={several} />
      ))}
    </ul>
  );
}

function Toggles({ rows }: { rows: Track }) {
  const simulated = rows.real.some((row) => row !== null);
  return (
    <fieldset class="toggles">
      <legend>Show</legend>
      {POINT_KINDS.filter((kind) => kind !== "real" || simulated).map((kind) => (
        <label key={kind}>
          <input
            type="checkbox"
            checked={shown.value[kind]}
            onChange={(event) => {
              shown.value = { ...shown.value, [kind]: event.currentTarget.checked };
            }}
          />
          <span class={`mark ${kind}`} aria-hidden="true" />
          {KIND_WORDS[kind]}
        </label>
      ))}
    </fieldset>
  );
}

function Errors({ rows }: { rows: Track }) {
  const errors = positionErrors(rows.real, rows.estimated);
  const figures = summary(errors);
  const known = figures !== null;
  const values = known ? errors : rows.estimated.map((row) => row?.[3] ?? null);
  const name = known ? "Distance of estimated from real" : "Standard deviation of the position";
  return (
    <Section title={known ? "Error" : "Uncertainty"}>
      {figures && (
        <Facts>
          <Fact name="Mean">{fine(figures.mean)}</Fact>
          <Fact name="95 %">{fine(figures.p95)}</Fact>
          <Fact name="Largest">{fine(figures.max)}</Fact>
        </Facts>
      )}
      <ErrorChart times={rows.t} values={values} name={name} />
    </Section>
  );
}

function RunEvents({ rows }: { rows: Track }) {
  const first = rows.t[0] ?? 0;
  return (
    <Section title="Events">
      <ol class="events">
        {rows.events.map((event, i) => (
          <li key={i} class={event.level}>
            <button
              type="button"
              class="link"
              onClick={() => {
                moment.value = event.t;
              }}
            >
              <span class="quiet number">{counter(event.t - first)}</span> {event.text}
            </button>
          </li>
        ))}
      </ol>
    </Section>
  );
}

function Missed({ record }: { record: RunDetail }) {
  if (record.mode !== "scan" || record.outcome === null) return null;
  if (missedArea.value !== null && missedArea.value < 0.05)
    return <p>Nothing worth a drive was missed.</p>;
  return (
    <Button
      kind="primary"
      disabled={mission.value !== null}
      title={mission.value === null ? undefined : "A run is going on: end it first."}
      onClick={() => void planPending(record.id, record.site_id)}
    >
      Cover what was missed
      {missedArea.value !== null && <span class="nowrap"> ({area(missedArea.value)})</span>}
    </Button>
  );
}

function Run({ record }: { record: RunDetail }) {
  const rows = track.value;
  return (
    <>
      <div class="row">
        <IconButton icon="back" label="All runs" onClick={() => go({ id: null, detail: null })} />
        <h3>
          {jobOf(record)}, {clock(record.started_at)}
        </h3>
      </div>
      <p>
        {/* "Ended early: ended by hand" would say it twice. */}
        <strong>{(record.outcome === "paused" && record.reason) || outcomeOf(record)}</strong>
        {record.outcome !== "paused" && record.reason && `: ${record.reason}`}
      </p>
      {record.mode === "scan" && (
        <Figure value={percent(record.coverage)} name="of the area covered" />
      )}
      <Missed record={record} />
      <Facts>
        <Fact name="Driven">{length(record.travelled)}</Fact>
        <Fact name="Duration">{duration(record.duration)}</Fact>
        {record.mode === "scan" && <Fact name="Missed">{area(missedArea.value)}</Fact>}
      </Facts>
      {rows && <Toggles rows={rows} />}
      {rows && <Errors rows={rows} />}
      {rows && <RunEvents rows={rows} />}
      <p>
        <a href={runLogAddress(record.id)} download>
          Download the log (MCAP)
        </a>
      </p>
    </>
  );
}

export function Prove() {
  if (location.value.id === null) return <RunList />;
  if (!run.value) return <p class="quiet">Reading the run…</p>;
  return <Run record={run.value} />;
}
