/** The map: metres on a plane, three layers that paint themselves, and how to look at them. */

import { effect, signal } from "@preact/signals";
import { defaults } from "ol/interaction/defaults";
import OlMap from "ol/Map";
import Projection from "ol/proj/Projection";
import View from "ol/View";
import type { Point } from "../core/geometry";
import { siteBounds } from "../core/site";
import { opened } from "../state/draft";
import { resolution } from "../state/editor";
import { location } from "../state/location";
import { snapshot, stale } from "../state/robot";
import { run } from "../state/runs";
import { CanvasLayer } from "./canvaslayer";
import { EditPointer } from "./editpointer";
import { paintDrawing, paintGround, paintLive, shownSite } from "./scene";

/** Local metres; no place on Earth. */
const metres = new Projection({ code: "POLEPILOT:metres", units: "m", global: false });

/** Whether the map keeps the robot in the middle. */
export const following = signal(false);

const ground = new CanvasLayer("ground", paintGround);
const live = new CanvasLayer("live", paintLive);
const drawing = new CanvasLayer("drawing", paintDrawing);

const reduced = window.matchMedia("(prefers-reduced-motion: reduce)");
const duration = () => (reduced.matches ? 0 : 150);

const view = new View({
  projection: metres,
  center: [4, 3],
  resolution: 0.01,
  minResolution: 0.0005,
  maxResolution: 2,
  enableRotation: false,
  smoothResolutionConstraint: false,
});

export const map = new OlMap({
  controls: [],
  interactions: defaults({
    doubleClickZoom: false,
    altShiftDragRotate: false,
    pinchRotate: false,
    keyboard: false,
    zoomDuration: duration(),
  }),
  layers: [ground, live, drawing],
  view,
  moveTolerance: 6,
});

new EditPointer().attach(map);

/** What the panels leave free: top, right, bottom, left. */
function padding(): [number, number, number, number] {
  return window.innerWidth < 820
    ? [164, 24, Math.round(window.innerHeight * 0.46), 24]
    : [88, 376, 88, 88];
}

/** Shows the whole site. */
export function showAll(quickly = true): void {
  const box = siteBounds(shownSite.peek());
  following.value = false;
  if (!box || !map.getSize()) return;
  const [left, bottom, right, top] = box;
  const spare = Math.max(0.3, 0.03 * Math.max(right - left, top - bottom));
  view.fit([left - spare, bottom - spare, right + spare, top + spare], {
    padding: padding(),
    duration: quickly ? 0 : duration(),
    maxZoom: 40,
  });
}

export const zoom = (steps: number): void =>
  view.animate({ resolution: (view.getResolution() ?? 0.01) * 2 ** -steps, duration: duration() });

/** Where a place of the map is on the page, or null while there is no map. */
export function pixelOf(at: Point): Point | null {
  map.renderSync();
  const pixel = map.getPixelFromCoordinate(at);
  const box = map.getViewport()?.getBoundingClientRect();
  return pixel && box ? [pixel[0] + box.left, pixel[1] + box.top] : null;
}

export function mount(target: HTMLElement): () => void {
  map.setTarget(target);
  showAll();
  let fitted = false;
  const stops = [
    effect(() => live.dim(stale.value && location.value.place !== "prove")),
    effect(() => {
      // The first site that there is to see: in Drive it comes before the one on the table.
      if (fitted || !siteBounds(shownSite.value)) return;
      fitted = true;
      requestAnimationFrame(() => showAll());
    }),
    effect(() => {
      void opened.value;
      requestAnimationFrame(() => showAll());
    }),
    effect(() => {
      if (run.value) requestAnimationFrame(() => showAll());
    }),
    effect(() => {
      const pose = snapshot.value?.pose;
      if (following.value && pose && !stale.value) view.setCenter([pose.x, pose.y]);
    }),
  ];
  const zoomed = () => {
    resolution.value = view.getResolution() ?? 0.01;
  };
  zoomed();
  view.on("change:resolution", zoomed);
  const letGo = () => {
    following.value = false;
  };
  map.on("pointerdrag", letGo);
  return () => {
    for (const stop of stops) stop();
    view.un("change:resolution", zoomed);
    map.un("pointerdrag", letGo);
    map.setTarget(undefined);
  };
}
