/** The keyboard. Shift+Space stops the robot, wherever the focus is. */

import type { Kind } from "../core/site";
import { redo, removeSelected, select, selection, undo } from "./draft";
import { pressKey, saveDrawing, sketch, take } from "./editor";
import { location } from "./location";
import { toggle } from "./precision";
import { stop } from "./robot";

export const TOOL_KEYS: Record<string, Kind> = {
  b: "boundary",
  i: "island",
  w: "wall",
  n: "nogo",
  l: "landmark",
  r: "route",
  s: "start",
};

const inField = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement && target.matches("input, textarea, select, [contenteditable]");

const onButton = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement && target.matches("button, a, summary");

function handle(event: KeyboardEvent): boolean {
  if (event.code === "Space" && event.shiftKey) {
    if (!event.repeat) void stop();
    return true;
  }
  // A question on the screen is answered first.
  if (document.querySelector("[role=dialog]")) return false;
  if (location.value.place !== "draw") return false;
  const command = event.ctrlKey || event.metaKey;
  const key = event.key.toLowerCase();
  if (command && key === "s") {
    saveDrawing();
    return true;
  }
  if (inField(event.target)) return false;
  if (command && (key === "z" || key === "y")) {
    if (key === "y" || event.shiftKey) redo();
    else undo();
    return true;
  }
  if (command || event.altKey) return false;
  // With a drawing at hand its keys come first, also where a button still has the focus.
  if (
    sketch.value &&
    (sketch.value.points.length > 0 || !onButton(event.target) || event.key === "Escape")
  ) {
    if (pressKey(event.key)) return true;
  }
  if ((event.key === "Delete" || event.key === "Backspace") && selection.value) {
    removeSelected();
    return true;
  }
  if (event.key === "Escape") {
    select(null);
    return true;
  }
  if (TOOL_KEYS[key]) {
    take(TOOL_KEYS[key]);
    return true;
  }
  if (key === "p") {
    toggle();
    return true;
  }
  if (key === "v") {
    take(null);
    return true;
  }
  return false;
}

export function listen(): () => void {
  const down = (event: KeyboardEvent) => {
    if (!handle(event)) return;
    event.preventDefault();
    event.stopPropagation();
  };
  window.addEventListener("keydown", down, true);
  return () => window.removeEventListener("keydown", down, true);
}
