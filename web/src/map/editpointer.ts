/** Mouse and finger on the map: placing points, selecting, dragging, the simulation's tools. */

import PointerInteraction from "ol/interaction/Pointer";
import type OlMap from "ol/Map";
import type MapBrowserEvent from "ol/MapBrowserEvent";
import {
  direction,
  distance,
  edges,
  insideRing,
  middle,
  nearestOnSegment,
  type Point,
  rounded,
} from "../core/geometry";
import { isRing, type Selection, type Site, shapes, vertices, withVertices } from "../core/site";
import { type Snap, snap } from "../core/snap";
import { POLE_HEIGHT } from "../paint/site";
import * as draft from "../state/draft";
import { finishSketch, moveTo, placePoint, pointer, sketch } from "../state/editor";
import { location } from "../state/location";
import { liftTo, putPerson, simulationTool } from "../state/robot";

const CORNER = 10;
const EDGE = 7;
const FINGER = 1.8;

interface Drag {
  at: Selection;
  from: Site;
  grabbed: Point;
  moved: boolean;
}

const pointOf = (event: MapBrowserEvent): Point => [event.coordinate[0], event.coordinate[1]];
const resolutionOf = (event: MapBrowserEvent): number =>
  event.map.getView().getResolution() ?? 0.01;
const reachOf = (event: MapBrowserEvent): number => {
  const touch = (event.originalEvent as PointerEvent).pointerType === "touch";
  return resolutionOf(event) * (touch ? FINGER : 1);
};

/** The corner, or the point between two corners, of the selected thing that is under the pointer. */
function handleAt(site: Site, at: Selection, p: Point, reach: number): Selection | "insert" | null {
  const points = vertices(site, at);
  const vertex = points.findIndex((corner) => distance(corner, p) <= CORNER * reach);
  if (vertex >= 0) return { kind: at.kind, index: at.index, vertex };
  if (points.length < 2) return null;
  const between = edges(points, isRing(at.kind)).findIndex(
    ([a, b]) => distance(middle(a, b), p) <= EDGE * reach,
  );
  return between >= 0 ? "insert" : null;
}

/** The thing under the pointer: poles first, then lines, then what lies inside an area. */
export function thingAt(site: Site, p: Point, reach: number): Selection | null {
  const things = shapes(site);
  const near = things.find((at) => {
    const points = vertices(site, at);
    if (at.kind === "landmark") {
      const [[x, y]] = points;
      const height = p[1] - y;
      return (
        Math.abs(p[0] - x) <= CORNER * reach &&
        height >= -CORNER * reach &&
        height <= (POLE_HEIGHT + 6) * reach
      );
    }
    if (at.kind === "start") return distance(points[0], p) <= CORNER * reach;
    return edges(points, isRing(at.kind)).some(
      ([a, b]) => distance(nearestOnSegment(p, a, b), p) <= EDGE * reach,
    );
  });
  return (
    near ??
    things.find(
      (at) => (at.kind === "island" || at.kind === "nogo") && insideRing(p, vertices(site, at)),
    ) ??
    null
  );
}

export class EditPointer extends PointerInteraction {
  private dragged: Drag | null = null;
  private lifted: Point | null = null;

  /** Begins to listen; called once, with the map that it works on. */
  attach(map: OlMap): void {
    map.addInteraction(this);
    map.on("click", (event) => this.click(event as MapBrowserEvent));
    const viewport = map.getViewport();
    // The browser's own event: two quick clicks on different places are no double click.
    viewport?.addEventListener("dblclick", () => {
      if (location.value.place === "draw") finishSketch();
    });
    viewport?.addEventListener("pointerleave", () => {
      pointer.value = null;
    });
  }

  override handleMoveEvent(event: MapBrowserEvent): void {
    const at = pointOf(event);
    const { place } = location.value;
    const viewport = event.map.getViewport() as HTMLElement;
    if (place !== "draw") {
      pointer.value = { at, to: "" };
      viewport.style.cursor = place === "drive" && simulationTool.value ? "crosshair" : "";
      return;
    }
    if (sketch.value) {
      this.aim(event);
      viewport.style.cursor = "crosshair";
      return;
    }
    pointer.value = { at, to: "" };
    const reach = reachOf(event);
    const chosen = draft.selection.value;
    const handle = chosen && handleAt(draft.site.value, chosen, at, reach);
    const thing = thingAt(draft.site.value, at, reach);
    viewport.style.cursor = handle ? "move" : thing ? "pointer" : "";
  }

