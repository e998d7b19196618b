/** Place and selection, as they stand in the address: /draw/3/wall-1. Back and forward work. */

import { signal } from "@preact/signals";
import { KINDS, type Kind, type Selection } from "../core/site";

export const PLACES = ["draw", "check", "drive", "prove", "setup"] as const;
export type Place = (typeof PLACES)[number];

export const PLACE_NAMES: Record<Place, string> = {
  draw: "Draw",
  check: "Check",
  drive: "Drive",
  prove: "Prove",
  setup: "Set up",
};

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
    id: /^\d+$/.test(id ?? "") ? Number(id) : null,
    detail: detail || null,
  };
}

export function format({ place, id, detail }: Location): string {
  const tail = detail === null ? "" : `/${detail}`;
  return `/${place}${id === null ? (detail === null ? "" : "/new") : `/${id}`}${tail}`;
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

export const location = signal<Location>(parse(window.location.pathname));

/** Goes somewhere. `replace` keeps the way back free of steps nobody wants to go back to. */
export function go(to: Partial<Location> & { place?: Place }, replace = false): void {
  const next: Location = { ...location.value, ...to };
  if (to.place && to.place !== location.value.place) {
    next.id = to.id ?? null;
    next.detail = to.detail ?? null;
  }
  const path = format(next);
  location.value = next;
  if (path === window.location.pathname) return;
  window.history[replace ? "replaceState" : "pushState"](null, "", path);
}

const follow = () => {
  location.value = parse(window.location.pathname);
};
window.addEventListener("popstate", follow);
