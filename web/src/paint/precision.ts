/** Paints the precision map under the drawing, and where landmarks are suggested. */

import type { PrecisionRecord, Suggestions } from "../api/types";
import type { Point } from "../core/geometry";
import { type Run, runsOf } from "../core/precision";
import type { Site } from "../core/site";
import { disc, hatching, type Paper, trace, words } from "./paper";

const cache = new WeakMap<PrecisionRecord, Run[]>();

function runs(map: PrecisionRecord): Run[] {
  let ready = cache.get(map);
  if (!ready) {
    ready = runsOf(map);
    cache.set(map, ready);
  }
  return ready;
}

export function paintPrecision(paper: Paper, map: PrecisionRecord, site: Site): void {
  const { ctx, palette } = paper;
  ctx.save();
  ctx.beginPath();
  trace(paper, site.boundary, true);
  ctx.clip();
  const box = (run: Run) => {
    // Whole pixels: neighbours would otherwise leave a seam.
    const half = map.resolution / 2;
    const top = map.y + run.row * map.resolution + half;
    const [x0, y0] = paper.at([map.x + run.first * map.resolution - half, top]).map(Math.round);
    const right = map.x + run.end * map.resolution - half;
    const [x1, y1] = paper.at([right, top - map.resolution]).map(Math.round);
    ctx.rect(x0, y0, x1 - x0, y1 - y0);
  };
  const fill = (style: string | CanvasPattern, alpha: number, chosen: (run: Run) => boolean) => {
    ctx.globalAlpha = alpha;
    ctx.fillStyle = style;
    ctx.beginPath();
    runs(map).filter(chosen).forEach(box);
    ctx.fill();
  };
  palette.heat.forEach((color, shade) => {
    fill(color, palette.heatAlpha, (run) => run.shade === shade);
  });
  fill(hatching(paper, palette.blind), 1, (run) => run.shade === null);
  fill(hatching(paper, palette.blind), 0.4, (run) => run.doubtful);
  ctx.restore();
}

export function paintSuggestions(paper: Paper, found: Suggestions): void {
  const { palette } = paper;
  found.suggestions.forEach(({ x, y }, i) => {
    const at: Point = [x, y];
    disc(paper, at, 13, palette.halo, { color: palette.accent, width: 2.5, dash: [4, 3] });
    words(paper, String(i + 1), paper.at(at), { bold: true, color: palette.accent });
  });
}
