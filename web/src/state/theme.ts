/** Light, dark or sun; "auto" follows the device. */

import { effect, signal } from "@preact/signals";
import { storedText, storeText } from "./storage";

export const THEMES = ["auto", "light", "dark", "sun"] as const;
export type Theme = (typeof THEMES)[number];

const KEY = "polepilot.theme";
const darkDevice = window.matchMedia("(prefers-color-scheme: dark)");

export const theme = signal<Theme>(THEMES.find((name) => name === storedText(KEY)) ?? "auto");

/** Counts up whenever colours changed, so that the map is painted anew. */
export const paletteVersion = signal(0);

function apply(): void {
  const shown = theme.value === "auto" ? (darkDevice.matches ? "dark" : "light") : theme.value;
  document.documentElement.dataset.theme = shown;
  paletteVersion.value = paletteVersion.peek() + 1;
}

effect(() => {
  storeText(KEY, theme.value);
  apply();
});
darkDevice.addEventListener("change", apply);
