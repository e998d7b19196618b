/**
 * The site that is being drawn: its saved version, its unsaved changes, undo, live check, saving.
 *
 * Nothing but the person at the page changes it; what is not saved is kept in the browser until it
 * is. The live stream never touches it.
 */

import { computed, effect, signal } from "@preact/signals";
import * as api from "../api/client";
import type { SiteCheck, SiteRecord } from "../api/types";
import * as history from "../core/history";
import {
  asSite,
  emptySite,
  exists,
  inWords,
  removed,
  type Selection,
  type Site,
} from "../core/site";
import { formatSelection, NEW_ID, parseSelection } from "../core/address";
import { go, location } from "./location";
import { doing, say, sentenceOf } from "./notice";
import { readRobotSite } from "./robot";
import { refreshSites, sites } from "./sites";
import { stored, storedKeys, storeText } from "./storage";

interface Saved {
  id: number | null;
  /** Under which name the browser keeps what is not saved. */
  key: string;
  version: number | null;
  site: Site;
}

interface KeptDraft {
  version: number | null;
  site: Site;
}

/** What the server has of it; `id` is null for a site that was never saved. */
export const saved = signal<Saved | null>(null);
const steps = signal<history.History<Site>>(history.begin(emptySite("")));

export const site = computed(() => steps.value.present);
export const dirty = computed(
  () => saved.value !== null && steps.value.present !== saved.value.site,
);
export const canUndo = computed(() => steps.value.past.length > 0);
export const canRedo = computed(() => steps.value.future.length > 0);
export const saving = signal(false);
export const check = signal<SiteCheck | null>(null);
/** The other version, where saving met one: somebody else saved meanwhile. */
export const conflict = signal<SiteRecord | null>(null);
/** Counts up when another site is on the table: the map then shows all of it. */
export const opened = signal(0);

export const selection = computed<Selection | null>(() => {
  if (location.value.place !== "draw") return null;
  const at = parseSelection(location.value.detail);
  return at && exists(site.value, at) ? at : null;
});

export function select(at: Selection | null): void {
  const detail = at && formatSelection(at);
  if (detail === location.value.detail) return;
  go({ detail }, location.value.detail !== null && detail !== null);
}

const PREFIX = "polepilot.draft.";
const NEW = `${PREFIX}new-`;
const keyOf = (id: number) => `${PREFIX}${id}`;

function put(next: history.History<Site>): void {
  steps.value = next;
}

export const change = (next: Site): void => put(history.record(steps.value, next));

/** During a drag: `from` is what it looked like before; the whole drag becomes one step. */
export const drag = (next: Site): void => put(history.amend(steps.value, next));

export function endDrag(from: Site): void {
  const to = steps.value.present;
  put(history.record(history.amend(steps.value, from), to));
}

export const undo = (): void => put(history.undo(steps.value));
export const redo = (): void => put(history.redo(steps.value));

export function removeSelected(): void {
  const at = selection.value;
  if (!at) return;
  change(removed(site.value, at));
  select(at.vertex === undefined ? null : { kind: at.kind, index: at.index });
}

function lay(record: Saved): void {
  const kept = stored<KeptDraft>(record.key);
  saved.value = record;
  check.value = null;
  conflict.value = null;
  put(history.begin(record.site));
  if (kept && JSON.stringify(kept.site) !== JSON.stringify(record.site)) {
    // The kept draft was made of an older version: saving it has to meet the conflict.
    saved.value = { ...record, version: kept.version };
    put(history.record(steps.value, { ...emptySite(kept.site.name), ...kept.site }));
    say("Your unsaved changes are back. Save keeps them, Undo drops them.");
  }
  opened.value += 1;
}

const fromRecord = (record: SiteRecord): Saved => ({
  id: record.id,
  key: keyOf(record.id),
  version: record.version,
  site: asSite(record.site),
});

export async function openSite(id: number): Promise<void> {
  if (saved.value?.id === id) return;
  const record = await doing("Opening the site", () => api.readSite(id));
  if (record) lay(fromRecord(record));
}

/** "Site 2": a name that no other site has, kept or not. */
function freeName(): string {
  const taken = new Set([
    ...(sites.peek() ?? []).map((summary) => summary.name),
    ...unsavedSites().map(({ name }) => name),
  ]);
  let n = 1;
  while (taken.has(`Site ${n}`)) n += 1;
  return `Site ${n}`;
}

