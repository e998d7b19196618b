/** The colours of the map, read from the style sheet's tokens. */

import { paletteVersion } from "../state/theme";

const NAMES = {
  ground: "--map-ground",
  floor: "--map-floor",
  grid: "--map-grid",
  ink: "--ink",
  quiet: "--ink-quiet",
  halo: "--map-halo",
  solid: "--map-solid",
  accent: "--accent",
  fault: "--fault",
  real: "--real",
  measured: "--measured",
  estimated: "--estimated",
  target: "--target",
  covered: "--covered",
  noGo: "--no-go",
  plan: "--plan",
  poleBright: "--pole-bright",
  poleDark: "--pole-dark",
  poleEdge: "--pole-edge",
  poleUnseen: "--pole-unseen",
  obstacle: "--obstacle",
  blind: "--heat-none",
} as const;

/** From sharp to vague: one colour more than there are limits between them. */
const HEAT = [1, 2, 3, 4, 5, 6, 7].map((shade) => `--heat-${shade}`);

export type Palette = Record<keyof typeof NAMES, string> & {
  coveredAlpha: number;
  line: number;
  heat: string[];
  heatAlpha: number;
};

let palette: Palette | null = null;
let version = -1;

export function currentPalette(): Palette {
  if (palette && version === paletteVersion.value) return palette;
  version = paletteVersion.value;
  const style = getComputedStyle(document.documentElement);
  const read = (name: string) => style.getPropertyValue(name).trim();
  const colours = Object.fromEntries(Object.entries(NAMES).map(([key, name]) => [key, read(name)]));
  palette = {
    ...(colours as Record<keyof typeof NAMES, string>),
    coveredAlpha: Number(read("--covered-alpha")),
    line: Number(read("--line-scale")),
    heat: HEAT.map(read),
    heatAlpha: Number(read("--heat-alpha")),
  };
  return palette;
}
