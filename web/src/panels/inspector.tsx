/** The panel of the place: on the right of a desk's screen, a sheet from below on a phone. */

import { signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { Check } from "../places/check";
import { Draw } from "../places/draw";
import { Drive } from "../places/drive";
import { Prove } from "../places/prove";
import { SetUp } from "../places/setup";
import { PLACE_NAMES } from "../core/address";
import { selection } from "../state/draft";
import { location } from "../state/location";
import { IconButton } from "../ui/controls";
import { PrimaryAction } from "./primary";
import { StripLine } from "./timestrip";

/** The panel's contents, from their beginning whenever it shows something else. */
function Body() {
  const box = useRef<HTMLDivElement>(null);
  const { place, id } = location.value;
  const at = selection.value;
  const shown = `${place} ${id} ${at ? `${at.kind}${at.index}` : ""}`;
  useLayoutEffect(() => {
    if (box.current) box.current.scrollTop = 0;
  }, [shown]);
  return (
    <div class="inspector-body" ref={box}>
      <Content />
    </div>
  );
}

const collapsed = signal(false);

function Content() {
  switch (location.value.place) {
    case "draw":
      return <Draw />;
    case "check":
      return <Check />;
    case "drive":
      return <Drive />;
    case "prove":
      return <Prove />;
    case "setup":
      return <SetUp />;
  }
}

export function Inspector() {
  const name = PLACE_NAMES[location.value.place];
  return (
    <aside class={`inspector panel ${collapsed.value ? "collapsed" : ""}`} aria-label={name}>
      <div class="inspector-head">
        <h2>{name}</h2>
        <IconButton
          icon={collapsed.value ? "plus" : "minus"}
          label={collapsed.value ? "Show the panel" : "Hide the panel"}
          onClick={() => {
            collapsed.value = !collapsed.value;
          }}
        />
      </div>
      {!collapsed.value && <Body />}
    </aside>
  );
}

/** Shares of the window that the sheet takes. */
const DETENTS = [0.14, 0.42, 0.78];
const detent = signal(1);

function Handle({ children }: { children: ComponentChildren }) {
  const start = useRef<{ y: number; share: number } | null>(null);
  const [share, setShare] = useState<number | null>(null);
  const shown = share ?? DETENTS[detent.value];
  const step = (by: number) => {
    detent.value = Math.min(DETENTS.length - 1, Math.max(0, detent.value + by));
  };
  return (
    <section
      class={`sheet panel ${share === null ? "" : "dragged"}`}
      style={{ height: `${shown * 100}dvh` }}
      aria-label={PLACE_NAMES[location.value.place]}
    >
      <button
        type="button"
        class="sheet-handle"
        aria-label={detent.value < 2 ? "Pull the sheet up" : "Push the sheet down"}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          start.current = { y: event.clientY, share: shown };
        }}
        onPointerMove={(event) => {
          if (!start.current) return;
          const next = start.current.share + (start.current.y - event.clientY) / window.innerHeight;
          setShare(Math.min(DETENTS[2], Math.max(DETENTS[0], next)));
        }}
        onPointerUp={(event) => {
          const from = start.current;
          start.current = null;
          if (!from || Math.abs(event.clientY - from.y) < 6) {
            detent.value = (detent.value + 1) % DETENTS.length;
          } else {
            const near = DETENTS.map((level) => Math.abs(level - shown));
            detent.value = near.indexOf(Math.min(...near));
          }
          setShare(null);
        }}
        onKeyDown={(event) => {
          if (event.key === "ArrowUp") step(1);
          else if (event.key === "ArrowDown") step(-1);
          else if (event.key === "Enter" || event.key === " ")
            detent.value = (detent.value + 1) % DETENTS.length;
          else return;
          event.preventDefault();
        }}
      />
      {children}
    </section>
  );
}

export function Sheet() {
  return (
    <Handle>
      <StripLine />
      <div class="sheet-primary">
        <PrimaryAction />
      </div>
      <Body />
    </Handle>
  );
}
