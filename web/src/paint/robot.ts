/** Paints the four kinds of points, the trail with what it covered, and the camera's view. */

import type { About, Snapshot } from "../api/types";
import { ellipse95, type Point, polar } from "../core/geometry";
import type { Trail } from "../core/trail";
import { disc, line, type Paper, trace } from "./paper";

/** Smaller than this on the screen the robot would be lost. */
const SMALLEST = 11;

/** What a tool of this width swept: the trail as broad as the tool, then the trail itself. */
export function paintCovered(paper: Paper, trail: Trail, toolWidth: number | null): void {
  if (toolWidth === null) return;
  const { ctx, palette, resolution } = paper;
  ctx.save();
  // One path for all stretches: where it crosses itself it does not get darker.
  ctx.globalAlpha = palette.coveredAlpha;
  ctx.strokeStyle = palette.covered;
  ctx.fillStyle = palette.covered;
  ctx.lineWidth = toolWidth / resolution;
  ctx.lineCap = "round";
  ctx.lineJoin = "round";
  ctx.beginPath();
  for (const stretch of trail) trace(paper, thinned(stretch, 2 * resolution));
  ctx.stroke();
  ctx.restore();
}

export function paintTrail(paper: Paper, trail: Trail, color = paper.palette.estimated): void {
  for (const stretch of trail) {
    line(paper, thinned(stretch, paper.resolution), { color, width: 2, halo: true });
  }
}

/** Points at least `apart` metres from one another: no more than the screen can show. */
function thinned(points: readonly Point[], apart: number): readonly Point[] {
  if (points.length < 200) return points;
  const kept: Point[] = [points[0]];
  let last = points[0];
  for (const point of points) {
    if (Math.abs(point[0] - last[0]) + Math.abs(point[1] - last[1]) >= apart) {
      kept.push(point);
      last = point;
    }
  }
  kept.push(points[points.length - 1]);
  return kept;
}

export function paintDots(paper: Paper, dots: readonly Point[]): void {
  const { ctx, palette } = paper;
  const radius = 1.75 * palette.line;
  ctx.save();
  ctx.fillStyle = palette.measured;
  for (const dot of dots) {
    const [x, y] = paper.at(dot);
    ctx.beginPath();
    ctx.arc(x, y, radius, 0, 2 * Math.PI);
    ctx.fill();
  }
  ctx.restore();
}

export function paintTarget(paper: Paper, at: Point): void {
  const { ctx, palette } = paper;
  const [x, y] = paper.at(at);
  ctx.save();
  for (const [color, width] of [
    [palette.halo, 5],
    [palette.target, 2.5 * palette.line],
  ] as const) {
    ctx.strokeStyle = color;
    ctx.lineWidth = width;
    ctx.beginPath();
    ctx.moveTo(x - 7, y);
    ctx.lineTo(x + 7, y);
    ctx.moveTo(x, y - 7);
    ctx.lineTo(x, y + 7);
    ctx.stroke();
  }
  ctx.restore();
}

/** The truth, which only the simulation knows: a hollow ring with a tick for the heading. */
export function paintReal(paper: Paper, at: Point, heading: number, radius: number): void {
  const { palette, resolution } = paper;
  const size = Math.max(SMALLEST + 3, radius / resolution);
  disc(paper, at, size, null, { color: palette.real, width: 2, halo: true });
  const tick = size * resolution;
  line(paper, [polar(at, tick, heading), polar(at, tick * 1.35, heading)], {
    color: palette.real,
    width: 2,
  });
}

