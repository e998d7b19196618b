/** Where the page is. Back and forward work. */

import { signal } from "@preact/signals";
import { format, type Location, parse, type Place } from "../core/address";

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