  override handleDownEvent(event: MapBrowserEvent): boolean {
    if (location.value.place !== "draw" || sketch.value) return false;
    const chosen = draft.selection.value;
    const p = pointOf(event);
    const reach = reachOf(event);
    const site = draft.site.value;
    if (!chosen) return false;
    const handle = handleAt(site, chosen, p, reach);
    if (handle === "insert") {
      const points = vertices(site, chosen);
      const vertex =
        edges(points, isRing(chosen.kind)).findIndex(
          ([a, b]) => distance(middle(a, b), p) <= EDGE * reach,
        ) + 1;
      const at = { kind: chosen.kind, index: chosen.index, vertex };
      this.dragged = { at, from: site, grabbed: p, moved: true };
      draft.drag(
        withVertices(site, at, [...points.slice(0, vertex), rounded(p), ...points.slice(vertex)]),
      );
      draft.select(at);
      return true;
    }
    const under = thingAt(site, p, reach);
    const same = under && under.kind === chosen.kind && under.index === chosen.index;
    if (!handle && !same) return false;
    const at = handle ?? { kind: chosen.kind, index: chosen.index };
    this.dragged = { at, from: site, grabbed: p, moved: false };
    return true;
  }

  override handleDragEvent(event: MapBrowserEvent): void {
    const drag = this.dragged;
    if (!drag) return;
    const p = pointOf(event);
    if (!drag.moved && distance(p, drag.grabbed) < 4 * resolutionOf(event)) return;
    drag.moved = true;
    const { at, from } = drag;
    const base = at.vertex === undefined ? from : draft.site.value;
    const points = vertices(base, at);
    if (at.vertex !== undefined || points.length === 1) {
      const to = this.snapped(event, p, at);
      const corner = at.vertex ?? 0;
      draft.drag(
        withVertices(
          base,
          at,
          points.map((old, i) => (i === corner ? rounded(to.point) : old)),
        ),
      );
      return;
    }
    // A whole shape: the corner nearest to the pointer is the one that snaps.
    const lead = points.reduce((a, b) =>
      distance(b, drag.grabbed) < distance(a, drag.grabbed) ? b : a,
    );
    const wanted: Point = [lead[0] + p[0] - drag.grabbed[0], lead[1] + p[1] - drag.grabbed[1]];
    const to = this.snapped(event, wanted, at).point;
    const [dx, dy] = [to[0] - lead[0], to[1] - lead[1]];
    draft.drag(
      withVertices(
        from,
        at,
        points.map(([x, y]) => rounded([x + dx, y + dy])),
      ),
    );
  }

  override handleUpEvent(): boolean {
    const drag = this.dragged;
    this.dragged = null;
    if (drag?.moved) draft.endDrag(drag.from);
    return false;
  }

  private snapped(
    event: MapBrowserEvent,
    p: Point,
    except: Selection | null,
    sketched: readonly Point[] = [],
  ): Snap {
    const free = (event.originalEvent as PointerEvent).altKey;
    const kind = sketch.value?.kind;
    const result = free
      ? { point: p, to: "" }
      : snap(draft.site.value, p, {
          resolution: resolutionOf(event),
          except,
          sketch: sketched,
          closes: kind !== undefined && isRing(kind),
        });
    pointer.value = { at: result.point, to: result.to };
    return result;
  }

  private aim(event: MapBrowserEvent): void {
    const to = this.snapped(event, pointOf(event), null, sketch.value?.points ?? []);
    moveTo(to.point, to.to);
  }

  private click(event: MapBrowserEvent): void {
    const { place } = location.value;
    const p = pointOf(event);
    if (place === "drive") this.simulate(p);
    if (place !== "draw") return;
    if (sketch.value) {
      this.aim(event);
      placePoint();
      return;
    }
    const reach = reachOf(event);
    const site = draft.site.value;
    const chosen = draft.selection.value;
    const handle = chosen && handleAt(site, chosen, p, reach);
    if (handle && handle !== "insert" && vertices(site, handle).length > 1) draft.select(handle);
    else if (handle !== "insert") draft.select(thingAt(site, p, reach));
  }

  private simulate(p: Point): void {
    const tool = simulationTool.value;
    if (tool === "person") {
      simulationTool.value = null;
      void putPerson(p);
    } else if (tool === "lift") {
      if (!this.lifted) {
        this.lifted = p;
        return;
      }
      void liftTo(this.lifted, direction(this.lifted, p));
      simulationTool.value = null;
    }
    if (simulationTool.value !== "lift") this.lifted = null;
  }
}
