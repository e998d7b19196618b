/** The one thing to do next. A running mission comes first, in every place. */

import { saved, site } from "../state/draft";
import { go, location } from "../state/location";
import { outdated, plan, planning, start, startLabel, stopWaiting, waiting } from "../state/plan";
import { mission, pause, releaseStop, resume, snapshot, stale } from "../state/robot";
import { Button } from "../ui/controls";

export function PrimaryAction() {
  const state = snapshot.value?.state;
  const { place } = location.value;
  if (!stale.value && state === "stopped") {
    return (
      <Button
        kind="primary"
        onClick={releaseStop}
        title="The robot stays where it is until you resume."
      >
        Release stop
      </Button>
    );
  }
  if (!stale.value && mission.value !== null) {
    return state === "paused" || state === "lost" ? (
      <Button kind="primary" icon="play" onClick={resume}>
        Resume
      </Button>
    ) : (
      <Button kind="primary" icon="pause" onClick={pause}>
        Pause
      </Button>
    );
  }
  if (place === "check" && waiting.value !== null) {
    return (
      <Button kind="primary" onClick={stopWaiting}>
        Do not start
      </Button>
    );
  }
  if (place === "check" && plan.value) {
    return (
      <Button
        kind="primary"
        onClick={start}
        disabled={stale.value || planning.value !== null || outdated.value}
      >
        {startLabel.value}
      </Button>
    );
  }
  if (place === "draw" && saved.value) {
    const unsaved = saved.value.id === null;
    return (
      <Button
        kind="primary"
        onClick={() => go({ place: "check", id: saved.value?.id ?? null })}
        disabled={unsaved || site.value.boundary.length === 0}
        title={unsaved ? "Draw the boundary and save first." : undefined}
      >
        Check this site
      </Button>
    );
  }
  if (place === "drive" && !stale.value) {
    return (
      <Button kind="primary" onClick={() => go({ place: "check", id: saved.value?.id ?? null })}>
        Choose a job
      </Button>
    );
  }
  return null;
}
