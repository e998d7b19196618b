/** The live robot: newest snapshot, its age, the trail of the mission, and commands. */

import { batch, computed, effect, signal, untracked } from "@preact/signals";
import * as api from "../api/client";
import { type Socket, Stream, streamAddress } from "../api/stream";
import type { About, PlanRecord, RobotState, Snapshot } from "../api/types";
import type { Point } from "../core/geometry";
import { asSite, type Site } from "../core/site";
import { extend, type Trail, trailOf } from "../core/trail";
import { doing, hush, say } from "./notice";

export const about = signal<About | null>(null);
export const snapshot = signal<Snapshot | null>(null);
/** Seconds since the newest snapshot; null before the first. Ticks four times a second. */
export const age = signal<number | null>(null);
export const STALE_AFTER = 1;
/** Nothing live may be believed. */
export const stale = computed(() => age.value === null || age.value > STALE_AFTER);

export const mission = computed(() => snapshot.value?.mission ?? null);
export const missionId = computed(() => mission.value?.run_id ?? null);

/** Grown in place; `trailVersion` counts its changes. */
export const trail: Trail = [];
export const measuredDots: Point[] = [];
export const trailVersion = signal(0);
/** When each landmark was last seen, on the robot's clock. */
export const seen = new Map<number, number>();

/** The plan and the site that the running mission works on. */
export const missionPlan = signal<PlanRecord | null>(null);
export const robotSite = signal<Site | null>(null);

const DOTS = 400;

export const STATE_WORDS: Record<RobotState, string> = {
  idle: "Idle",
  fixing: "Finding its place",
  ready: "Ready",
  running: "Running",
  paused: "Paused",
  stopped: "Stopped",
  lost: "Lost",
};

function take(next: Snapshot): void {
  batch(() => {
    snapshot.value = next;
    age.value = 0;
    for (const detection of next.detections) seen.set(detection.id, next.stamp);
    let grown = false;
    if (next.mission && next.pose) grown = extend(trail, [next.pose.x, next.pose.y]);
    const dot = next.measured;
    const last = measuredDots[measuredDots.length - 1];
    if (next.mission && dot && (!last || last[0] !== dot.x || last[1] !== dot.y)) {
      measuredDots.push([dot.x, dot.y]);
      if (measuredDots.length > DOTS) measuredDots.splice(0, measuredDots.length - DOTS);
      grown = true;
    }
    if (grown) trailVersion.value += 1;
  });
}

/** Forgets the trail of the last mission and fetches what this one drove before the page came. */
async function seed(runId: number, planId: number): Promise<void> {
  trail.splice(0);
  measuredDots.splice(0);
  trailVersion.value += 1;
  const [plan, track] = await Promise.all([
    api.readPlan(planId).catch(() => null),
    api.readTrack(runId).catch(() => null),
  ]);
  if (missionId.value !== runId) return;
  missionPlan.value = plan;
  // The robot keeps the version that it began with, whatever is saved meanwhile.
  if (plan) void readRobotSite();
  const driven = (track?.estimated ?? []).flatMap((row): Point[] =>
    row ? [[row[0], row[1]]] : [],
  );
  trail.unshift(...trailOf(driven));
  trailVersion.value += 1;
}

effect(() => {
  const runId = missionId.value;
  const planId = mission.peek()?.plan_id;
  if (runId !== null && planId !== undefined) untracked(() => void seed(runId, planId));
});

const robotSiteId = computed(() => snapshot.value?.site_id ?? about.value?.site_id ?? null);

/** Reads anew what the robot works on; after a save it may be another version. */
export async function readRobotSite(): Promise<void> {
  const id = robotSiteId.peek();
  const plan = missionId.peek() === null ? null : missionPlan.peek();
  const record =
    plan && plan.site_id === id
      ? api.readSiteVersion(plan.site_id, plan.site_version)
      : id === null
        ? null
        : api.readSite(id);
  const site = await Promise.resolve(record).catch(() => null);
  robotSite.value = site && asSite(site.site);
}

effect(() => {
  void robotSiteId.value;
  void missionId.value;
  untracked(() => void readRobotSite());
});

async function readAbout(): Promise<void> {
  about.value = await api.about().catch(() => about.value);
}

/** Opens the stream. Called once. */
export function connect(): void {
  const stream = new Stream({
    open: () => new WebSocket(streamAddress(window.location)) as unknown as Socket,
    onSnapshot: take,
  });
  void readAbout();
  setInterval(() => {
    stream.watch();
    age.value = stream.age();
    if (about.value === null && !stale.value) void readAbout();
    if (robotSite.value === null && robotSiteId.value !== null && !stale.value)
      void readRobotSite();
  }, 250);
}

// STOP

/** What became of the newest press on STOP; null before any and after it was released. */
export const stopping = signal<"asking" | "unreachable" | null>(null);
const ATTEMPTS = 8;

/** Emergency stop. Asks again until the robot has answered; only ever makes the robot stand. */
export async function stop(): Promise<void> {
  stopping.value = "asking";
  for (let attempt = 0; attempt < ATTEMPTS; attempt++) {
    try {
      await api.stopRobot();
      stopping.value = null;
      return;
    } catch {
      stopping.value = "unreachable";
      await new Promise((resolve) => setTimeout(resolve, 400));
    }
  }
  say("The robot did not get the stop. Use the button on the robot.", "fault");
}

effect(() => {
  if (!stale.value && stopping.value === "unreachable") stopping.value = null;
});

export const pause = () => doing("Pausing", api.pauseMission);
export const resume = () => doing("Resuming", api.resumeMission).then((ok) => ok && hush());
export const end = () => doing("Ending the run", api.endMission);
export const releaseStop = () => doing("Releasing the stop", api.clearStop);
export const useSite = (id: number) =>
  doing("Loading the site on the robot", () => api.loadRobotSite(id)).then((next) => {
    if (next) void readAbout().then(readRobotSite);
    return next !== null;
  });

// Simulation tools

/** What the next click on the map in Drive does. */
export const simulationTool = signal<"person" | "lift" | null>(null);
/** Half the width of a person who stands. */
export const PERSON_RADIUS = 0.2;

export const putPerson = ([x, y]: Point) =>
  doing("Putting a person there", () =>
    api.setObstacles([...(snapshot.value?.obstacles ?? []), { x, y, radius: PERSON_RADIUS }]),
  );
export const removePeople = () => doing("Removing the people", () => api.setObstacles([]));
export const liftTo = ([x, y]: Point, heading: number) =>
  doing("Putting the robot down", () => api.placeRobot(x, y, heading));
