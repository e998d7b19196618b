import { describe, expect, it } from "vitest";
import { fromGeoJson, toGeoJson } from "../src/core/geojson";
import type { Point } from "../src/core/geometry";
import * as history from "../src/core/history";
import * as sites from "../src/core/site";
import { snap } from "../src/core/snap";

const room: sites.Site = {
  name: "Room",
  boundary: [
    [0, 0],
    [4, 0],
    [4, 3],
    [0, 3],
  ],
  islands: [
    [
      [1, 1],
      [2, 1],
      [2, 2],
    ],
  ],
  walls: [
    [
      [3, 0],
      [3, 1],
    ],
  ],
  no_go: [
    [
      [0.2, 2.2],
      [0.7, 2.2],
      [0.7, 2.7],
    ],
  ],
  landmarks: [
    { id: 1, x: 0, y: 1 },
    { id: 2, x: 4, y: 1 },
  ],
  routes: [
    {
      name: "Tour",
      nodes: [
        [0.5, 0.5],
        [3.5, 2.5],
      ],
      heading: 1.5,
    },
  ],
  start: [0.5, 0.5, 0],
};

describe("landmark ids", () => {
  it("prefer codes that differ in two segments from all others", () => {
    expect(sites.nextLandmarkId(sites.emptySite(""))).toBe(1);
    // 3 differs from 1 and 2 in one segment only; 4 differs from both in two.
    expect(sites.nextLandmarkId(room)).toBe(4);
  });

  it("take any free one where no such code is left", () => {
    const used = [1, 2, 4, 7, 8, 11, 13, 14].map((id) => ({ id, x: 0, y: 0 }));
    expect(sites.nextLandmarkId({ ...room, landmarks: used })).toBe(3);
  });

  it("have the stripes of the core: 13 is 1101000101011", () => {
    expect(sites.landmarkCode(13)).toBe("1101000101011");
  });
});

describe("editing", () => {
  it("never changes the document at hand", () => {
    const before = JSON.stringify(room);
    sites.added(room, "wall", [
      [0, 0],
      [1, 1],
    ]);
    sites.removed(room, { kind: "island", index: 0 });
    sites.withVertices(room, { kind: "start", index: 0 }, [[2, 2]]);
    expect(JSON.stringify(room)).toBe(before);
  });

  it("removes a corner, but the whole thing where too few would stay", () => {
    const corner = sites.removed(room, { kind: "boundary", index: 0, vertex: 1 });
    expect(corner.boundary).toHaveLength(3);
    const island = sites.removed(room, { kind: "island", index: 0, vertex: 1 });
    expect(island.islands).toHaveLength(0);
  });

  it("gives the start its heading from the second point and keeps it when moved", () => {
    const { site } = sites.added(room, "start", [
      [1, 1],
      [1, 2],
    ]);
    expect(site.start?.[2]).toBeCloseTo(Math.PI / 2);
    const moved = sites.withVertices(site, { kind: "start", index: 0 }, [[2, 2]]);
    expect(moved.start).toEqual([2, 2, site.start?.[2]]);
  });

  it("draws no-go areas, picks and removes them", () => {
    const ring: Point[] = [
      [0, 0],
      [1, 0],
      [1, 1],
    ];
    const { site, selection } = sites.added(room, "nogo", ring);
    expect(selection).toEqual({ kind: "nogo", index: 1 });
    expect(sites.vertices(site, selection)).toEqual(ring);
    expect(sites.title(site, selection)).toBe("No-go area 2");
    expect(sites.onFloor(site, [0.8, 0.4])).toBe(false);
    expect(sites.removed(site, selection)).toEqual(room);
  });

  it("names new routes apart", () => {
    const nodes: Point[] = [
      [0, 0],
      [1, 0],
    ];
    const one = sites.added(room, "route", nodes).site;
    const two = sites.added(one, "route", nodes).site;
    expect(two.routes.map((route) => route.name)).toEqual(["Tour", "Route 2", "Route 3"]);
  });
});