/** Begins a site; one that was begun before and never saved stays in the list. */
export function newSite(from: Site = emptySite(freeName())): void {
  let n = 1;
  while (stored(`${NEW}${n}`)) n += 1;
  lay({ id: null, key: `${NEW}${n}`, version: null, site: emptySite(from.name) });
  if (from.boundary.length > 0) {
    change(from);
    opened.value += 1;
  }
  go({ place: "draw", id: NEW_ID, detail: null });
}

/** Sites that exist in this browser only. */
export function unsavedSites(): { key: string; name: string }[] {
  void site.value;
  return storedKeys(NEW).map((key) => ({
    key,
    name: stored<KeptDraft>(key)?.site.name || "Unnamed",
  }));
}

export function openUnsaved(key: string): void {
  const kept = stored<KeptDraft>(key);
  if (!kept) return;
  lay({ id: null, key, version: null, site: emptySite(kept.site.name) });
  const { place, id } = location.value;
  if (place !== "draw" || id !== NEW_ID) go({ place: "draw", id: NEW_ID, detail: null });
}

export function dropUnsaved(key: string): void {
  storeText(key, null);
  if (saved.value?.key === key) newSite();
}

function settle(record: SiteRecord, sent: Site): void {
  const known = asSite(record.site);
  if (saved.value) storeText(saved.value.key, null);
  // The server may have mended the drawing. What was drawn while it answered stays.
  const still = steps.value.present === sent;
  saved.value = { ...fromRecord(record), site: still ? known : sent };
  if (still) put(history.amend(steps.value, known));
  conflict.value = null;
  const { place, id } = location.value;
  if ((place === "draw" || place === "check") && id !== record.id) go({ id: record.id }, true);
  say(record.repairs.length > 0 ? `Saved. ${record.repairs.join(" ")}` : "Saved.");
  void refreshSites();
  void readRobotSite();
}

/** Saves; true where the server has it now. */
export async function save(): Promise<boolean> {
  const base = saved.value;
  if (!base || saving.value) return false;
  const sent = site.value;
  saving.value = true;
  try {
    const record =
      base.id === null || base.version === null
        ? await api.createSite(sent)
        : await api.saveSite(base.id, base.version, sent);
    settle(record, sent);
    return true;
  } catch (error) {
    if (error instanceof api.ApiError && error.status === 412 && base.id !== null) {
      conflict.value = await doing("Reading the other version", () => api.readSite(base.id!));
      void refreshSites();
    } else {
      say(`Not saved. ${inWords(sentenceOf(error), sent)}`, "fault");
    }
    return false;
  } finally {
    saving.value = false;
  }
}

/** Conflict: what is drawn here becomes a site of its own. */
export async function keepMineAsCopy(): Promise<void> {
  const mine = { ...site.value, name: `${site.value.name} (copy)` };
  const record = await doing("Saving your copy", () => api.createSite(mine));
  if (!record) return;
  if (saved.value) storeText(saved.value.key, null);
  conflict.value = null;
  lay(fromRecord(record));
  go({ place: "draw", id: record.id, detail: null });
  say(`Saved as “${record.name}”. The other version is unchanged.`);
  void refreshSites();
}

/** Conflict: the other version is taken; one Undo brings back what was drawn here. */
export function takeTheirs(): void {
  const theirs = conflict.value;
  if (!theirs) return;
  storeText(keyOf(theirs.id), null);
  const record = fromRecord(theirs);
  saved.value = record;
  put(history.record(steps.value, record.site));
  conflict.value = null;
  say("The other version is on the table. Undo brings yours back.");
}

export function discardChanges(): void {
  const base = saved.value;
  if (!base) return;
  put(history.record(steps.value, base.site));
  storeText(base.key, null);
}

// Unsaved changes outlive the page.
effect(() => {
  const base = saved.value;
  if (!base) return;
  const kept: KeptDraft = { version: base.version, site: site.value };
  storeText(base.key, dirty.value ? JSON.stringify(kept) : null);
});

// Live check: a moment after the last change.
let timer: ReturnType<typeof setTimeout> | undefined;
let asked = 0;
effect(() => {
  const drawn = site.value;
  clearTimeout(timer);
  if (drawn.boundary.length === 0) {
    check.value = null;
    return;
  }
  timer = setTimeout(async () => {
    const turn = ++asked;
    const answer = await api.checkSite(drawn).catch(() => null);
    if (turn !== asked || !answer) return;
    const problems = answer.problems.map((problem) => ({
      ...problem,
      message: inWords(problem.message, drawn),
    }));
    check.value = { ...answer, problems };
  }, 300);
});

window.addEventListener("beforeunload", (event) => {
  // Kept in the browser anyway; ask only where it keeps nothing.
  if (dirty.value && !stored(saved.value?.key ?? "")) event.preventDefault();
});
