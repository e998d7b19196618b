/** Check: what is asked of the planner, and the plan that came of it. */

import { computed, effect, signal, untracked } from "@preact/signals";
import * as api from "../api/client";
import type { PlanRecord, PlanRequest } from "../api/types";
import { dirty, save, saved, site } from "./draft";
import { go, location } from "./location";
import { doing, sentenceOf } from "./notice";
import { age, snapshot, useSite } from "./robot";

/** The options as typed; null: the robot's own value. */
export const options = signal<{
  tool_width: number | null;
  clearance: number | null;
  min_turn_radius: number | null;
}>({ tool_width: null, clearance: null, min_turn_radius: null });
export const routeName = signal<string | null>(null);
export const plan = signal<PlanRecord | null>(null);
export const planning = signal<string | null>(null);
export const refusal = signal<string | null>(null);
/** The refusal is that the robot stands elsewhere, or looks elsewhere, than the plan begins. */
export const elsewhere = signal(false);
let asking: AbortController | null = null;

/** The route that Track route would take. */
export const chosenRoute = computed(() => {
  const names = site.value.routes.map((route) => route.name);
  return names.find((name) => name === routeName.value) ?? names[0] ?? null;
});

/** The site was saved after this plan was made. */
export const outdated = computed(
  () =>
    plan.value !== null &&
    saved.value?.id === plan.value.site_id &&
    saved.value.version !== plan.value.site_version,
);

async function ask(what: string, request: PlanRequest): Promise<void> {
  planning.value = what;
  plan.value = null;
  refusal.value = null;
  asking = new AbortController();
  try {
    plan.value = await api.makePlan(request, asking.signal);
    go(
      { place: "check", id: plan.value.site_id, detail: String(plan.value.id) },
      location.value.place === "check",
    );
  } catch (error) {
    plan.value = null;
    refusal.value = asking?.signal.aborted ? null : sentenceOf(error);
  } finally {
    planning.value = null;
    asking = null;
  }
}

/** Nobody wants this plan any more; the server gives it up too. */
export function stopPlanning(): void {
  asking?.abort();
}

/** Plans for the site on the table; saves it first, since only saved sites are driven. */
export async function makePlan(mode: "scan" | "route"): Promise<void> {
  if ((dirty.value || saved.value?.id === null) && !(await save())) {
    refusal.value = "The site has to be saved first.";
    return;
  }
  const id = saved.value?.id;
  if (id === null || id === undefined) return;
  const { tool_width, clearance, min_turn_radius } = options.value;
  await ask(mode === "scan" ? "Planning the scan" : "Planning the route", {
    site_id: id,
    mode,
    ...(mode === "route" && chosenRoute.value !== null ? { route: chosenRoute.value } : {}),
    ...(tool_width === null ? {} : { tool_width }),
    ...(clearance === null ? {} : { clearance }),
    ...(min_turn_radius === null ? {} : { min_turn_radius }),
  });
}

/** What a run left uncovered becomes the next plan. */
export async function planPending(runId: number, siteId: number): Promise<void> {
  go({ place: "check", id: siteId, detail: null });
  await ask("Planning what was missed", { site_id: siteId, mode: "scan", pending_of: runId });
}

/** The same job once more, from where the robot is now. */
export async function planAgain(): Promise<void> {
  const old = plan.value;
  if (!old) return;
  const { site_id, mode, route, tool_width, clearance, min_turn_radius, pending_of } = old;
  await ask("Planning again", {
    site_id,
    mode,
    tool_width,
    clearance,
    min_turn_radius,
    ...(route === null ? {} : { route }),
    ...(pending_of === null ? {} : { pending_of }),
  });
}

/** The plan that starts as soon as the robot knows its place; null: none waits. */
export const waiting = signal<number | null>(null);

/** With fewer the robot cannot find its place. */
const LEAST_LANDMARKS = 2;
/** Longer than this nobody waits who pressed a button. */
const LONGEST_WAIT = 45_000;
/** A robot that is silent for so many seconds does not start when it comes back. */
const LONGEST_SILENCE = 5;
let patience: ReturnType<typeof setTimeout> | undefined;

/**
 * Starts the plan at hand and goes to Drive. A robot that works on another site loads this one
 * first; one that still looks for its place starts when it has found it.
 */
export async function start(): Promise<void> {
  const record = plan.value;
  if (!record) return;
  refusal.value = null;
  elsewhere.value = false;
  const landmarks = site.value.landmarks.length;
  if (landmarks < LEAST_LANDMARKS) {
    // The robot would look for its place and never find it.
    refusal.value = `The site has ${landmarks === 1 ? "one landmark" : "no landmark"}, and the robot needs at least two to know where it is. Place more under Draw.`;
    return;
  }
  if (snapshot.value && snapshot.value.site_id !== record.site_id) {
    if (!(await useSite(record.site_id))) return;
  } else if (snapshot.value?.state !== "fixing") {
    await startNow(record.id);
    return;
  }
  waiting.value = record.id;
  clearTimeout(patience);
  patience = setTimeout(() => {
    if (waiting.value === null) return;
    refusal.value = `Not started: ${snapshot.value?.reason || "the robot has not found its place."}`;
    waiting.value = null;
  }, LONGEST_WAIT);
}

export function stopWaiting(): void {
  waiting.value = null;
}

async function startNow(id: number): Promise<void> {
  try {
    await api.startMission(id);
    go({ place: "drive" });
  } catch (error) {
    elsewhere.value = error instanceof api.ApiError && error.code === "elsewhere";
    refusal.value = sentenceOf(error);
  }
}

// Nothing starts behind anybody's back: it waits only while this plan is looked at.
effect(() => {
  const id = waiting.value;
  if (id === null) return;
  const now = snapshot.value;
  const looked = location.value.place === "check" && plan.value?.id === id;
  const silent = age.value === null || age.value > LONGEST_SILENCE;
  if (!looked) {
    waiting.value = null;
  } else if (silent || now?.state === "stopped") {
    waiting.value = null;
    refusal.value = silent
      ? "Not started: the robot cannot be reached."
      : "Not started: the robot was stopped.";
  } else if (now?.state === "ready" && now.site_id === plan.value?.site_id) {
    waiting.value = null;
    untracked(() => void startNow(id));
  }
});

export const startLabel = computed(() => {
  const record = plan.value;
  if (!record) return "";
  if (record.pending_of !== null) return "Cover what was missed";
  return record.mode === "scan" ? "Scan this area" : `Track route “${record.route ?? ""}”`;
});

// The address names the plan: a reload or Back brings it again.
effect(() => {
  const { place, detail } = location.value;
  const wanted = place === "check" && detail !== null ? Number(detail) : null;
  if (wanted === null || !Number.isFinite(wanted) || plan.peek()?.id === wanted) return;
  untracked(() => {
    void doing("Reading the plan", () => api.readPlan(wanted)).then((record) => {
      if (record) plan.value = record;
    });
  });
});

// A plan belongs to its site.
effect(() => {
  const id = saved.value?.id ?? null;
  if (plan.peek() && plan.peek()?.site_id !== id) plan.value = null;
  refusal.value = null;
});
