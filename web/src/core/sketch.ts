/** A drawing at hand: placed points, the pointer, and what is being typed. Pure. */

import { direction, distance, type Point, polar, rounded } from "./geometry";
import { fewest, isRing, type Kind } from "./site";

export interface Sketch {
  kind: Kind;
  points: readonly Point[];
  cursor: Point | null;
  snappedTo: string;
  /** Typed text of the current edge; empty where the pointer decides. */
  length: string;
  angle: string;
  field: "length" | "angle";
}

export const beginSketch = (kind: Kind): Sketch => ({
  kind,
  points: [],
  cursor: null,
  snappedTo: "",
  length: "",
  angle: "",
  field: "length",
});

/** How many points end the drawing by themselves; null: Enter or double-click does. */
const complete = (kind: Kind): number | null =>
  kind === "landmark" ? 1 : kind === "start" ? 2 : null;

export const typing = (sketch: Sketch): boolean => sketch.length !== "" || sketch.angle !== "";

/** Where the next point would go: the pointer, bent to the length and angle that were typed. */
export function next(sketch: Sketch): Point | null {
  const last = sketch.points[sketch.points.length - 1];
  if (!last || !sketch.cursor) return sketch.cursor;
  const length = number(sketch.length);
  const angle = number(sketch.angle);
  if (length === null && angle === null) return sketch.cursor;
  const towards = angle === null ? direction(last, sketch.cursor) : (angle * Math.PI) / 180;
  const far = length ?? distance(last, sketch.cursor);
  return rounded(polar(last, far, towards));
}

export interface Step {
  sketch: Sketch | null;
  /** The finished points, where this step ended the drawing. */
  done: Point[] | null;
}

/** Places a point (the pointer's, or the typed one). A point on the last one adds nothing. */
export function place(sketch: Sketch, nearby: number): Step {
  const point = next(sketch);
  if (!point) return { sketch, done: null };
  const { points } = sketch;
  const last = points[points.length - 1];
  if (last && distance(last, point) <= nearby) return { sketch, done: null };
  if (isRing(sketch.kind) && points.length > 2 && distance(points[0], point) <= nearby) {
    return finish(sketch);
  }
  const placed: Sketch = {
    ...sketch,
    points: [...points, rounded(point)],
    length: "",
    angle: "",
    field: "length",
  };
  return placed.points.length === complete(sketch.kind)
    ? finish(placed)
    : { sketch: placed, done: null };
}

/** Ends the drawing if it has enough points; else it stays as it is. */
export function finish(sketch: Sketch): Step {
  if (sketch.points.length < fewest(sketch.kind)) return { sketch, done: null };
  return { sketch: beginSketch(sketch.kind), done: [...sketch.points] };
}

/** Takes the last point back. Null: there was none, the tool itself is put away. */
export function stepBack(sketch: Sketch): Sketch | null {
  if (typing(sketch)) return { ...sketch, length: "", angle: "", field: "length" };
  if (sketch.points.length === 0) return null;
  return { ...sketch, points: sketch.points.slice(0, -1) };
}

/** What a key does to a drawing; null where the key means nothing to it. */
export function press(sketch: Sketch, key: string, nearby: number): Step | null {
  if (key === "Escape") return { sketch: stepBack(sketch), done: null };
  if (key === "Enter") return typing(sketch) ? place(sketch, nearby) : finish(sketch);
  if (key === "Backspace" && !typing(sketch)) {
    return sketch.points.length > 0 ? { sketch: stepBack(sketch), done: null } : null;
  }
  if (sketch.points.length === 0) return null;
  if (key === "Tab") {
    return {
      sketch: { ...sketch, field: sketch.field === "length" ? "angle" : "length" },
      done: null,
    };
  }
  const text = sketch[sketch.field];
  if (key === "Backspace") {
    return { sketch: { ...sketch, [sketch.field]: text.slice(0, -1) }, done: null };
  }
  const legal = sketch.field === "length" ? /^[0-9.,]$/ : /^[0-9.,-]$/;
  if (!legal.test(key)) return null;
  return { sketch: { ...sketch, [sketch.field]: text + key.replace(",", ".") }, done: null };
}

/** What to do next, in one line. */
export function hint(sketch: Sketch): string {
  const n = sketch.points.length;
  if (sketch.kind === "landmark") return "Click where the pole stands.";
  if (sketch.kind === "start") {
    return n === 0
      ? "Click where the robot stands."
      : "Click where it looks to. Enter: heading not known.";
  }
  if (n === 0) return "Click to place the first corner.";
  if (n < fewest(sketch.kind))
    return "Click the next corner, or type a length in metres. Tab: angle.";
  return "Enter or double-click ends, Escape takes the last corner back.";
}

function number(text: string): number | null {
  if (text === "" || text === "-" || text === ".") return null;
  const value = Number(text);
  return Number.isFinite(value) ? value : null;
}
