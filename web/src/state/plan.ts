/** Check: what is asked of the planner, and the plan that came of it. */

import { computed, effect, signal, untracked } from "@preact/signals";
import * as api from "../api/client";
import type { PlanRecord, PlanRequest } from "../api/types";
import { dirty, save, saved, site } from "./draft";
import { go, location } from "./location";
import { doing, say, sentenceOf } from "./notice";
import { snapshot, useSite } from "./robot";

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
  refusal.value = null;
  try {
    plan.value = await api.makePlan(request);
    go(
      { place: "check", id: plan.value.site_id, detail: String(plan.value.id) },
      location.value.place === "check",
    );
  } catch (error) {
    plan.value = null;
    refusal.value = sentenceOf(error);
  } finally {
    planning.value = null;
  }
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

/** Starts the plan at hand and goes to Drive. Loads its site on the robot where that is another. */
export async function start(): Promise<void> {
  const record = plan.value;
  if (!record) return;
  if (snapshot.value && snapshot.value.site_id !== record.site_id) {
    if (await useSite(record.site_id)) {
      say("The robot works on this site now and looks for its place. Start once it is ready.");
    }
    return;
  }
  refusal.value = null;
  try {
    await api.startMission(record.id);
    go({ place: "drive" });
  } catch (error) {
    refusal.value = sentenceOf(error);
  }
}

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
