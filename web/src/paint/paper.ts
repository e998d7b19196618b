/** What everything is painted on: a canvas in screen pixels, and map metres on it. */

import type { Point } from "../core/geometry";
import type { Palette } from "./palette";

export interface Paper {
  ctx: CanvasRenderingContext2D;
  width: number;
  height: number;
  /** Metres per pixel. */
  resolution: number;
  palette: Palette;
  at(p: Point): Point;
  /** The map's corners: left, bottom, right, top. */
  extent: [number, number, number, number];
}

export function trace(paper: Paper, points: readonly Point[], closed = false): void {
  points.forEach((point, i) => {
    const [x, y] = paper.at(point);
    if (i === 0) paper.ctx.moveTo(x, y);
    else paper.ctx.lineTo(x, y);
  });
  if (closed) paper.ctx.closePath();
}

export interface Stroke {
  color: string;
  width: number;
  dash?: number[];
  halo?: boolean;
  closed?: boolean;
}

/** A line in pixels' width; thicker in the theme for sunlight. */
export function line(paper: Paper, points: readonly Point[], stroke: Stroke): void {
  if (points.length < 2) return;
  const { ctx, palette } = paper;
  ctx.save();
  ctx.lineJoin = "round";
  ctx.lineCap = stroke.dash ? "butt" : "round";
  ctx.beginPath();
  trace(paper, points, stroke.closed);
  if (stroke.halo) {
    ctx.strokeStyle = palette.halo;
    ctx.lineWidth = stroke.width * palette.line + 3;
    ctx.stroke();
  }
  ctx.setLineDash(stroke.dash ?? []);
  ctx.strokeStyle = stroke.color;
  ctx.lineWidth = stroke.width * palette.line;
  ctx.stroke();
  ctx.restore();
}

/** Words on the map, with a halo so that they are read on any ground. */
export function words(
  paper: Paper,
  text: string,
  [x, y]: Point,
  { color = paper.palette.ink, size = 13, align = "center" as CanvasTextAlign, bold = false } = {},
): void {
  const { ctx, palette } = paper;
  ctx.save();
  ctx.font = `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
  ctx.textAlign = align;
  ctx.textBaseline = "middle";
  ctx.lineJoin = "round";
  ctx.lineWidth = 4;
  ctx.strokeStyle = palette.halo;
  ctx.strokeText(text, x, y);
  ctx.fillStyle = color;
  ctx.fillText(text, x, y);
  ctx.restore();
}

/** Words over several lines of at most `widest` characters. */
export function paragraph(paper: Paper, text: string, at: Point, color: string, widest = 34): void {
  const rows: string[] = [];
  for (const word of text.split(" ")) {
    const row = rows[rows.length - 1];
    if (row !== undefined && row.length + word.length < widest)
      rows[rows.length - 1] = `${row} ${word}`;
    else rows.push(word);
  }
  rows.forEach((row, i) => {
    words(paper, row, [at[0], at[1] + (i - (rows.length - 1) / 2) * 16], { color });
  });
}

const patterns = new Map<string, HTMLCanvasElement>();

/** Slanted lines of a colour, to fill areas with. */
export function hatching(paper: Paper, color: string): CanvasPattern | string {
  let tile = patterns.get(color);
  if (!tile) {
    tile = document.createElement("canvas");
    tile.width = tile.height = 8;
    const pen = tile.getContext("2d")!;
    pen.strokeStyle = color;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (const shift of [-8, 0, 8]) {
      pen.moveTo(shift - 1, 9);
      pen.lineTo(shift + 9, -1);
    }
    pen.stroke();
    patterns.set(color, tile);
  }
  return paper.ctx.createPattern(tile, "repeat") ?? color;
}

export function disc(
  paper: Paper,
  at: Point,
  radius: number,
  fill: string | null,
  stroke?: Stroke,
): void {
  const { ctx, palette } = paper;
  const [x, y] = paper.at(at);
  ctx.save();
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) {
    ctx.fillStyle = fill;
    ctx.fill();
  }
  if (stroke) {
    if (stroke.halo) {
      ctx.strokeStyle = palette.halo;
      ctx.lineWidth = stroke.width * palette.line + 3;
      ctx.stroke();
    }
    ctx.setLineDash(stroke.dash ?? []);
    ctx.strokeStyle = stroke.color;
    ctx.lineWidth = stroke.width * palette.line;
    ctx.stroke();
  }
  ctx.restore();
}
