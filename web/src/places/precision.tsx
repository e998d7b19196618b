/** The part of Draw about precision: what the colours say, and where more landmarks would help. */

import { count, degrees, fine, length, percent } from "../core/format";
import { classNames, whyNot } from "../core/precision";
import {
  accept,
  asking,
  dropSuggestions,
  here,
  howMany,
  precision,
  proposed,
  suggesting,
  suggestions,
  suggestPlaces,
  suggestTrouble,
  toggle,
  trouble,
  wanted,
} from "../state/precision";
import { Busy, Button, Fact, Facts, Figure, IconButton, NumberField } from "../ui/controls";

/** A colour as it looks on the floor, which shines through. */
const blended = (shade: number) =>
  `color-mix(in srgb, var(--heat-${shade}) calc(var(--heat-alpha) * 100%), var(--map-floor))`;

function Legend() {
  const map = precision.value;
  if (!map) return null;
  return (
    <ul class="legend heat" aria-label="Colours: error in centimetres">
      {classNames(map.classes, map.limit).map((name, i) => (
        <li key={name}>
          <span class="swatch" style={{ background: blended(i + 1) }} />
          {name} cm
        </li>
      ))}
      <li>
        <span class="swatch blind" />
        no fix here
      </li>
    </ul>
  );
}

function Here() {
  const spot = here.value;
  const text = !spot
    ? "–"
    : whyNot(spot.reason) || `${fine(spot.position)}, ${degrees(spot.heading, 1)}`;
  return <Fact name="Under the pointer">{text}</Fact>;
}

function Proposed() {
  const found = suggestions.value;
  if (!found) return null;
  const all = found.suggestions.map((_, i) => i);
  return (
    <>
      <ol class="proposed" aria-label="Suggested places">
        {found.suggestions.map((one, i) => (
          <li key={`${one.x} ${one.y}`}>
            <span>
              {i + 1}: {length(one.x)}, {length(one.y)}
              <br />
              <span class="quiet">
                {fine(one.overall)} on average, fix {percent(one.coverage)}
              </span>
            </span>
            <Button onClick={() => accept([i])}>Add landmark</Button>
          </li>
        ))}
      </ol>
      <p class="quiet">
        Before: {fine(found.before.overall)}, what has no fix counted as {fine(found.before.limit)}.
        Not even the best {count(proposed.value, "place")} of all {found.places} along the walls
        could bring it below {fine(found.overall_bound)}.
      </p>
      <div class="buttons">
        {all.length > 1 && <Button onClick={() => accept(all)}>Add all landmarks</Button>}
        <Button kind="subtle" onClick={dropSuggestions}>
          Drop suggestions
        </Button>
      </div>
    </>
  );
}

export function Precision() {
  if (!wanted.value) return null;
  const map = precision.value;
  return (
    <section class="precision" aria-label="Precision">
      <div class="row">
        <h3>Precision</h3>
        <IconButton icon="close" label="Hide precision" onClick={toggle} />
      </div>
      {trouble.value && <p class="hint">{trouble.value}</p>}
      {!map && asking.value && <Busy text="Working out the precision" />}
      {map && (
        <>
          <Figure
            value={fine(map.mean_position)}
            name="mean error of the position, where a fix is possible"
          />
          <Legend />
          <Facts>
            <Here />
            <Fact name="At worst">{fine(map.worst_position)}</Fact>
            <Fact name="Heading, mean">{degrees(map.mean_heading, 1)}</Fact>
            <Fact name="A fix is possible">{percent(map.coverage)}</Fact>
          </Facts>
          {suggesting.value ? (
            <Busy text="Comparing places along the walls" />
          ) : (
            !suggestions.value && (
              <div class="ask">
                <NumberField
                  label="More landmarks"
                  unit="count"
                  lowest={1}
                  value={howMany.value}
                  onCommit={(n) => {
                    if (n !== null) howMany.value = n;
                  }}
                />
                <Button onClick={() => void suggestPlaces()}>Suggest places</Button>
              </div>
            )
          )}
          {suggestTrouble.value && <p class="hint">{suggestTrouble.value}</p>}
          <Proposed />
        </>
      )}
    </section>
  );
}
