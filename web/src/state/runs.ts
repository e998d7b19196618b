/** Prove: the list of runs and the one that is looked at. */

import { computed, effect, signal, untracked } from "@preact/signals";
import * as api from "../api/client";
import type { RunDetail, RunRecord, Track } from "../api/types";
import { multiPolygonArea } from "../core/geometry";
import { asSite, type Site } from "../core/site";
import { location } from "./location";
import { doing } from "./notice";

export const runs = signal<RunRecord[] | null>(null);
export const run = signal<RunDetail | null>(null);
export const track = signal<Track | null>(null);
export const runSite = signal<Site | null>(null);
/** Where the slider stands, seconds of the track's clock. */
export const moment = signal<number | null>(null);
export const playing = signal(false);
export const POINT_KINDS = ["real", "measured", "estimated", "target"] as const;
export const KIND_WORDS: Record<PointKind, string> = {
  real: "Real",
  measured: "Measured",
  estimated: "Estimated",
  target: "Target",
};
export type PointKind = (typeof POINT_KINDS)[number];
export const shown = signal<Record<PointKind, boolean>>({
  real: true,
  measured: true,
  estimated: true,
  target: true,
});

/** Null where it is not known: a run that was interrupted, or still goes on. */
export const missedArea = computed(() => {
  const missed = run.value?.missed;
  return missed ? multiPolygonArea(missed) : null;
});
export const span = computed<[number, number] | null>(() => {
  const t = track.value?.t ?? [];
  return t.length > 1 ? [t[0], t[t.length - 1]] : null;
});

export async function refreshRuns(): Promise<void> {
  runs.value = await api.listRuns().catch(() => runs.value);
}

async function open(id: number): Promise<void> {
  run.value = null;
  track.value = null;
  runSite.value = null;
  moment.value = null;
  playing.value = false;
  await doing("Reading the run", async () => {
    const detail = await api.readRun(id);
    const [positions, record] = await Promise.all([
      api.readTrack(id),
      api.readSiteVersion(detail.site_id, detail.site_version).catch(() => null),
    ]);
    if (location.value.id !== id) return;
    run.value = detail;
    track.value = positions;
    runSite.value = record && asSite(record.site);
    moment.value = span.value?.[1] ?? null;
  });
}

const wanted = computed(() => (location.value.place === "prove" ? location.value.id : null));

effect(() => {
  const id = wanted.value;
  untracked(() => {
    if (id !== null) void open(id);
    else run.value = null;
  });
});

effect(() => {
  if (location.value.place === "prove") untracked(() => void refreshRuns());
});

// Plays ten times as fast as it was driven.
const FASTER = 10;
effect(() => {
  if (!playing.value) return;
  let last = performance.now();
  const timer = setInterval(() => {
    const now = performance.now();
    const range = span.value;
    if (!range || moment.value === null) return;
    const next = moment.value + ((now - last) / 1000) * FASTER;
    last = now;
    moment.value = Math.min(next, range[1]);
    if (next >= range[1]) playing.value = false;
  }, 50);
  return () => clearInterval(timer);
});

export function play(): void {
  const range = span.value;
  if (!range) return;
  if (!playing.value && (moment.value === null || moment.value >= range[1]))
    moment.value = range[0];
  playing.value = !playing.value;
}
