/** An OpenLayers layer that paints itself, and only when it has to. */

import { effect } from "@preact/signals";
import Layer from "ol/layer/Layer";
import type { FrameState } from "ol/Map";
import type { Point } from "../core/geometry";
import { currentPalette } from "../paint/palette";
import type { Paper } from "../paint/paper";

export class CanvasLayer extends Layer {
  private readonly canvas = document.createElement("canvas");
  private painted = "";
  private wanted = 0;
  private forget: (() => void) | null = null;

  constructor(
    name: string,
    private readonly paint: (paper: Paper) => void,
  ) {
    super({ className: `map-${name}` });
    this.canvas.className = `map-canvas map-${name}`;
  }

  /** What is painted has changed. */
  refresh(): void {
    this.wanted += 1;
    this.changed();
  }

  dim(dimmed: boolean): void {
    this.canvas.classList.toggle("dimmed", dimmed);
  }

  override getSourceState(): "ready" {
    return "ready";
  }

  override render(frame: FrameState | null): HTMLElement {
    if (!frame) return this.canvas;
    const { size, pixelRatio, viewState } = frame;
    const { center, resolution } = viewState;
    const key = [...size, pixelRatio, ...center, resolution, this.wanted].join(" ");
    if (key === this.painted) return this.canvas;
    this.painted = key;
    const [width, height] = size;
    if (
      this.canvas.width !== Math.round(width * pixelRatio) ||
      this.canvas.height !== Math.round(height * pixelRatio)
    ) {
      this.canvas.width = Math.round(width * pixelRatio);
      this.canvas.height = Math.round(height * pixelRatio);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    const ctx = this.canvas.getContext("2d")!;
    ctx.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
    ctx.clearRect(0, 0, width, height);
    const left = center[0] - (width / 2) * resolution;
    const top = center[1] + (height / 2) * resolution;
    this.track(() =>
      this.paint({
        ctx,
        width,
        height,
        resolution,
        palette: currentPalette(),
        at: ([x, y]: Point): Point => [(x - left) / resolution, (top - y) / resolution],
        extent: [left, top - height * resolution, left + width * resolution, top],
      }),
    );
    return this.canvas;
  }

  /** Paints, and paints again once any signal that was read meanwhile changes. */
  private track(paint: () => void): void {
    this.forget?.();
    let painting = true;
    this.forget = effect(() => {
      if (painting) paint();
      else this.refresh();
      painting = false;
    });
  }
}
