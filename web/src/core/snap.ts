/** Where a pointer snaps to, and in words to what. */

import { distance, edges, nearestOnSegment, type Point } from "./geometry";
import { isRing, type Selection, type Site, shapes, title, vertices } from "./site";

export interface Snap {
  point: Point;
  /** What it snapped to, for the eye: "corner of Wall 1". Empty where it did not. */
  to: string;
}

export interface SnapOptions {
  /** Metres per screen pixel. */
  resolution: number;
  /** Points of the drawing at hand; its first one closes a ring. */
  sketch?: readonly Point[];
  closes?: boolean;
  /** What is being moved does not snap to itself. */
  except?: Selection | null;
}

const CORNER_PIXELS = 10;
const EDGE_PIXELS = 8;
const GRID_PIXELS = 6;
const STEPS = [0.05, 0.1, 0.25, 0.5, 1, 5, 10];

/** The finest grid whose lines stand at least 10 pixels apart. */
export function gridStep(resolution: number): number {
  return STEPS.find((step) => step / resolution >= 10) ?? STEPS[STEPS.length - 1];
}

export function snap(site: Site, at: Point, options: SnapOptions): Snap {
  const { resolution, sketch = [], closes = false, except = null } = options;
  const reach = CORNER_PIXELS * resolution;
  if (closes && sketch.length > 2 && distance(at, sketch[0]) <= reach) {
    return { point: sketch[0], to: "first corner: closes the shape" };
  }
  const things = shapes(site).filter(
    (thing) => !(except && thing.kind === except.kind && thing.index === except.index),
  );
  let best: Snap | null = null;
  let nearest = reach;
  for (const thing of things) {
    for (const corner of vertices(site, thing)) {
      if (distance(at, corner) <= nearest) {
        nearest = distance(at, corner);
        best = { point: corner, to: cornerName(site, thing) };
      }
    }
  }
  if (best) return best;
  const step = gridStep(resolution);
  const onGrid: Point = [round(at[0], step), round(at[1], step)];
  nearest = EDGE_PIXELS * resolution;
  for (const thing of things) {
    for (const [a, b] of edges(vertices(site, thing), isRing(thing.kind))) {
      const foot = nearestOnSegment(at, a, b);
      if (distance(at, foot) > nearest) continue;
      nearest = distance(at, foot);
      // A grid point that lies on the edge is the rounder place of the two.
      const round = nearestOnSegment(onGrid, a, b);
      const exact =
        distance(round, onGrid) < 1e-9 && distance(round, at) <= 2 * GRID_PIXELS * resolution;
      best = { point: exact ? onGrid : foot, to: `edge of ${title(site, thing)}` };
    }
  }
  if (best) return best;
  if (distance(at, onGrid) <= GRID_PIXELS * resolution * Math.SQRT2) {
    return { point: onGrid, to: `grid ${step < 1 ? `${Math.round(step * 100)} cm` : `${step} m`}` };
  }
  return { point: at, to: "" };
}

function cornerName(site: Site, thing: Selection): string {
  const name = title(site, thing);
  return thing.kind === "landmark" || thing.kind === "start" ? name : `corner of ${name}`;
}

function round(value: number, step: number): number {
  return Math.round(Math.round(value / step) * step * 1000) / 1000;
}
