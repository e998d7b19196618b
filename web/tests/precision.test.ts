import { expect, it } from "vitest";
import { cellAt, classNames, type Grid, runsOf, shadeOf, whyNot } from "../src/core/precision";

const CLASSES = [0.005, 0.0075, 0.01];

/** Three rows of four cells of half a metre, the lower left one's middle at (1, 2). */
const grid: Grid = {
  x: 1,
  y: 2,
  resolution: 0.5,
  columns: 4,
  rows: 3,
  classes: CLASSES,
  position: [
    [0.004, 0.0045, 0.006, 0.02],
    [null, null, 0.004, 0.004],
    [null, 0.004, null, 0.004],
  ],
  share: [
    [1, 1, 1, 1],
    [0, 0, 1, 0.25],
    [0, 1, null, 1],
  ],
  reason: [
    [0, 0, 0, 0],
    [1, 3, 0, 0],
    [2, 0, 4, 0],
  ],
};

it("an error falls into the class that its legend names", () => {
  expect([0.001, 0.005, 0.0051, 0.009, 0.5].map((sigma) => shadeOf(sigma, CLASSES))).toEqual([
    0, 0, 1, 2, 3,
  ]);
  expect(classNames(CLASSES, 0.06)).toEqual(["under 0.5", "0.5–0.75", "0.75–1", "1–6"]);
});

it("cells that look alike are painted in one piece", () => {
  const runs = runsOf(grid).map(({ row, first, end, shade, doubtful }) => [
    row,
    first,
    end,
    shade,
    doubtful,
  ]);
  expect(runs).toEqual([
    [0, 0, 2, 0, false],
    [0, 2, 3, 1, false],
    [0, 3, 4, 3, false],
    [1, 0, 2, null, false],
    [1, 2, 3, 0, false],
    [1, 3, 4, 0, true],
    [2, 0, 1, null, false],
    [2, 1, 2, 0, false],
    [2, 3, 4, 0, false],
  ]);
});

it("each piece of floor is painted once, and nothing else is", () => {
  const painted = runsOf(grid).reduce((sum, run) => sum + run.end - run.first, 0);
  expect(painted).toBe(grid.reason.flat().filter((reason) => reason !== 4).length);
});

it("finds the cell under the pointer", () => {
  expect(cellAt(grid, [1.2, 2.2])).toEqual({ row: 0, column: 0 });
  expect(cellAt(grid, [2.3, 2.6])).toEqual({ row: 1, column: 3 });
  expect(cellAt(grid, [2, 3])).toBeNull();
  expect(cellAt(grid, [0.7, 2])).toBeNull();
  expect(cellAt(grid, [1, 9])).toBeNull();
});

it("says why there is no fix", () => {
  expect(whyNot(0)).toBe("");
  expect([1, 2, 3].map(whyNot).every((text) => text.startsWith("no fix"))).toBe(true);
});
