import { describe, expect, it } from "vitest";
import * as geometry from "../src/core/geometry";
import type { Point } from "../src/core/geometry";

const square: Point[] = [
  [0, 0],
  [4, 0],
  [4, 4],
  [0, 4],
];

it("wraps angles into (-pi, pi]", () => {
  expect(geometry.wrap(3 * Math.PI)).toBeCloseTo(Math.PI);
  expect(geometry.wrap(-Math.PI)).toBeCloseTo(Math.PI);
  expect(geometry.wrap(-0.5)).toBeCloseTo(-0.5);
});

it("measures rings and what has holes", () => {
  const hole: Point[] = [
    [1, 1],
    [2, 1],
    [2, 2],
    [1, 2],
  ];
  expect(geometry.ringArea(square)).toBe(16);
  expect(geometry.multiPolygonArea([[square, hole]])).toBe(15);
  expect(geometry.pathLength(square)).toBe(12);
  expect(geometry.pathLength(square, true)).toBe(16);
});

it("knows what lies inside", () => {
  expect(geometry.insideRing([2, 2], square)).toBe(true);
  expect(geometry.insideRing([5, 2], square)).toBe(false);
});

it("finds the nearest point of an edge, also beyond its ends", () => {
  expect(geometry.nearestOnSegment([2, 3], [0, 0], [4, 0])).toEqual([2, 0]);
  expect(geometry.nearestOnSegment([9, 3], [0, 0], [4, 0])).toEqual([4, 0]);
  expect(geometry.nearestOnSegment([9, 3], [1, 1], [1, 1])).toEqual([1, 1]);
});

it("puts a mark every two metres along a bent path", () => {
  const marks = geometry.marksAlong([...square.slice(0, 3)], 2);
  expect(marks.map((mark) => mark.at)).toEqual([
    [1, 0],
    [3, 0],
    [4, 1],
    [4, 3],
  ]);
  expect(marks[2].angle).toBeCloseTo(Math.PI / 2);
});

describe("the 95 % ellipse", () => {
  it("has the axes of an uncorrelated covariance", () => {
    const shape = geometry.ellipse95(0.04, 0, 0.01);
    expect(shape.major).toBeCloseTo(0.2 * Math.sqrt(5.991));
    expect(shape.minor).toBeCloseTo(0.1 * Math.sqrt(5.991));
    expect(shape.angle).toBeCloseTo(0);
  });

  it("turns with the correlation", () => {
    expect(geometry.ellipse95(0.02, 0.01, 0.02).angle).toBeCloseTo(Math.PI / 4);
    expect(geometry.ellipse95(0.01, 0, 0.04).angle).toBeCloseTo(Math.PI / 2);
  });
});
