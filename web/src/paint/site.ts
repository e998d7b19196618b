/** Paints the drawn map: grid, floor, no-go areas, islands, walls, routes, start, landmarks. */

import { marksAlong, type Point, ringArea, ringLabel } from "../core/geometry";
import { landmarkCode, type Selection, type Site } from "../core/site";
import { disc, hatching, line, type Paper, paragraph, trace, words } from "./paper";

export interface SiteLook {
  selection?: Selection | null;
  /** Ids that were seen lately; null: no matter. */
  seen?: ReadonlySet<number> | null;
  suspected?: ReadonlySet<number>;
  routes?: boolean;
}

const is = (at: Selection | null | undefined, kind: Selection["kind"], index = 0): boolean =>
  at?.kind === kind && at.index === index;

/** One line per metre, per ten where metres would be a grey veil. */
export function paintGrid(paper: Paper): void {
  const { ctx, palette, extent, resolution } = paper;
  const step = [1, 10, 100, 1000].find((metres) => metres / resolution >= 12) ?? 10_000;
  ctx.save();
  ctx.strokeStyle = palette.grid;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (let x = Math.ceil(extent[0] / step) * step; x <= extent[2]; x += step) {
    const [px] = paper.at([x, 0]);
    ctx.moveTo(Math.round(px) + 0.5, 0);
    ctx.lineTo(Math.round(px) + 0.5, paper.height);
  }
  for (let y = Math.ceil(extent[1] / step) * step; y <= extent[3]; y += step) {
    const [, py] = paper.at([0, y]);
    ctx.moveTo(0, Math.round(py) + 0.5);
    ctx.lineTo(paper.width, Math.round(py) + 0.5);
  }
  ctx.stroke();
  ctx.restore();
}

export function paintFloor(paper: Paper, site: Site): void {
  if (site.boundary.length < 3) return;
  paper.ctx.beginPath();
  trace(paper, site.boundary, true);
  paper.ctx.fillStyle = paper.palette.floor;
  paper.ctx.fill();
}

export function paintSite(paper: Paper, site: Site, look: SiteLook = {}): void {
  const { ctx, palette } = paper;
  const { selection } = look;
  const colour = (chosen: boolean) => (chosen ? palette.accent : palette.ink);
  site.no_go.forEach((ring, i) => paintNoGo(paper, ring, is(selection, "nogo", i)));
  site.islands.forEach((ring, i) => {
    ctx.beginPath();
    trace(paper, ring, true);
    ctx.fillStyle = palette.solid;
    ctx.fill();
    const chosen = is(selection, "island", i);
    line(paper, [...ring, ring[0]], { color: colour(chosen), width: chosen ? 3 : 2 });
  });
  if (site.boundary.length > 1) {
    const chosen = is(selection, "boundary");
    line(paper, [...site.boundary, site.boundary[0]], {
      color: colour(chosen),
      width: chosen ? 4 : 3,
    });
  }
  site.walls.forEach((wall, i) => {
    const chosen = is(selection, "wall", i);
    line(paper, wall, { color: colour(chosen), width: 5 });
  });
  if (look.routes !== false) {
    site.routes.forEach((route, i) => {
      paintRoute(paper, route, is(selection, "route", i));
    });
  }
  if (site.start) paintStart(paper, site.start, is(selection, "start"));
  site.landmarks.forEach((mark, i) => {
    const unseen = look.seen ? !look.seen.has(mark.id) : false;
    paintLandmark(paper, mark, {
      chosen: is(selection, "landmark", i),
      unseen,
      suspected: look.suspected?.has(mark.id) ?? false,
    });
  });
}

/** Floor that is not to be driven on: hatched, with its name where there is room for it. */
function paintNoGo(paper: Paper, ring: readonly Point[], chosen: boolean): void {
  const { ctx, palette, resolution } = paper;
  ctx.beginPath();
  trace(paper, ring, true);
  ctx.fillStyle = hatching(paper, palette.noGo);
  ctx.fill();
  const color = chosen ? palette.accent : palette.noGo;
  line(paper, [...ring, ring[0]], { color, width: chosen ? 3 : 2, dash: [8, 4] });
  if (ringArea(ring) / resolution ** 2 > 4_000) {
    paragraph(paper, "No-go", paper.at(ringLabel(ring)), palette.noGo);
  }
}

