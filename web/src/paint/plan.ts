/** Paints a plan: its parts, directions, and what cannot be reached. */

import type { PlanRecord } from "../api/types";
import { marksAlong, type Point, ringArea, ringLabel } from "../core/geometry";
import { disc, hatching, line, type Paper, paragraph, trace } from "./paper";
import { arrow } from "./site";

/** Arrows stand so far apart, metres. */
const ARROWS = 2;

interface Stretch {
  points: Point[];
  kind: PlanRecord["parts"][number]["kind"];
  reverse: boolean;
}

/** A plan's path cut where the part or the gear changes. */
export function stretches(plan: Pick<PlanRecord, "path" | "gear" | "parts">): Stretch[] {
  const cut: Stretch[] = [];
  for (const part of plan.parts) {
    for (let i = part.first; i < part.last; i++) {
      const reverse = plan.gear[i] < 0;
      const last = cut[cut.length - 1];
      if (i > part.first && last && last.reverse === reverse) last.points.push(plan.path[i + 1]);
      else cut.push({ points: [plan.path[i], plan.path[i + 1]], kind: part.kind, reverse });
    }
  }
  return cut;
}

const cache = new WeakMap<
  PlanRecord,
  { stretch: Stretch; marks: { at: Point; angle: number }[] }[]
>();

function prepared(plan: PlanRecord) {
  let ready = cache.get(plan);
  if (!ready) {
    ready = stretches(plan).map((stretch) => ({
      stretch,
      marks: marksAlong(stretch.points, ARROWS),
    }));
    cache.set(plan, ready);
  }
  return ready;
}

export function paintUnreachable(paper: Paper, plan: PlanRecord, reasons = true): void {
  const { ctx, palette, resolution } = paper;
  for (const { polygon } of plan.unreachable) {
    ctx.beginPath();
    trace(paper, polygon, true);
    ctx.fillStyle = hatching(paper, palette.noGo);
    ctx.fill();
    line(paper, [...polygon, polygon[0]], { color: palette.noGo, width: 1 });
  }
  if (!reasons) return;
  // Words only where the pocket is large enough on the screen to carry them; the panel lists all.
  for (const { polygon, reason } of plan.unreachable) {
    if (ringArea(polygon) / resolution ** 2 > 4_000) {
      paragraph(paper, reason, paper.at(ringLabel(polygon)), palette.noGo);
    }
  }
}

export function paintPlan(paper: Paper, plan: PlanRecord, faint = false): void {
  const { ctx, palette } = paper;
  ctx.save();
  if (faint) ctx.globalAlpha = 0.6;
  for (const { stretch, marks } of prepared(plan)) {
    const dash = stretch.reverse
      ? [1, 5]
      : stretch.kind === "bridge" || stretch.kind === "link"
        ? [7, 5]
        : undefined;
    line(paper, stretch.points, { color: palette.plan, width: stretch.reverse ? 2.5 : 1.5, dash });
    for (const mark of marks) arrow(paper, mark.at, mark.angle, palette.plan, 4.5);
    // A short reversal gets its arrow as well: it is the one thing that surprises on the floor.
    if (stretch.reverse && marks.length === 0) {
      const [mark] = marksAlong(stretch.points, 0.1);
      if (mark) arrow(paper, mark.at, mark.angle, palette.plan, 4);
    }
  }
  for (const node of plan.nodes)
    disc(paper, node, 5, palette.halo, { color: palette.plan, width: 2 });
  const first = plan.path[0];
  const last = plan.path[plan.path.length - 1];
  if (first) disc(paper, first, 4, palette.plan);
  if (last) {
    const [x, y] = paper.at(last);
    ctx.fillStyle = palette.plan;
    ctx.fillRect(x - 4, y - 4, 8, 8);
  }
  ctx.restore();
}

/** Areas of MultiPolygon coordinates, hatched: what was missed. */
export function paintMissed(
  paper: Paper,
  polygons: readonly (readonly (readonly Point[])[])[],
): void {
  const { ctx, palette } = paper;
  for (const rings of polygons) {
    ctx.beginPath();
    for (const ring of rings) trace(paper, ring, true);
    ctx.fillStyle = hatching(paper, palette.noGo);
    ctx.fill("evenodd");
    ctx.strokeStyle = palette.noGo;
    ctx.lineWidth = palette.line;
    ctx.stroke();
  }
}
