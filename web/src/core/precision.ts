/** The precision map as the page draws it: which colour a cell has, and in words. */

import type { PrecisionRecord } from "../api/types";
import type { Point } from "./geometry";

export type Grid = Pick<
  PrecisionRecord,
  "x" | "y" | "resolution" | "columns" | "rows" | "position" | "share" | "reason" | "classes"
>;

/** Neighbouring cells of one row that look alike. */
export interface Run {
  row: number;
  first: number;
  /** One past the last. */
  end: number;
  /** Which colour; null: no fix here. */
  shade: number | null;
  /** A fix, but in less than half of the directions that the robot may look. */
  doubtful: boolean;
}

const OUTSIDE = 4;
const WHY = [
  "",
  "no fix: no landmark in sight",
  "no fix: one landmark in sight",
  "no fix: all in one direction",
];

/** Which of the classes an error (metres) falls into. */
export const shadeOf = (sigma: number, classes: readonly number[]): number =>
  classes.filter((edge) => sigma > edge).length;

/** The cells of the floor, row by row, those that look alike in one piece. */
export function runsOf(grid: Grid): Run[] {
  const runs: Run[] = [];
  for (let row = 0; row < grid.rows; row++) {
    let last: Run | null = null;
    for (let column = 0; column < grid.columns; column++) {
      if (grid.reason[row][column] === OUTSIDE) {
        last = null;
        continue;
      }
      const sigma = grid.position[row][column];
      const shade = sigma === null ? null : shadeOf(sigma, grid.classes);
      const doubtful = shade !== null && (grid.share[row][column] ?? 0) < 0.5;
      if (last && last.shade === shade && last.doubtful === doubtful) last.end = column + 1;
      else {
        last = { row, first: column, end: column + 1, shade, doubtful };
        runs.push(last);
      }
    }
  }
  return runs;
}

/** What the colours stand for, in centimetres; `limit` is the vaguest fix there is. */
export function classNames(classes: readonly number[], limit: number): string[] {
  const edges = [...classes, limit].map((edge) => String(Number((edge * 100).toFixed(2))));
  return edges.map((edge, i) => (i === 0 ? `under ${edge}` : `${edges[i - 1]}–${edge}`));
}

/** The cell that holds a place of the map; null outside the floor. */
export function cellAt(grid: Grid, [x, y]: Point): { row: number; column: number } | null {
  const column = Math.round((x - grid.x) / grid.resolution);
  const row = Math.round((y - grid.y) / grid.resolution);
  const reason = grid.reason[row]?.[column];
  return reason === undefined || reason === OUTSIDE ? null : { row, column };
}

/** Why there is no figure at a cell; empty where there is one. */
export const whyNot = (reason: number): string => WHY[reason] ?? "";