it("says the server's refusals in the page's words", () => {
  expect(sites.inWords("the site: islands[0] crosses itself.", room)).toBe(
    "Island 1 crosses itself.",
  );
  expect(sites.inWords("no_go[0] leaves no floor.", room)).toBe("No-go area 1 leaves no floor.");
  expect(sites.inWords("landmarks[1] stands outside.", room)).toBe("Landmark 2 stands outside.");
});

it("comes back whole from GeoJSON", () => {
  expect(fromGeoJson(toGeoJson(room))).toEqual(room);
  expect(() =>
    fromGeoJson({
      type: "FeatureCollection",
      features: [
        {
          type: "Feature",
          properties: { role: "tree" },
          geometry: { type: "Point", coordinates: [0, 0] },
        },
      ],
    }),
  ).toThrow(/Feature 1 has the role "tree"/);
});

it("undoes and redoes by snapshots; a drag is one step", () => {
  let steps = history.begin("a");
  steps = history.record(steps, "b");
  steps = history.amend(steps, "b1");
  steps = history.amend(steps, "b2");
  expect(history.undo(steps).present).toBe("a");
  expect(history.redo(history.undo(steps)).present).toBe("b2");
  expect(history.undo(history.begin("a")).present).toBe("a");
  expect(history.record(history.undo(steps), "c").future).toEqual([]);
});

describe("snapping", () => {
  const options = { resolution: 0.01 };

  it("takes corners before edges before the grid, and says so", () => {
    expect(snap(room, [0.04, 0.05], options)).toEqual({
      point: [0, 0],
      to: "corner of Boundary",
    });
    const edge = snap(room, [3.96, 2.234], options);
    expect(edge.to).toBe("edge of Boundary");
    expect(edge.point[0]).toBe(4);
    expect(snap(room, [2.52, 1.29], options)).toEqual({ point: [2.5, 1.3], to: "grid 10 cm" });
  });

  it("closes a ring at its first corner", () => {
    const sketch: Point[] = [
      [2.2, 2.2],
      [2.6, 2.2],
      [2.6, 2.6],
    ];
    const to = snap(room, [2.22, 2.21], { ...options, sketch, closes: true });
    expect(to.point).toBe(sketch[0]);
    expect(to.to).toMatch(/first corner/);
  });

  it("does not snap a thing to itself", () => {
    const except: sites.Selection = { kind: "landmark", index: 0 };
    const free = { ...room, boundary: [] };
    expect(snap(free, [0.03, 1.03], { ...options, except }).to).toBe("grid 10 cm");
  });
});

it("a file that the page could not show is refused with what is wrong", () => {
  const boundary = [
    [0, 0],
    [4, 0],
    [4, 3],
  ];
  const wrong: [Record<string, unknown>, string][] = [
    [{ boundary: "no" }, "boundary"],
    [{ boundary: [[0, null]] }, "boundary"],
    [{ boundary, islands: [[1, 2]] }, "islands"],
    [{ boundary, walls: {} }, "walls"],
    [{ boundary, no_go: [[1, 2]] }, "no-go"],
    [{ boundary, landmarks: [{ id: 1 }] }, "landmarks"],
    [{ boundary, landmarks: [null] }, "landmarks"],
    [{ boundary, routes: [{ name: "A" }] }, "routes"],
    [{ boundary, start: [1] }, "start"],
    [{ boundary, name: 7 }, "name"],
  ];
  for (const [document, word] of wrong) expect(() => sites.asSite(document)).toThrow(word);
  const routes = [{ name: "A", nodes: [[1, 1]], heading: null }];
  expect(sites.asSite({ boundary, routes }).routes).toEqual([{ name: "A", nodes: [[1, 1]] }]);
  const bare = sites.asSite({ boundary, start: null });
  expect(bare.boundary).toEqual(boundary);
  expect(bare.no_go).toEqual([]);
});
