/** The drawn map (SITE.json) and what an editor does to it. Every change makes a new document. */

import { type Bounds, bounds, insideRing, type Point } from "./geometry";

export interface Landmark {
  id: number;
  x: number;
  y: number;
  bits?: number;
  segment?: number;
  diameter?: number;
  shape?: "cylinder" | "flat";
}

export interface Route {
  name: string;
  nodes: Point[];
  /** How the robot is to stand at the last node, radians. */
  heading?: number;
}

export type Start = [number, number] | [number, number, number];

export interface Site {
  name: string;
  boundary: Point[];
  islands: Point[][];
  walls: Point[][];
  /** Floor that is not to be driven on. It hides nothing from the camera. */
  no_go: Point[][];
  landmarks: Landmark[];
  routes: Route[];
  start?: Start;
}

export const KINDS = ["boundary", "island", "wall", "nogo", "landmark", "route", "start"] as const;
export type Kind = (typeof KINDS)[number];

/** One thing of a site. `index` counts within its kind; a vertex where one is picked. */
export interface Selection {
  kind: Kind;
  index: number;
  vertex?: number;
}

export const emptySite = (name: string): Site => ({
  name,
  boundary: [],
  islands: [],
  walls: [],
  no_go: [],
  landmarks: [],
  routes: [],
});

/** Any object that came from a file or an older page, made whole; throws with a clear sentence. */
export function asSite(document: unknown): Site {
  if (typeof document !== "object" || document === null || !("boundary" in document)) {
    throw new Error('This file is no site: a JSON object with a "boundary" was expected.');
  }
  const site = { ...emptySite("Imported site"), ...(document as Partial<Site>) };
  const wrong = whatIsWrong(site);
  if (wrong) throw new Error(`This file is no site: ${wrong}.`);
  return clean(site);
}

/** What the page could not even show. Everything else is for the server's check to say. */
function whatIsWrong(site: { [key in keyof Site]: unknown }): string | null {
  const list = (value: unknown, of: (entry: unknown) => boolean) =>
    Array.isArray(value) && value.every(of);
  const isNumber = (value: unknown) => typeof value === "number" && Number.isFinite(value);
  const isPoint = (value: unknown) => list(value, isNumber) && (value as unknown[]).length === 2;
  const isLine = (value: unknown) => list(value, isPoint);
  const has = (value: unknown, test: (entry: Record<string, unknown>) => boolean) =>
    typeof value === "object" && value !== null && test(value as Record<string, unknown>);
  if (typeof site.name !== "string") return "its name is no text";
  if (!isLine(site.boundary)) return "its boundary is no list of points [x, y]";
  if (!list(site.islands, isLine)) return "its islands are no lists of points [x, y]";
  if (!list(site.walls, isLine)) return "its walls are no lists of points [x, y]";
  if (!list(site.no_go, isLine)) return "its no-go areas are no lists of points [x, y]";
  if (!list(site.landmarks, (m) => has(m, ({ id, x, y }) => [id, x, y].every(isNumber))))
    return "its landmarks are not all objects with id, x and y";
  if (
    !list(site.routes, (r) =>
      has(r, ({ name, nodes }) => typeof name === "string" && isLine(nodes)),
    )
  )
    return "its routes are not all objects with a name and nodes [x, y]";
  const { start } = site;
  if (start && !(list(start, isNumber) && [2, 3].includes((start as unknown[]).length)))
    return "its start is not [x, y] or [x, y, heading]";
  return null;
}

/** Without fields that say nothing: the server answers null where a landmark has no own size. */
function clean(site: Site): Site {
  const { start, ...rest } = site;
  const said = <T extends object>(things: T[]): T[] =>
    things.map(
      (thing) => Object.fromEntries(Object.entries(thing).filter(([, v]) => v !== null)) as T,
    );
  return {
    ...rest,
    landmarks: said(site.landmarks),
    routes: said(site.routes),
    ...(start ? { start } : {}),
  };
}

export const isRing = (kind: Kind): boolean =>
  kind === "boundary" || kind === "island" || kind === "nogo";

