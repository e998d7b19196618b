/** Where the robot was: a trail that grows while it drives, and a recorded run's track. */

import { distance, type Point, wrap } from "./geometry";

/** Consecutive points farther apart are a new fix or a lifted robot, not a drive. */
const JUMP = 0.5;
const CLOSEST = 0.01;
const LONGEST = 20_000;

/** Unbroken stretches, so that a jump draws no line. */
export type Trail = Point[][];

/** Adds a point in place; returns whether anything changed. Thins itself when it gets long. */
export function extend(trail: Trail, point: Point): boolean {
  const stretch = trail[trail.length - 1];
  const last = stretch?.[stretch.length - 1];
  if (!last || distance(last, point) > JUMP) {
    trail.push([point]);
  } else if (distance(last, point) < CLOSEST) {
    return false;
  } else {
    stretch.push(point);
  }
  if (trail.reduce((sum, part) => sum + part.length, 0) > LONGEST) {
    trail.splice(
      0,
      trail.length,
      ...trail.map((part) => part.filter((_, i) => i % 2 === 0 || i === part.length - 1)),
    );
  }
  return true;
}

export function trailOf(points: Iterable<Point>): Trail {
  const trail: Trail = [];
  for (const point of points) extend(trail, point);
  return trail;
}

/** The index of the last time that is not after `t` (times ascend), or -1. */
export function indexAt(times: readonly number[], t: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (times[mid] <= t) low = mid + 1;
    else high = mid;
  }
  return low - 1;
}

export type PoseRow = readonly [number, number, number, ...number[]];

/** The pose at a time between two records, headings turned the short way; null outside. */
export function poseAt(
  times: readonly number[],
  rows: readonly (PoseRow | null)[],
  t: number,
): [number, number, number] | null {
  const i = indexAt(times, t);
  const a = rows[Math.max(0, i)];
  if (!a) return null;
  const b = rows[i + 1];
  if (i < 0 || !b) return [a[0], a[1], a[2]];
  const share = (t - times[i]) / Math.max(1e-9, times[i + 1] - times[i]);
  return [
    a[0] + share * (b[0] - a[0]),
    a[1] + share * (b[1] - a[1]),
    wrap(a[2] + share * wrap(b[2] - a[2])),
  ];
}

/** Distance of real and estimated at each record; null where the truth is not known. */
export function positionErrors(
  real: readonly (PoseRow | null)[],
  estimated: readonly (PoseRow | null)[],
): (number | null)[] {
  return estimated.map((e, i) => {
    const r = real[i];
    return r && e ? Math.hypot(r[0] - e[0], r[1] - e[1]) : null;
  });
}

export function summary(
  values: readonly (number | null)[],
): { mean: number; p95: number; max: number } | null {
  const known = values.filter((v): v is number => v !== null).sort((a, b) => a - b);
  if (known.length === 0) return null;
  return {
    mean: known.reduce((sum, v) => sum + v, 0) / known.length,
    p95: known[Math.min(known.length - 1, Math.floor(0.95 * known.length))],
    max: known[known.length - 1],
  };
}
