/** Place and selection as they stand in the address: /draw/3/wall-1. */

import { KINDS, type Kind, type Selection } from "./site";

export const PLACES = ["draw", "check", "drive", "prove", "setup"] as const;
export type Place = (typeof PLACES)[number];

export const PLACE_NAMES: Record<Place, string> = {
  draw: "Draw",
  check: "Check",
  drive: "Drive",
  prove: "Prove",
  setup: "Set up",
};

/** Stands for a site that was never saved: /draw/new. */
export const NEW_ID = 0;

export interface Location {
  place: Place;
  /** The site in Draw and Check, the run in Prove. */
  id: number | null;
  /** The selection in Draw, the plan in Check. */
  detail: string | null;
}

export function parse(path: string): Location {
  const [place, id, detail] = path.replace(/^\//, "").split("/");
  return {
    place: PLACES.find((name) => name === place) ?? "draw",
    id: id === "new" ? NEW_ID : /^\d+$/.test(id ?? "") ? Number(id) : null,
    detail: detail || null,
  };
}

export function format({ place, id, detail }: Location): string {
  // A detail belongs to something; without a number it is the one that has none yet.
  const thing = id === NEW_ID || (id === null && detail !== null) ? "new" : id;
  return ["", place, thing, detail].filter((part) => part !== null).join("/");
}

export function parseSelection(detail: string | null): Selection | null {
  const [kind, index, vertex] = (detail ?? "").split("-");
  const known = KINDS.find((name) => name === kind);
  if (!known || !/^\d+$/.test(index ?? "")) return null;
  const at: Selection = { kind: known as Kind, index: Number(index) };
  return /^\d+$/.test(vertex ?? "") ? { ...at, vertex: Number(vertex) } : at;
}

export const formatSelection = (at: Selection): string =>
  [at.kind, at.index, ...(at.vertex === undefined ? [] : [at.vertex])].join("-");