/** The corners of a thing (one for a landmark or the start). */
export function vertices(site: Site, at: Selection): Point[] {
  switch (at.kind) {
    case "boundary":
      return site.boundary;
    case "island":
      return site.islands[at.index] ?? [];
    case "wall":
      return site.walls[at.index] ?? [];
    case "nogo":
      return site.no_go[at.index] ?? [];
    case "route":
      return site.routes[at.index]?.nodes ?? [];
    case "landmark": {
      const mark = site.landmarks[at.index];
      return mark ? [[mark.x, mark.y]] : [];
    }
    case "start":
      return site.start ? [[site.start[0], site.start[1]]] : [];
  }
}

export const exists = (site: Site, at: Selection): boolean => vertices(site, at).length > 0;

const replaced = <T>(list: readonly T[], index: number, value: T): T[] =>
  list.map((old, i) => (i === index ? value : old));

export function withVertices(site: Site, at: Selection, points: Point[]): Site {
  const [first] = points;
  switch (at.kind) {
    case "boundary":
      return { ...site, boundary: points };
    case "island":
      return { ...site, islands: replaced(site.islands, at.index, points) };
    case "wall":
      return { ...site, walls: replaced(site.walls, at.index, points) };
    case "nogo":
      return { ...site, no_go: replaced(site.no_go, at.index, points) };
    case "route": {
      const route = { ...site.routes[at.index], nodes: points };
      return { ...site, routes: replaced(site.routes, at.index, route) };
    }
    case "landmark": {
      const mark = { ...site.landmarks[at.index], x: first[0], y: first[1] };
      return { ...site, landmarks: replaced(site.landmarks, at.index, mark) };
    }
    case "start": {
      const heading = site.start?.[2];
      return { ...site, start: heading === undefined ? first : [...first, heading] };
    }
  }
}

/** Adds a finished drawing and says what it became. */
export function added(
  site: Site,
  kind: Kind,
  points: Point[],
): { site: Site; selection: Selection } {
  switch (kind) {
    case "boundary":
      return { site: { ...site, boundary: points }, selection: { kind, index: 0 } };
    case "island":
      return {
        site: { ...site, islands: [...site.islands, points] },
        selection: { kind, index: site.islands.length },
      };
    case "wall":
      return {
        site: { ...site, walls: [...site.walls, points] },
        selection: { kind, index: site.walls.length },
      };
    case "nogo":
      return {
        site: { ...site, no_go: [...site.no_go, points] },
        selection: { kind, index: site.no_go.length },
      };
    case "route":
      return {
        site: { ...site, routes: [...site.routes, { name: freeRouteName(site), nodes: points }] },
        selection: { kind, index: site.routes.length },
      };
    case "landmark": {
      const mark: Landmark = {
        ...likeOthers(site),
        id: nextLandmarkId(site),
        x: points[0][0],
        y: points[0][1],
      };
      return {
        site: { ...site, landmarks: [...site.landmarks, mark] },
        selection: { kind, index: site.landmarks.length },
      };
    }
    case "start": {
      const [at, toward] = points;
      const heading = toward && Math.atan2(toward[1] - at[1], toward[0] - at[0]);
      return {
        site: { ...site, start: heading === undefined ? at : [at[0], at[1], heading] },
        selection: { kind, index: 0 },
      };
    }
  }
}

/** The fewest corners that a thing can have. */
export const fewest = (kind: Kind): number =>
  isRing(kind) ? 3 : kind === "wall" || kind === "route" ? 2 : 1;

/** Without the picked vertex, or without the whole thing where none is picked or too few stay. */
export function removed(site: Site, at: Selection): Site {
  const points = vertices(site, at);
  if (at.vertex !== undefined && points.length > fewest(at.kind)) {
    return withVertices(
      site,
      at,
      points.filter((_, i) => i !== at.vertex),
    );
  }
  const without = <T>(list: readonly T[]): T[] => list.filter((_, i) => i !== at.index);
  switch (at.kind) {
    case "boundary":
      return { ...site, boundary: [] };
    case "island":
      return { ...site, islands: without(site.islands) };
    case "wall":
      return { ...site, walls: without(site.walls) };
    case "nogo":
      return { ...site, no_go: without(site.no_go) };
    case "route":
      return { ...site, routes: without(site.routes) };
    case "landmark":
      return { ...site, landmarks: without(site.landmarks) };
    case "start": {
      const { start: _, ...rest } = site;
      return rest;
    }
  }
}

