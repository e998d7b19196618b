/** The page: a map under everything, panels over it, STOP above all. */

import { effect, signal, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { mount } from "./map/view";
import { Inspector, Sheet } from "./panels/inspector";
import { StopButton } from "./panels/stop";
import { TimeStrip } from "./panels/timestrip";
import { ToolRail } from "./panels/toolrail";
import { Places, TopBar } from "./panels/topbar";
import { Conflict } from "./places/conflict";
import { newSite, openSite, openUnsaved, saved, unsavedSites } from "./state/draft";
import { NEW_ID } from "./core/address";
import { go, location } from "./state/location";
import { about } from "./state/robot";
import { refreshSites, sites } from "./state/sites";

const narrow = window.matchMedia("(max-width: 819px)");
const phone = signal(narrow.matches);
narrow.addEventListener("change", () => {
  phone.value = narrow.matches;
});

/** Back at a site that was never saved: the one on the table, else the last one that was begun. */
function openNewest(): void {
  if (saved.value?.id === null) return;
  const last = unsavedSites().pop();
  if (last) openUnsaved(last.key);
  else newSite();
}

/** The address may name a site; else the robot's own is opened, else the first, else a new one. */
function openWhatIsAsked(): void {
  const { place, id } = location.value;
  const wanted = place === "draw" || place === "check" ? id : null;
  if (wanted === NEW_ID) {
    untracked(openNewest);
    return;
  }
  if (wanted !== null) {
    untracked(() => void openSite(wanted));
    return;
  }
  if (saved.peek() !== null) {
    const known = saved.peek()?.id ?? NEW_ID;
    if (place === "draw" || place === "check") untracked(() => go({ id: known }, true));
    return;
  }
  const list = sites.value;
  if (list === null) return;
  const own = list.find((summary) => summary.id === about.value?.site_id) ?? list[0];
  if (own) untracked(() => void openSite(own.id).then(() => saved.peek() && openWhatIsAsked()));
  else if (place === "draw") untracked(() => newSite());
}

export function App() {
  const target = useRef<HTMLDivElement>(null);
  useEffect(() => (target.current ? mount(target.current) : undefined), []);
  useEffect(() => effect(openWhatIsAsked), []);
  useEffect(() => {
    void refreshSites();
    const timer = setInterval(() => {
      if (sites.value === null) void refreshSites();
    }, 2_000);
    // Others may have drawn meanwhile.
    const back = () => document.hidden || void refreshSites();
    document.addEventListener("visibilitychange", back);
    window.addEventListener("focus", back);
    return () => {
      clearInterval(timer);
      document.removeEventListener("visibilitychange", back);
      window.removeEventListener("focus", back);
    };
  }, []);
  return (
    <div class={`app ${phone.value ? "phone" : "desk"} in-${location.value.place}`}>
      <div class="map" ref={target} role="application" aria-label="Map" />
      <TopBar phone={phone.value} />
      <ToolRail />
      {phone.value ? <Sheet /> : <Inspector />}
      {!phone.value && <TimeStrip />}
      {phone.value && (
        <div class="tabs panel">
          <Places />
        </div>
      )}
      <Conflict />
      <StopButton />
    </div>
  );
}
