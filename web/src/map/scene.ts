/** What is on the map in each place. A signal read here makes its layer paint again when it changes. */

import { computed } from "@preact/signals";
import type { PlanRecord } from "../api/types";
import type { Point } from "../core/geometry";
import type { Site } from "../core/site";
import { poseAt, trailOf } from "../core/trail";
import type { Paper } from "../paint/paper";
import { paintPrecision, paintSuggestions } from "../paint/precision";
import { paintMissed, paintPlan, paintUnreachable } from "../paint/plan";
import * as robot from "../paint/robot";
import { paintFloor, paintGrid, paintSite } from "../paint/site";
import { paintHandles, paintProblems, paintSketch } from "../paint/sketch";
import { check, selection, site } from "../state/draft";
import { sketch } from "../state/editor";
import { location } from "../state/location";
import { plan } from "../state/plan";
import { shownPrecision, suggestions } from "../state/precision";
import * as live from "../state/robot";
import { moment, run, runSite, shown, track } from "../state/runs";

/** A landmark counts as unseen after so many seconds. */
const UNSEEN_AFTER = 30;

/** The site that belongs to the place: the drawing, the robot's, or the run's. */
export const shownSite = computed<Site>(() => {
  const { place } = location.value;
  if (place === "drive" || place === "setup") return live.robotSite.value ?? site.value;
  if (place === "prove") return runSite.value ?? live.robotSite.value ?? site.value;
  return site.value;
});

const seenLately = computed(() => {
  const now = live.snapshot.value?.stamp ?? 0;
  const ids = [...live.seen].filter(([, stamp]) => now - stamp < UNSEEN_AFTER).map(([id]) => id);
  return ids.sort((a, b) => a - b).join(" ");
});

const suspected = computed(() => {
  const ids = (live.snapshot.value?.events ?? []).flatMap((event) => {
    const match = /^landmark_/.test(event.code) ? /landmark (\d+)/i.exec(event.text) : null;
    return match ? [Number(match[1])] : [];
  });
  return [...new Set(ids)].join(" ");
});

const numbers = (text: string) => new Set(text.split(" ").filter(Boolean).map(Number));

const shownPlan = computed<{ plan: PlanRecord; faint: boolean } | null>(() => {
  const { place } = location.value;
  if (place === "check" && plan.value) return { plan: plan.value, faint: false };
  if (place === "drive" && live.mission.value !== null && live.missionPlan.value) {
    return { plan: live.missionPlan.value, faint: true };
  }
  if (place === "prove" && run.value) return { plan: run.value.plan, faint: true };
  return null;
});

/** Grid, drawing, plan: changes only when somebody does something. */
export function paintGround(paper: Paper): void {
  const { place } = location.value;
  const map = shownSite.value;
  paintFloor(paper, map);
  if (shownPrecision.value) paintPrecision(paper, shownPrecision.value, map);
  paintGrid(paper);
  const planned = shownPlan.value;
  if (planned) {
    paintUnreachable(paper, planned.plan, place === "check");
    if (place === "prove") paintMissed(paper, run.value?.missed ?? []);
    paintPlan(paper, planned.plan, planned.faint);
  }
  const driving = place === "drive";
  paintSite(paper, map, {
    selection: selection.value,
    seen: driving ? numbers(seenLately.value) : null,
    suspected: driving ? numbers(suspected.value) : undefined,
    routes: place === "draw" || (place === "check" && !planned),
  });
}

/** The drawing at hand and its problems, above everything. */
export function paintDrawing(paper: Paper): void {
  if (location.value.place !== "draw") return;
  if (shownPrecision.value && suggestions.value) paintSuggestions(paper, suggestions.value);
  const at = selection.value;
  if (at && !sketch.value) paintHandles(paper, site.value, at);
  paintProblems(paper, check.value?.problems ?? []);
  if (sketch.value) paintSketch(paper, sketch.value);
}

export function paintLive(paper: Paper): void {
  const { place } = location.value;
  if (place === "prove") paintRecorded(paper);
  // A robot that works on another site would stand in the wrong map.
  else if (place !== "draw" || sharesSite()) paintNow(paper, place === "drive");
}

function sharesSite(): boolean {
  const mine = location.value.id;
  return mine !== null && mine === live.snapshot.value?.site_id;
}

function paintNow(paper: Paper, whole: boolean): void {
  const now = live.snapshot.value;
  if (!now) return;
  void live.trailVersion.value;
  const about = live.about.value;
  if (whole) {
    const scans = live.missionPlan.value?.mode === "scan";
    if (now.mission) {
      robot.paintCovered(
        paper,
        live.trail,
        scans ? (live.missionPlan.value?.tool_width ?? null) : null,
      );
      robot.paintTrail(paper, live.trail);
      robot.paintDots(paper, live.measuredDots);
    }
    if (now.pose && now.pan !== null && about) robot.paintView(paper, now.pose, now.pan, about);
    if (about) robot.paintProximity(paper, now, about);
    robot.paintObstacles(paper, now.obstacles);
    if (now.target && now.mission) robot.paintTarget(paper, now.target);
  }
  paper.ctx.save();
  // While somebody draws, the robot only says where it is.
  if (!whole) paper.ctx.globalAlpha = 0.5;
  if (now.pose) {
    const at: Point = [now.pose.x, now.pose.y];
    if (whole) robot.paintEllipse(paper, at, now.pose.covariance);
    robot.paintRobot(paper, at, now.pose.heading, about);
  }
  paper.ctx.restore();
  if (now.real && whole) {
    robot.paintReal(
      paper,
      [now.real.x, now.real.y],
      now.real.heading,
      about?.model.vehicle.body_radius ?? 0.14,
    );
  }
  if (whole && now.measured) robot.paintDots(paper, [[now.measured.x, now.measured.y]]);
}

const recorded = computed(() => {
  const rows = track.value;
  if (!rows) return null;
  const places = (list: readonly (readonly number[] | null)[]): Point[] =>
    list.flatMap((row) => (row ? [[row[0], row[1]] as Point] : []));
  return {
    rows,
    estimated: trailOf(places(rows.estimated)),
    real: trailOf(places(rows.real)),
    measured: rows.measured.map((row): Point => [row[1], row[2]]),
    target: places(rows.target),
  };
});

function paintRecorded(paper: Paper): void {
  const data = recorded.value;
  const record = run.value;
  if (!data || !record) return;
  const show = shown.value;
  robot.paintCovered(paper, data.estimated, record.mode === "scan" ? record.plan.tool_width : null);
  if (show.real) robot.paintTrail(paper, data.real, paper.palette.real);
  if (show.estimated) robot.paintTrail(paper, data.estimated);
  if (show.measured) robot.paintDots(paper, data.measured);
  const t = moment.value;
  if (t === null) return;
  const { rows } = data;
  const index = rows.t.findIndex((stamp) => stamp >= t);
  const target = rows.target[index < 0 ? rows.target.length - 1 : index];
  if (show.target && target) robot.paintTarget(paper, target);
  const estimated = poseAt(rows.t, rows.estimated, t);
  const real = poseAt(rows.t, rows.real, t);
  if (show.estimated && estimated) {
    robot.paintRobot(paper, [estimated[0], estimated[1]], estimated[2], live.about.value);
  }
  if (show.real && real) {
    robot.paintReal(
      paper,
      [real[0], real[1]],
      real[2],
      live.about.value?.model.vehicle.body_radius ?? 0.14,
    );
  }
}
