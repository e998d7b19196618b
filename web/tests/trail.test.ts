import { expect, it } from "vitest";
import { extend, indexAt, poseAt, positionErrors, summary, trailOf } from "../src/core/trail";

it("a jump begins a new stretch, standing adds nothing", () => {
  const trail = trailOf([
    [0, 0],
    [0.1, 0],
    [0.1, 0.001],
    [5, 5],
  ]);
  expect(trail.map((part) => part.length)).toEqual([2, 1]);
});

it("stays short enough to be painted", () => {
  const trail = trailOf([]);
  for (let i = 0; i < 30_000; i++) extend(trail, [i * 0.02, 0]);
  const points = trail.reduce((sum, part) => sum + part.length, 0);
  expect(points).toBeLessThanOrEqual(20_000);
  expect(trail[0][0]).toEqual([0, 0]);
  expect(trail[0][trail[0].length - 1][0]).toBeCloseTo(29_999 * 0.02);
});

it("finds the pose between two records, turning the short way", () => {
  const times = [0, 1, 2];
  const rows: [number, number, number][] = [
    [0, 0, 3],
    [1, 0, -3],
    [1, 2, -3],
  ];
  const pose = poseAt(times, rows, 0.5);
  expect(pose?.slice(0, 2)).toEqual([0.5, 0]);
  expect(Math.abs(pose?.[2] ?? 0)).toBeCloseTo(Math.PI);
  expect(poseAt(times, rows, 9)).toEqual([1, 2, -3]);
  expect(poseAt(times, [null, null, null], 1)).toBeNull();
  expect(indexAt(times, -1)).toBe(-1);
});

it("errors are unknown where the truth is", () => {
  const errors = positionErrors(
    [[0, 0, 0], null, [3, 4, 0]],
    [
      [0, 0.1, 0],
      [9, 9, 0],
      [0, 0, 0],
    ],
  );
  expect(errors).toEqual([0.1, null, 5]);
  expect(summary(errors)).toEqual({ mean: 2.55, p95: 5, max: 5 });
  expect(summary([null])).toBeNull();
});
