/** How well the robot would know its place on the drawing at hand, and where landmarks would help. */

import { computed, effect, signal, untracked } from "@preact/signals";
import * as api from "../api/client";
import type { PrecisionRecord, Suggestions } from "../api/types";
import { added, inWords, type Site } from "../core/site";
import { change, saved, select, site } from "./draft";
import { pointer } from "./editor";
import { location } from "./location";
import { sentenceOf } from "./notice";
import { stored, storeText } from "./storage";
import { cellAt } from "../core/precision";

const KEY = "polepilot.precision";

/** Whether the drawing is coloured by it. */
export const wanted = signal(stored<boolean>(KEY) === true);
export const precision = signal<PrecisionRecord | null>(null);
/** Why there is no map. */
export const trouble = signal<string | null>(null);
/** True while a map is on its way. */
export const asking = signal(false);

export const suggestions = signal<Suggestions | null>(null);
export const suggesting = signal(false);
export const suggestTrouble = signal<string | null>(null);
export const howMany = signal(3);
/** How many were asked for when the suggestions were made. */
export const proposed = signal(0);

/** The map, where it belongs on the screen. */
export const shownPrecision = computed(() =>
  wanted.value && location.value.place === "draw" && saved.value ? precision.value : null,
);

/** What the map says where the pointer is. */
export const here = computed(() => {
  const map = shownPrecision.value;
  const cell = map && pointer.value && cellAt(map, pointer.value.at);
  if (!map || !cell) return null;
  const { row, column } = cell;
  return {
    position: map.position[row][column],
    heading: map.heading[row][column],
    seen: map.seen[row][column],
    reason: map.reason[row][column],
  };
});

export function toggle(): void {
  wanted.value = !wanted.value;
  storeText(KEY, wanted.value ? "true" : null);
}

/** Whether two drawings look the same to the camera. */
const sameView = (a: Site, b: Site): boolean =>
  a.boundary === b.boundary &&
  a.islands === b.islands &&
  a.walls === b.walls &&
  a.no_go === b.no_go &&
  a.landmarks === b.landmarks;

let next: Site | null = null;
let answered: Site | null = null;

/** One request at a time, always for the newest drawing: so it follows the finger. */
async function follow(): Promise<void> {
  if (asking.value) return;
  asking.value = true;
  while (next) {
    const asked = next;
    next = null;
    try {
      precision.value = await api.drawnPrecision(asked);
      trouble.value = null;
    } catch (error) {
      precision.value = null;
      trouble.value = inWords(sentenceOf(error), asked);
    }
    answered = asked;
  }
  asking.value = false;
}

effect(() => {
  const drawn = site.value;
  if (!wanted.value || location.value.place !== "draw" || !saved.value) return;
  untracked(() => {
    if (drawn.boundary.length < 3) {
      precision.value = null;
      answered = null;
      return;
    }
    if (answered && !next && sameView(answered, drawn) && !asking.value) return;
    next = drawn;
    void follow();
  });
});

let proposedFor: Site | null = null;

// What was proposed for another drawing says nothing about this one.
effect(() => {
  const drawn = site.value;
  if (proposedFor && !sameView(proposedFor, drawn)) untracked(dropSuggestions);
});

export function dropSuggestions(): void {
  proposedFor = null;
  suggestions.value = null;
  suggestTrouble.value = null;
}

export async function suggestPlaces(): Promise<void> {
  const asked = site.value;
  suggesting.value = true;
  dropSuggestions();
  try {
    const answer = await api.drawnPrecision(asked, howMany.value);
    if (sameView(asked, site.value) && answer.suggest) {
      proposedFor = asked;
      proposed.value = answer.suggest.suggestions.length;
      suggestions.value = answer.suggest;
    }
  } catch (error) {
    suggestTrouble.value = inWords(sentenceOf(error), asked);
  } finally {
    suggesting.value = false;
  }
}

/** Puts suggested landmarks up; the other proposals stay. */
export function accept(indices: readonly number[]): void {
  const found = suggestions.value;
  if (!found) return;
  let drawn = site.value;
  let last = null;
  for (const index of indices) {
    const { x, y } = found.suggestions[index];
    const result = added(drawn, "landmark", [[x, y]]);
    drawn = result.site;
    last = result.selection;
  }
  const rest = found.suggestions.filter((_, i) => !indices.includes(i));
  proposedFor = rest.length > 0 ? drawn : null;
  suggestions.value = rest.length > 0 ? { ...found, suggestions: rest } : null;
  change(drawn);
  if (indices.length === 1) select(last);
}
