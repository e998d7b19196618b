/** Site name, the five places, state, one primary action, STOP. */

import { shownSite } from "../map/scene";
import { dirty, saved, site } from "../state/draft";
import { format, PLACE_NAMES, PLACES, type Place } from "../core/address";
import { go, location } from "../state/location";
import { mission, snapshot, stale } from "../state/robot";
import { PrimaryAction } from "./primary";
import { StatePill } from "./statepill";

function target(place: Place): { place: Place; id: number | null; detail: null } {
  const needsSite = place === "draw" || place === "check";
  return { place, id: needsSite ? (saved.value?.id ?? null) : null, detail: null };
}

export function Places() {
  return (
    <nav class="places" aria-label="Places">
      {PLACES.map((place) => (
        <a
          key={place}
          href={format(target(place))}
          aria-current={location.value.place === place ? "page" : undefined}
          onClick={(event) => {
            if (event.metaKey || event.ctrlKey) return;
            event.preventDefault();
            go(target(place));
          }}
        >
          {PLACE_NAMES[place]}
        </a>
      ))}
    </nav>
  );
}

export function TopBar({ phone }: { phone: boolean }) {
  const drawing = location.value.place === "draw" || location.value.place === "check";
  const name = (drawing ? site.value.name : shownSite.value.name) || "No site";
  return (
    <header class="topbar panel">
      <h1 class="site-name" title={name}>
        {name}
        {drawing && dirty.value && <span class="unsaved"> · not saved</span>}
      </h1>
      {!phone && <Places />}
      <StatePill />
      <span class="reason" title={snapshot.value?.reason}>
        {mission.value === null || stale.value ? "" : snapshot.value?.reason}
      </span>
      {!phone && <PrimaryAction />}
    </header>
  );
}
