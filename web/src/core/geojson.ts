/** Sites as GeoJSON in local metres: a `role` per feature, rings closed. */

import { distance, type Point } from "./geometry";
import { emptySite, type Landmark, type Site } from "./site";

interface Feature {
  type: "Feature";
  properties: Record<string, unknown>;
  geometry: { type: string; coordinates: unknown };
}

export interface FeatureCollection {
  type: "FeatureCollection";
  name?: string;
  features: Feature[];
}

export const isGeoJson = (document: unknown): document is FeatureCollection =>
  typeof document === "object" &&
  document !== null &&
  (document as { type?: unknown }).type === "FeatureCollection";

export function toGeoJson(site: Site): FeatureCollection {
  const feature = (role: string, type: string, coordinates: unknown, more = {}): Feature => ({
    type: "Feature",
    properties: { role, ...more },
    geometry: { type, coordinates },
  });
  const close = (ring: Point[]): Point[] => [...ring, ring[0]];
  return {
    type: "FeatureCollection",
    name: site.name,
    features: [
      ...(site.boundary.length > 0 ? [feature("boundary", "Polygon", [close(site.boundary)])] : []),
      ...site.islands.map((ring) => feature("island", "Polygon", [close(ring)])),
      ...site.walls.map((wall) => feature("wall", "LineString", wall)),
      ...site.no_go.map((ring) => feature("no_go", "Polygon", [close(ring)])),
      ...site.landmarks.map(({ x, y, ...kind }) => feature("landmark", "Point", [x, y], kind)),
      ...site.routes.map(({ nodes, ...named }) => feature("route", "LineString", nodes, named)),
      ...(site.start
        ? [
            feature("start", "Point", [site.start[0], site.start[1]], {
              ...(site.start[2] === undefined ? {} : { heading: site.start[2] }),
            }),
          ]
        : []),
    ],
  };
}

/** Throws with a clear sentence where a feature cannot be read. */
export function fromGeoJson(document: FeatureCollection): Site {
  const site = emptySite(document.name ?? "Imported site");
  document.features.forEach((feature, i) => {
    const role = feature.properties?.role;
    const coordinates = feature.geometry?.coordinates;
    const where = `Feature ${i + 1}`;
    switch (role) {
      case "boundary":
      case "island": {
        const [outer, ...holes] = rings(coordinates, where);
        if (role === "boundary") site.boundary = outer;
        else site.islands.push(outer);
        if (role === "boundary") site.islands.push(...holes);
        break;
      }
      case "no_go":
        site.no_go.push(rings(coordinates, where)[0]);
        break;
      case "wall":
        site.walls.push(points(coordinates, where));
        break;
      case "route":
        site.routes.push({
          name: String(feature.properties.name ?? `Route ${site.routes.length + 1}`),
          nodes: points(coordinates, where),
          ...(typeof feature.properties.heading === "number"
            ? { heading: feature.properties.heading }
            : {}),
        });
        break;
      case "landmark": {
        const [x, y] = point(coordinates, where);
        const { role: _, ...kind } = feature.properties;
        site.landmarks.push({ ...(kind as unknown as Landmark), x, y });
        break;
      }
      case "start": {
        const [x, y] = point(coordinates, where);
        const { heading } = feature.properties;
        site.start = typeof heading === "number" ? [x, y, heading] : [x, y];
        break;
      }
      default:
        throw new Error(
          `${where} has the role ${JSON.stringify(role)}: expected boundary, island, wall, no_go, landmark, route or start.`,
        );
    }
  });
  return site;
}

function point(value: unknown, where: string): Point {
  if (Array.isArray(value) && typeof value[0] === "number" && typeof value[1] === "number") {
    return [value[0], value[1]];
  }
  throw new Error(`${where} has no usable coordinates: numbers [x, y] in metres were expected.`);
}

function points(value: unknown, where: string): Point[] {
  if (!Array.isArray(value)) throw new Error(`${where} has no list of coordinates.`);
  return value.map((entry) => point(entry, where));
}

function rings(value: unknown, where: string): Point[][] {
  if (!Array.isArray(value) || value.length === 0) throw new Error(`${where} has no ring.`);
  return value.map((ring) => {
    const list = points(ring, where);
    const closed = list.length > 1 && distance(list[0], list[list.length - 1]) === 0;
    return closed ? list.slice(0, -1) : list;
  });
}
