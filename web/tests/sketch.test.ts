import { describe, expect, it } from "vitest";
import type { Point } from "../src/core/geometry";
import type { Kind } from "../src/core/site";
import { type Sketch, beginSketch, finish, hint, next, place, press } from "../src/core/sketch";

const NEAR = 0.03;

function drawn(kind: Kind, ...points: Point[]): Sketch {
  return points.reduce<Sketch>(
    (sketch, cursor) => place({ ...sketch, cursor }, NEAR).sketch ?? beginSketch(kind),
    beginSketch(kind),
  );
}

function typed(sketch: Sketch, ...keys: string[]): Sketch {
  return keys.reduce((now, key) => press(now, key, NEAR)?.sketch ?? now, sketch);
}

it("a typed number is the length of the edge, in the pointer's direction", () => {
  const sketch = typed({ ...drawn("wall", [1, 1]), cursor: [3, 1] }, "2", ".", "5");
  expect(next(sketch)).toEqual([3.5, 1]);
  const placed = press(sketch, "Enter", NEAR)?.sketch;
  expect(placed?.points).toEqual([
    [1, 1],
    [3.5, 1],
  ]);
  expect(placed?.length).toBe("");
});

it("Tab goes to the angle, in degrees", () => {
  const sketch = typed({ ...drawn("wall", [1, 1]), cursor: [3, 1] }, "2", "Tab", "9", "0");
  expect(next(sketch)).toEqual([1, 3]);
});

it("Enter ends what has enough points and leaves alone what has not", () => {
  expect(press(drawn("boundary", [0, 0], [1, 0]), "Enter", NEAR)?.done).toBeNull();
  const step = press(drawn("boundary", [0, 0], [1, 0], [1, 1]), "Enter", NEAR);
  expect(step?.done).toHaveLength(3);
  expect(step?.sketch?.points).toEqual([]);
});

it("a click on the first corner closes a ring; a second click on the last adds nothing", () => {
  const ring = drawn("island", [0, 0], [1, 0], [1, 1]);
  expect(place({ ...ring, cursor: [0.01, 0] }, NEAR).done).toHaveLength(3);
  expect(place({ ...ring, cursor: [1, 1.01] }, NEAR)).toEqual({
    sketch: { ...ring, cursor: [1, 1.01] },
    done: null,
  });
});

it("a route may come back to where it began", () => {
  const route = drawn("route", [0, 0], [1, 0], [1, 1], [0, 0]);
  expect(finish(route).done).toHaveLength(4);
});

describe("going back", () => {
  it("Escape takes first the typed number, then point by point, then the tool", () => {
    let sketch: Sketch | null = typed({ ...drawn("wall", [0, 0], [1, 0]), cursor: [2, 0] }, "3");
    const points = [];
    while (sketch) {
      points.push(sketch.points.length);
      sketch = press(sketch, "Escape", NEAR)?.sketch ?? null;
    }
    expect(points).toEqual([2, 2, 1, 0]);
  });

  it("Backspace takes the last typed sign, else the last point", () => {
    const sketch = typed(drawn("wall", [0, 0], [1, 0]), "3", "1");
    expect(typed(sketch, "Backspace").length).toBe("3");
    expect(typed(sketch, "Backspace", "Backspace", "Backspace").points).toHaveLength(1);
  });
});

it("landmark and start end by themselves; Enter leaves the heading open", () => {
  expect(place({ ...beginSketch("landmark"), cursor: [1, 1] }, NEAR).done).toEqual([[1, 1]]);
  const start = drawn("start", [1, 1]);
  expect(place({ ...start, cursor: [2, 1] }, NEAR).done).toHaveLength(2);
  expect(press(start, "Enter", NEAR)?.done).toEqual([[1, 1]]);
});

it("other keys mean nothing to a drawing, and it always says what comes next", () => {
  expect(press(drawn("wall", [0, 0]), "q", NEAR)).toBeNull();
  expect(press(beginSketch("wall"), "5", NEAR)).toBeNull();
  for (const kind of [
    "boundary",
    "island",
    "wall",
    "nogo",
    "landmark",
    "route",
    "start",
  ] as const) {
    expect(hint(beginSketch(kind))).toMatch(/^Click/);
  }
});
