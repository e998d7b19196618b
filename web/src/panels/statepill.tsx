/** What the robot is about, in one word and one colour; hatched when that cannot be known. */

import { age, STATE_WORDS, snapshot, stale } from "../state/robot";

export function StatePill() {
  const now = snapshot.value;
  if (stale.value) {
    const seconds = age.value === null ? "" : ` · ${Math.floor(age.value)} s`;
    return (
      <output class="pill stale" title="No news from the robot: what is shown of it is old.">
        No connection{seconds}
      </output>
    );
  }
  const state = now?.state ?? "idle";
  return (
    <output class={`pill ${state}`} title={now?.reason}>
      {STATE_WORDS[state]}
    </output>
  );
}
