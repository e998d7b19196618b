/** The tool in hand and the drawing at hand. */

import { computed, effect, signal, untracked } from "@preact/signals";
import type { Point } from "../core/geometry";
import { added, fewest, type Kind, title } from "../core/site";
import { beginSketch, finish, place, press, type Sketch, type Step } from "../core/sketch";
import { change, save, select, site } from "./draft";
import { location } from "./location";
import { say } from "./notice";

/** Null: select and move. */
export const sketch = signal<Sketch | null>(null);
/** Where the pointer is on the map and what it snaps to. */
export const pointer = signal<{ at: Point; to: string } | null>(null);
export const resolution = signal(0.01);

const NEARBY_PIXELS = 3;
const nearby = () => NEARBY_PIXELS * resolution.value;

export function take(kind: Kind | null): void {
  const old = sketch.value?.kind;
  keepSketch();
  sketch.value = kind === null || old === kind ? null : beginSketch(kind);
}

/** Whether what is drawn so far is a whole thing already. */
export const whole = computed(
  () => sketch.value !== null && sketch.value.points.length >= fewest(sketch.value.kind),
);

/** Whoever goes on without Enter has not meant to lose what is drawn. */
export function keepSketch(): void {
  if (whole.value) finishSketch();
}

/** Saves the site with the drawing at hand. */
export function saveDrawing(): void {
  keepSketch();
  void save();
}

export function moveTo(cursor: Point, snappedTo: string): void {
  if (sketch.value) sketch.value = { ...sketch.value, cursor, snappedTo };
}

function apply(step: Step): void {
  const kind = sketch.value?.kind;
  sketch.value = step.sketch;
  if (!step.done || !kind) return;
  const result = added(site.value, kind, step.done);
  change(result.site);
  // Finished by leaving: a selection would stand in the address of another place.
  if (location.value.place === "draw") select(result.selection);
  say(`${title(result.site, result.selection)} is drawn.`);
  // A second boundary would replace the first: that tool is put away, as is the start's.
  if (kind === "boundary" || kind === "start") sketch.value = null;
}

export function placePoint(): void {
  if (sketch.value) apply(place(sketch.value, nearby()));
}

export function finishSketch(): void {
  if (sketch.value) apply(finish(sketch.value));
}

/** True where the key was for the drawing. */
export function pressKey(key: string): boolean {
  const step = sketch.value && press(sketch.value, key, nearby());
  if (!step) return false;
  apply(step);
  return true;
}

effect(() => {
  if (location.value.place !== "draw") {
    untracked(keepSketch);
    sketch.value = null;
    pointer.value = null;
  }
});
