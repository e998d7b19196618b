/** Tools on the left: what to draw, undo and redo, save, and how to look at the map. */

import type { Kind } from "../core/site";
import { following, showAll, zoom } from "../map/view";
import { canRedo, canUndo, dirty, redo, saved, saving, undo } from "../state/draft";
import { saveDrawing, sketch, take, whole } from "../state/editor";
import { location } from "../state/location";
import { toggle, wanted } from "../state/precision";
import { IconButton } from "../ui/controls";

const TOOLS: { kind: Kind; label: string; key: string }[] = [
  { kind: "boundary", label: "Draw boundary", key: "B" },
  { kind: "island", label: "Draw island", key: "I" },
  { kind: "wall", label: "Draw wall", key: "W" },
  { kind: "nogo", label: "Draw no-go area", key: "N" },
  { kind: "landmark", label: "Place landmark", key: "L" },
  { kind: "route", label: "Draw route", key: "R" },
  { kind: "start", label: "Set start", key: "S" },
];

function DrawTools() {
  const active = sketch.value?.kind ?? null;
  return (
    <>
      <IconButton
        icon="select"
        label="Select"
        hint="Select and move (V)"
        pressed={active === null}
        onClick={() => take(null)}
      />
      {TOOLS.map(({ kind, label, key }) => (
        <IconButton
          key={kind}
          icon={kind}
          label={label}
          hint={`${label} (${key})`}
          pressed={active === kind}
          onClick={() => take(kind)}
        />
      ))}
      <hr />
      <IconButton
        icon="undo"
        label="Undo"
        hint="Undo (Ctrl+Z)"
        disabled={!canUndo.value}
        onClick={undo}
      />
      <IconButton
        icon="redo"
        label="Redo"
        hint="Redo (Shift+Ctrl+Z)"
        disabled={!canRedo.value}
        onClick={redo}
      />
      <IconButton
        icon="save"
        label="Save"
        hint="Save (Ctrl+S)"
        disabled={saving.value || !(dirty.value || whole.value || saved.value?.id === null)}
        onClick={saveDrawing}
      />
      <hr />
      <IconButton
        icon="precision"
        label="Precision"
        hint="How well the robot would know its place (P)"
        pressed={wanted.value}
        onClick={toggle}
      />
    </>
  );
}

export function ToolRail() {
  const { place } = location.value;
  return (
    <div class="rail panel" role="toolbar" aria-label="Tools" aria-orientation="vertical">
      {place === "draw" && <DrawTools />}
      <IconButton icon="fit" label="Show all" onClick={() => showAll(false)} />
      <IconButton icon="plus" label="Zoom in" onClick={() => zoom(1)} />
      <IconButton icon="minus" label="Zoom out" onClick={() => zoom(-1)} />
      {place === "drive" && (
        <IconButton
          icon="follow"
          label="Follow the robot"
          pressed={following.value}
          onClick={() => {
            following.value = !following.value;
          }}
        />
      )}
    </div>
  );
}
