import { describe, expect, it } from "vitest";
import * as format from "../src/core/format";

describe("lengths", () => {
  it("are centimetres under 10 m and metres with one decimal above", () => {
    expect(format.length(0.424)).toBe("42 cm");
    expect(format.length(9.994)).toBe("999 cm");
    expect(format.length(9.996)).toBe("10.0 m");
    expect(format.length(169.55)).toBe("169.6 m");
    expect(format.length(-0.3)).toBe("−30 cm");
    expect(format.length(-0.001)).toBe("0 cm");
  });

  it("are a dash where they are not known, and 0 only where they are 0", () => {
    expect(format.length(null)).toBe(format.UNKNOWN);
    expect(format.length(Number.NaN)).toBe(format.UNKNOWN);
    expect(format.length(0)).toBe("0 cm");
  });
});

it("shares are rounded down: 99.9 % is not done", () => {
  expect(format.percent(0.999)).toBe("99 %");
  expect(format.percent(1)).toBe("100 %");
  expect(format.percent(0.29)).toBe("29 %");
});

it("an age is said only once it is more than a second", () => {
  expect(format.age(0.9)).toBe("");
  expect(format.age(4.7)).toBe("4 s old");
  expect(format.age(600)).toBe("10 min old");
});

it("durations", () => {
  expect(format.duration(59.4)).toBe("59 s");
  expect(format.duration(59.6)).toBe("1 min 0 s");
  expect(format.duration(3700)).toBe("1 h 1 min");
  expect(format.counter(187.9)).toBe("3:07");
});

it("the clock has 24 hours and says the day where it is not today", () => {
  const today = new Date(2026, 10, 22, 23, 0);
  expect(format.clock(new Date(2026, 10, 22, 17, 5).getTime() / 1000, today)).toBe("17:05");
  expect(format.clock(new Date(2026, 10, 21, 7, 5).getTime() / 1000, today)).toBe(
    "2026-11-21 07:05",
  );
});

it("typed numbers are read with either decimal sign and their unit", () => {
  expect(format.parseNumber(" 1,5 m")).toEqual({ value: 1.5, unit: "m" });
  expect(format.parseNumber("150cm")).toEqual({ value: 150, unit: "cm" });
  expect(format.parseNumber("−90°")).toEqual({ value: -90, unit: "" });
  expect(format.parseNumber("a lot")).toBeNull();
  expect(format.parseNumber("")).toBeNull();
});
