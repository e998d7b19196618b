/** Paints what is being drawn or edited: lengths at edges, handles, problems in words. */

import type { SiteProblem } from "../api/types";
import { length } from "../core/format";
import { direction, distance, edges, middle, type Point } from "../core/geometry";
import { isRing, type Selection, type Site, vertices } from "../core/site";
import { next, type Sketch, typing } from "../core/sketch";
import { disc, line, type Paper, paragraph, words } from "./paper";
import { arrow } from "./site";

/** Edges shorter than this on the screen carry no number. */
const SHORTEST_LABEL = 36;

function edgeLengths(paper: Paper, points: readonly Point[], closed: boolean, color: string): void {
  for (const [a, b] of edges(points, closed)) {
    if (distance(a, b) / paper.resolution < SHORTEST_LABEL) continue;
    words(paper, length(distance(a, b)), paper.at(middle(a, b)), { size: 12, color });
  }
}

export function paintSketch(paper: Paper, sketch: Sketch): void {
  const { palette } = paper;
  const ahead = next(sketch);
  const points: Point[] = [...sketch.points];
  const closed = isRing(sketch.kind);
  line(paper, points, { color: palette.accent, width: 3, halo: true });
  const last = points[points.length - 1];
  if (ahead && last && sketch.kind !== "landmark") {
    line(paper, [last, ahead], { color: palette.accent, width: 2, dash: [6, 4], halo: true });
    if (closed && points.length > 1) {
      line(paper, [ahead, points[0]], { color: palette.accent, width: 1, dash: [2, 5] });
    }
    if (sketch.kind === "start") arrow(paper, ahead, direction(last, ahead), palette.accent, 8);
  }
  edgeLengths(paper, points, false, palette.ink);
  points.forEach((point, i) => {
    disc(paper, point, i === 0 ? 6 : 4.5, palette.halo, { color: palette.accent, width: 2 });
  });
  if (!ahead) return;
  disc(paper, ahead, 4, palette.accent);
  const [x, y] = paper.at(ahead);
  if (last && distance(last, ahead) > 0) {
    const degrees = Math.round((direction(last, ahead) * 180) / Math.PI);
    const far = sketch.length ? `${sketch.length} m` : length(distance(last, ahead));
    const turn = sketch.angle ? `${sketch.angle}°` : `${degrees}°`;
    const mark = (field: "length" | "angle", text: string) =>
      typing(sketch) && sketch.field === field ? `[${text}]` : text;
    words(paper, `${mark("length", far)}  ${mark("angle", turn)}`, [x + 16, y - 18], {
      align: "left",
      bold: true,
    });
  }
  if (sketch.snappedTo && !typing(sketch)) {
    words(paper, sketch.snappedTo, [x + 16, y + 18], {
      align: "left",
      size: 12,
      color: palette.quiet,
    });
  }
}

/** Corners to drag, small points between them to add one, lengths at the edges. */
export function paintHandles(paper: Paper, site: Site, at: Selection): void {
  const { palette } = paper;
  const points = vertices(site, at);
  if (points.length < 2) return;
  const closed = isRing(at.kind);
  for (const [a, b] of edges(points, closed)) {
    if (distance(a, b) / paper.resolution > SHORTEST_LABEL) {
      disc(paper, middle(a, b), 3.5, palette.halo, { color: palette.accent, width: 1 });
    }
  }
  for (const [a, b] of edges(points, closed)) {
    const apart = distance(a, b);
    if (apart / paper.resolution < 2 * SHORTEST_LABEL) continue;
    const [x, y] = paper.at(middle(a, b));
    // Beside the edge, so that the point to drag stays free.
    const across = direction(a, b) + Math.PI / 2;
    words(paper, length(apart), [x + 34 * Math.cos(across), y - 16 * Math.sin(across)], {
      size: 12,
    });
  }
  points.forEach((point, i) => {
    const picked = at.vertex === i;
    disc(paper, point, picked ? 7 : 5.5, picked ? palette.accent : palette.halo, {
      color: palette.accent,
      width: 2,
    });
  });
}

export function paintProblems(paper: Paper, problems: readonly SiteProblem[]): void {
  const { palette } = paper;
  for (const { where, message } of problems) {
    if (!where) continue;
    disc(paper, where, 11, null, { color: palette.fault, width: 3, halo: true });
    const [x, y] = paper.at(where);
    words(paper, "!", [x, y], { color: palette.fault, bold: true });
    const text = message.length > 110 ? `${message.slice(0, 107)}…` : message;
    paragraph(paper, text, [x, y + 18 + 8 * Math.ceil(text.length / 34)], palette.fault);
  }
}
