/** Plane geometry in map metres, x right, y up, angles in radians counter-clockwise. */

export type Point = [number, number];

export const distance = (a: Point, b: Point): number => Math.hypot(b[0] - a[0], b[1] - a[1]);

export const direction = (a: Point, b: Point): number => Math.atan2(b[1] - a[1], b[0] - a[0]);

export const polar = (from: Point, length: number, angle: number): Point => [
  from[0] + length * Math.cos(angle),
  from[1] + length * Math.sin(angle),
];

export const middle = (a: Point, b: Point): Point => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

/** An angle into (-pi, pi]. */
export function wrap(angle: number): number {
  const turned = angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));
  return turned === -Math.PI ? Math.PI : turned;
}

/** Millimetres are exact enough for a drawing and keep documents short. */
export const rounded = (p: Point): Point => [
  Math.round(p[0] * 1000) / 1000,
  Math.round(p[1] * 1000) / 1000,
];

export function nearestOnSegment(p: Point, a: Point, b: Point): Point {
  const dx = b[0] - a[0];
  const dy = b[1] - a[1];
  const square = dx * dx + dy * dy;
  if (square === 0) return a;
  const share = Math.min(1, Math.max(0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square));
  return [a[0] + share * dx, a[1] + share * dy];
}

/** Edges of a polyline, of a ring with the closing one. */
export function edges(points: readonly Point[], closed: boolean): [Point, Point][] {
  const pairs: [Point, Point][] = points.slice(1).map((p, i) => [points[i], p]);
  if (closed && points.length > 2) pairs.push([points[points.length - 1], points[0]]);
  return pairs;
}

export function pathLength(points: readonly Point[], closed = false): number {
  return edges(points, closed).reduce((sum, [a, b]) => sum + distance(a, b), 0);
}

export function ringArea(ring: readonly Point[]): number {
  let twice = 0;
  for (let i = 0, j = ring.length - 1; i < ring.length; j = i++) {
    twice += ring[j][0] * ring[i][1] - ring[i][0] * ring[j][1];
  }
  return Math.abs(twice) / 2;
}

/** The area of MultiPolygon coordinates: outer rings less their holes. */
export function multiPolygonArea(polygons: readonly (readonly (readonly Point[])[])[]): number {
  return polygons.reduce(
    (sum, [outer, ...holes]) =>
      sum + ringArea(outer ?? []) - holes.reduce((inner, hole) => inner + ringArea(hole), 0),
    0,
  );
}

export function insideRing(p: Point, ring: readonly Point[]): boolean {
  let inside = false;
  for (let i = 0, j = ring.length - 1; i < ring.length; j = i++) {
    const [xi, yi] = ring[i];
    const [xj, yj] = ring[j];
    if (yi > p[1] !== yj > p[1] && p[0] < ((xj - xi) * (p[1] - yi)) / (yj - yi) + xi) {
      inside = !inside;
    }
  }
  return inside;
}

/** A place to write a word on a ring: of a few places inside the one farthest from its edges. */
export function ringLabel(ring: readonly Point[]): Point {
  const box = bounds(ring);
  let best: Point | null = null;
  let farthest = 0;
  const steps = 16;
  for (let i = 0; box && i < steps * steps; i++) {
    const across = ((i % steps) + 0.5) / steps;
    const up = (Math.floor(i / steps) + 0.5) / steps;
    const p: Point = [box[0] + across * (box[2] - box[0]), box[1] + up * (box[3] - box[1])];
    if (!insideRing(p, ring)) continue;
    const clear = Math.min(
      ...edges(ring, true).map(([a, b]) => distance(p, nearestOnSegment(p, a, b))),
    );
    if (clear > farthest) {
      farthest = clear;
      best = p;
    }
  }
  return best ?? cornerMean(ring);
}

function cornerMean(ring: readonly Point[]): Point {
  const n = Math.max(1, ring.length);
  return [ring.reduce((sum, p) => sum + p[0], 0) / n, ring.reduce((sum, p) => sum + p[1], 0) / n];
}

export type Bounds = [number, number, number, number];

/** Smallest box around points, or null where there are none. */
export function bounds(points: Iterable<Point>): Bounds | null {
  const box: Bounds = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    if (x < box[0]) box[0] = x;
    if (y < box[1]) box[1] = y;
    if (x > box[2]) box[2] = x;
    if (y > box[3]) box[3] = y;
  }
  return box[0] === Infinity ? null : box;
}

/** Marks along a path every `step` metres (the first after half a step) with their direction. */
export function marksAlong(points: readonly Point[], step: number): { at: Point; angle: number }[] {
  const marks: { at: Point; angle: number }[] = [];
  let ahead = step / 2;
  for (const [a, b] of edges(points, false)) {
    const span = distance(a, b);
    while (ahead <= span && span > 0) {
      const share = ahead / span;
      marks.push({
        at: [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])],
        angle: direction(a, b),
      });
      ahead += step;
    }
    ahead -= span;
  }
  return marks;
}

export interface Ellipse {
  major: number;
  minor: number;
  angle: number;
}

/** Chi-square with two degrees of freedom at 95 %. */
const CHI2_95 = 5.991;

/** The ellipse that holds the position with 95 %; half axes in metres. */
export function ellipse95(xx: number, xy: number, yy: number): Ellipse {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  return {
    major: Math.sqrt(CHI2_95 * Math.max(0, mean + spread)),
    minor: Math.sqrt(CHI2_95 * Math.max(0, mean - spread)),
    angle: 0.5 * Math.atan2(2 * xy, xx - yy),
  };
}