export function shapes(site: Site): Selection[] {
  const all = (kind: Kind, list: readonly unknown[]) => list.map((_, index) => ({ kind, index }));
  return [
    ...(site.start ? [{ kind: "start" as const, index: 0 }] : []),
    ...all("landmark", site.landmarks),
    ...all("route", site.routes),
    ...all("wall", site.walls),
    ...all("island", site.islands),
    ...all("nogo", site.no_go),
    ...(site.boundary.length > 0 ? [{ kind: "boundary" as const, index: 0 }] : []),
  ];
}

export function title(site: Site, at: Selection): string {
  switch (at.kind) {
    case "boundary":
      return "Boundary";
    case "island":
      return `Island ${at.index + 1}`;
    case "wall":
      return `Wall ${at.index + 1}`;
    case "nogo":
      return `No-go area ${at.index + 1}`;
    case "route":
      return `Route “${site.routes[at.index]?.name ?? ""}”`;
    case "landmark":
      return `Landmark ${site.landmarks[at.index]?.id ?? ""}`;
    case "start":
      return "Start";
  }
}

/** A refusal of the server in the words of this page: "islands[1] ..." is "Island 2 ...". */
export function inWords(message: string, site: Site): string {
  const kinds: Record<string, Kind> = {
    islands: "island",
    walls: "wall",
    no_go: "nogo",
    landmarks: "landmark",
    routes: "route",
  };
  const named = message
    .replace(/^(the )?site: /i, "")
    .replace(
      /\b(islands|walls|no_go|landmarks|routes)\[(\d+)\]/g,
      (_, list: string, index: string) => title(site, { kind: kinds[list], index: Number(index) }),
    );
  return named.charAt(0).toUpperCase() + named.slice(1);
}

export function siteBounds(site: Site): Bounds | null {
  return bounds(shapes(site).flatMap((at) => vertices(site, at)));
}

/** Whether a place lies on the floor: inside the boundary, in no island and in no no-go area. */
export function onFloor(site: Site, p: Point): boolean {
  const closed = [...site.islands, ...site.no_go];
  return insideRing(p, site.boundary) && !closed.some((ring) => insideRing(p, ring));
}

/** The segment string of an id, top first, as in the core: 1 orange, 0 black. */
export function landmarkCode(id: number, bits = 4): string {
  const middle = Array.from({ length: bits }, (_, bit) => String((id >> bit) & 1)).join("0");
  return `110${middle}011`;
}

/**
 * The next free id. One that differs from all others in at least two segments is preferred:
 * then one misread segment never makes a neighbour of it.
 */
export function nextLandmarkId(site: Site): number {
  const bits = site.landmarks[0]?.bits ?? 4;
  const used = site.landmarks.map((mark) => mark.id);
  const free = Array.from({ length: 2 ** bits - 1 }, (_, i) => i + 1).filter(
    (id) => !used.includes(id),
  );
  const apart = free.find((id) => used.every((other) => ones(id ^ other) >= 2));
  return apart ?? free[0] ?? Math.max(0, ...used) + 1;
}

function ones(value: number): number {
  let count = 0;
  for (let rest = value; rest > 0; rest >>= 1) count += rest & 1;
  return count;
}

function likeOthers(site: Site): Partial<Landmark> {
  const [first] = site.landmarks;
  if (!first) return {};
  const { id: _i, x: _x, y: _y, ...kind } = first;
  return kind;
}

function freeRouteName(site: Site): string {
  for (let n = site.routes.length + 1; ; n++) {
    if (!site.routes.some((route) => route.name === `Route ${n}`)) return `Route ${n}`;
  }
}