function paintRoute(paper: Paper, route: Site["routes"][number], chosen: boolean): void {
  const { palette, resolution } = paper;
  const { nodes, name, heading } = route;
  const color = chosen ? palette.accent : palette.quiet;
  line(paper, nodes, { color, width: chosen ? 3 : 2, dash: [2, 5] });
  for (const mark of marksAlong(nodes, 2)) arrow(paper, mark.at, mark.angle, color);
  nodes.forEach((node, i) => {
    disc(paper, node, 8, palette.halo, { color, width: 1.5 });
    const [x, y] = paper.at(node);
    words(paper, String(i + 1), [x, y], { size: 11, color });
  });
  if (nodes.length > 0) {
    const [x, y] = paper.at(nodes[0]);
    words(paper, name, [x, y - 18], { color, bold: chosen });
  }
  if (nodes.length > 0 && heading !== undefined) {
    const [x, y] = nodes[nodes.length - 1];
    const ahead = 15 * resolution;
    const tip: Point = [x + ahead * Math.cos(heading), y + ahead * Math.sin(heading)];
    arrow(paper, tip, heading, color, 6);
  }
}

export function arrow(paper: Paper, at: Point, angle: number, color: string, size = 5): void {
  const { ctx } = paper;
  const [x, y] = paper.at(at);
  ctx.save();
  ctx.translate(x, y);
  ctx.rotate(-angle);
  ctx.beginPath();
  ctx.moveTo(size, 0);
  ctx.lineTo(-size, -size * 0.8);
  ctx.lineTo(-size * 0.4, 0);
  ctx.lineTo(-size, size * 0.8);
  ctx.closePath();
  ctx.fillStyle = color;
  ctx.fill();
  ctx.restore();
}

/** A flag-less arrow in a ring where the robot starts; without heading only the ring. */
function paintStart(paper: Paper, start: NonNullable<Site["start"]>, chosen: boolean): void {
  const { palette } = paper;
  const color = chosen ? palette.accent : palette.ink;
  const at: Point = [start[0], start[1]];
  disc(paper, at, 9, palette.halo, { color, width: 2 });
  if (start[2] !== undefined) arrow(paper, at, start[2], color, 6);
  else disc(paper, at, 2.5, color);
  const [x, y] = paper.at(at);
  words(paper, "Start", [x, y + 19], { size: 12, color });
}

export const POLE_HEIGHT = 26;
const POLE_WIDTH = 8;

/** A pole that stands on its place, striped with its own code. */
export function paintLandmark(
  paper: Paper,
  mark: Site["landmarks"][number],
  { chosen = false, unseen = false, suspected = false } = {},
): void {
  const { ctx, palette } = paper;
  const [x, y] = paper.at([mark.x, mark.y]);
  const code = landmarkCode(mark.id, mark.bits ?? 4);
  const stripe = POLE_HEIGHT / code.length;
  const left = x - POLE_WIDTH / 2;
  const top = y - POLE_HEIGHT;
  ctx.save();
  ctx.fillStyle = palette.halo;
  ctx.fillRect(left - 2, top - 2, POLE_WIDTH + 4, POLE_HEIGHT + 4);
  for (let i = 0; i < code.length; i++) {
    const bright = unseen ? palette.poleUnseen : palette.poleBright;
    ctx.fillStyle = code[i] === "1" ? bright : palette.poleDark;
    ctx.fillRect(left, top + i * stripe, POLE_WIDTH, stripe + 0.5);
  }
  ctx.strokeStyle = chosen ? palette.accent : palette.poleEdge;
  ctx.lineWidth = chosen ? 2.5 : 1;
  ctx.strokeRect(left, top, POLE_WIDTH, POLE_HEIGHT);
  if (suspected) {
    ctx.strokeStyle = palette.noGo;
    ctx.lineWidth = 2.5 * palette.line;
    ctx.beginPath();
    ctx.arc(x, y - POLE_HEIGHT / 2, 20, 0, 2 * Math.PI);
    ctx.stroke();
  }
  ctx.restore();
  words(paper, String(mark.id), [x + 8, y - POLE_HEIGHT / 2], {
    align: "left",
    bold: true,
    color: chosen ? palette.accent : unseen ? palette.quiet : palette.ink,
  });
}