/** The robot's outline from above, nose ahead: `base_link` between the rear wheels. */
export function paintRobot(paper: Paper, at: Point, heading: number, about: About | null): void {
  const { ctx, palette, resolution } = paper;
  const vehicle = about?.model.vehicle;
  const [x, y] = paper.at(at);
  const scale = Math.max(1 / resolution, SMALLEST / (vehicle?.body_radius ?? 0.14));
  const half = ((vehicle?.track ?? 0.2) / 2) * scale;
  const nose = (vehicle?.wheelbase ?? 0.2) * scale;
  const tail = half * 0.5;
  ctx.save();
  ctx.translate(x, y);
  ctx.rotate(-heading);
  ctx.beginPath();
  ctx.moveTo(nose, 0);
  ctx.lineTo(nose * 0.55, half);
  ctx.lineTo(-tail, half);
  ctx.lineTo(-tail, -half);
  ctx.lineTo(nose * 0.55, -half);
  ctx.closePath();
  ctx.lineJoin = "round";
  ctx.fillStyle = palette.halo;
  ctx.fill();
  ctx.strokeStyle = palette.halo;
  ctx.lineWidth = 6;
  ctx.stroke();
  ctx.strokeStyle = palette.estimated;
  ctx.lineWidth = 2.5 * palette.line;
  ctx.stroke();
  ctx.fillStyle = palette.estimated;
  ctx.beginPath();
  ctx.moveTo(nose, 0);
  ctx.lineTo(nose * 0.45, half * 0.6);
  ctx.lineTo(nose * 0.45, -half * 0.6);
  ctx.closePath();
  ctx.fill();
  ctx.restore();
}

export function paintEllipse(paper: Paper, at: Point, covariance: readonly number[]): void {
  const { ctx, palette, resolution } = paper;
  const shape = ellipse95(covariance[0], covariance[1], covariance[3]);
  const [x, y] = paper.at(at);
  if (!(shape.major / resolution > 1)) return;
  ctx.save();
  ctx.beginPath();
  ctx.ellipse(
    x,
    y,
    shape.major / resolution,
    shape.minor / resolution,
    -shape.angle,
    0,
    2 * Math.PI,
  );
  ctx.strokeStyle = palette.estimated;
  ctx.lineWidth = 1.5 * palette.line;
  ctx.stroke();
  ctx.restore();
}

/** How far the wedge is drawn, metres. */
const VIEW = 1.6;

export function paintView(
  paper: Paper,
  pose: NonNullable<Snapshot["pose"]>,
  pan: number,
  about: About,
): void {
  const { ctx, palette, resolution } = paper;
  const { forward, half_view: half } = about.model.camera;
  const [x, y] = paper.at(polar([pose.x, pose.y], forward, pose.heading));
  const looking = pose.heading + pan;
  ctx.save();
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.arc(x, y, VIEW / resolution, -(looking + half), -(looking - half));
  ctx.closePath();
  ctx.strokeStyle = palette.quiet;
  ctx.lineWidth = palette.line;
  ctx.stroke();
  ctx.globalAlpha = 0.12;
  ctx.fillStyle = palette.quiet;
  if (palette.coveredAlpha < 1) ctx.fill();
  ctx.restore();
}

export function paintProximity(paper: Paper, snapshot: Snapshot, about: About): void {
  const { pose } = snapshot;
  if (!pose) return;
  const { angles, forward, max_range: longest } = about.model.proximity;
  const from = polar([pose.x, pose.y], forward, pose.heading);
  angles.forEach((angle, i) => {
    const reading = snapshot.proximity[i];
    if (reading === null || reading >= longest) return;
    const tip = polar(from, reading, pose.heading + angle);
    line(paper, [from, tip], { color: paper.palette.quiet, width: 1, dash: [2, 3] });
    disc(paper, tip, 3, paper.palette.quiet);
  });
}

/** People and things that stand in the way (simulation). */
export function paintObstacles(paper: Paper, obstacles: Snapshot["obstacles"]): void {
  for (const { x, y, radius } of obstacles) {
    const size = Math.max(6, radius / paper.resolution);
    disc(paper, [x, y], size, paper.palette.obstacle, { color: paper.palette.ink, width: 2 });
    disc(paper, [x, y], size * 0.45, paper.palette.ink);
  }
}
