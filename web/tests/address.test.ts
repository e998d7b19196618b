import { expect, it } from "vitest";
import { format, formatSelection, NEW_ID, parse, parseSelection } from "../src/core/address";

it("reads what it writes", () => {
  for (const path of [
    "/draw/3/wall-1",
    "/check/3/17",
    "/drive",
    "/prove/12",
    "/setup",
    "/draw/new",
  ]) {
    expect(format(parse(path))).toBe(path);
  }
});

it("begins with Draw where the address says nothing that is known", () => {
  expect(parse("/")).toEqual({ place: "draw", id: null, detail: null });
  expect(parse("/nowhere/x")).toEqual({ place: "draw", id: null, detail: null });
  expect(parse("/draw/new/boundary-0").id).toBe(NEW_ID);
});

it("keeps the picked corner in the selection", () => {
  const corner = { kind: "island", index: 2, vertex: 0 } as const;
  expect(parseSelection(formatSelection(corner))).toEqual(corner);
  expect(parseSelection("wall-1")).toEqual({ kind: "wall", index: 1 });
  expect(parseSelection("tree-1")).toBeNull();
  expect(parseSelection("wall-x")).toBeNull();
  expect(parseSelection(null)).toBeNull();
});
