/** Check: what the robot would do, before a wheel turns. */

import type { PlanRecord } from "../api/types";
import { area, count, duration, length, percent } from "../core/format";
import { ringArea } from "../core/geometry";
import { saved, site } from "../state/draft";
import { go } from "../state/location";
import {
  chosenRoute,
  elsewhere,
  makePlan,
  options,
  outdated,
  plan,
  planAgain,
  planning,
  refusal,
  routeName,
  stopPlanning,
  waiting,
} from "../state/plan";
import { about, mission, snapshot, stale } from "../state/robot";
import {
  Busy,
  Button,
  Choice,
  Empty,
  Fact,
  Facts,
  Figure,
  NumberField,
  Section,
} from "../ui/controls";

function Options() {
  const vehicle = about.value?.model.vehicle;
  const set = (more: Partial<typeof options.value>) => {
    options.value = { ...options.value, ...more };
  };
  return (
    <Section title="Options" open={false}>
      <NumberField
        label="Tool width"
        optional
        lowest={0.01}
        value={options.value.tool_width}
        placeholder={length(vehicle?.tool_width)}
        onCommit={(tool_width) => set({ tool_width })}
      />
      <NumberField
        label="Clearance to walls"
        optional
        lowest={0}
        value={options.value.clearance}
        placeholder={length(vehicle?.clearance)}
        onCommit={(clearance) => set({ clearance })}
      />
      <NumberField
        label="Turning radius"
        optional
        lowest={0}
        value={options.value.min_turn_radius}
        placeholder={length(vehicle?.plan_turn_radius)}
        onCommit={(min_turn_radius) => set({ min_turn_radius })}
      />
      <p class="quiet">Empty: the robot's own value.</p>
    </Section>
  );
}

function Ask() {
  const routes = site.value.routes;
  const busy = planning.value !== null;
  return (
    <>
      <div class="buttons wide">
        <Button onClick={() => void makePlan("scan")} disabled={busy}>
          Scan area
        </Button>
        <Button
          onClick={() => void makePlan("route")}
          disabled={busy || chosenRoute.value === null}
          title={chosenRoute.value === null ? "The site has no route yet: draw one." : undefined}
        >
          Track route
        </Button>
      </div>
      {routes.length > 0 ? (
        <Choice
          label="Route"
          value={chosenRoute.value ?? ""}
          options={routes.map((route) => ({ value: route.name, text: route.name }))}
          onChange={(name) => {
            routeName.value = name;
          }}
        />
      ) : (
        <p class="quiet">No route is drawn yet; the area can be scanned without.</p>
      )}
      <Options />
    </>
  );
}

function Unreachable({ record }: { record: PlanRecord }) {
  if (record.unreachable.length === 0) return null;
  const by = new Map<string, { total: number; pieces: number }>();
  for (const { polygon, reason } of record.unreachable) {
    const sum = by.get(reason) ?? { total: 0, pieces: 0 };
    by.set(reason, { total: sum.total + ringArea(polygon), pieces: sum.pieces + 1 });
  }
  return (
    <Section title={`Not reachable: ${count(record.unreachable.length, "place")}`}>
      <ul class="problems">
        {[...by].map(([reason, { total, pieces }]) => (
          <li key={reason} class="no-go">
            {count(pieces, "place")}, {area(total)}: {reason}
          </li>
        ))}
      </ul>
    </Section>
  );
}

function Predicted({ record }: { record: PlanRecord }) {
  const { coverage, length: metres, duration: seconds, reversals, overlap } = record.predicted;
  const scan = record.mode === "scan";
  return (
    <>
      <Figure
        value={scan ? percent(coverage) : duration(seconds)}
        name={
          scan ? "of the reachable area would be covered" : `for the route “${record.route ?? ""}”`
        }
      />
      <Facts>
        <Fact name="Length">{length(metres)}</Fact>
        {scan && <Fact name="Duration">{duration(seconds)}</Fact>}
        {scan && <Fact name="Driven twice">{percent(overlap)}</Fact>}
        <Fact name="Reversals">{reversals}</Fact>
        <Fact name="Tool width">{length(record.tool_width)}</Fact>
        <Fact name="Clearance">{length(record.clearance)}</Fact>
        <Fact name="Turning radius">{length(record.min_turn_radius)}</Fact>
      </Facts>
      {record.notes.length > 0 && (
        <ul class="problems">
          {record.notes.map((note) => (
            <li key={note}>{note}</li>
          ))}
        </ul>
      )}
      <Unreachable record={record} />
    </>
  );
}

/** Why it cannot start right now, and the button that helps. */
function Hindrance() {
  const record = plan.value;
  const now = snapshot.value;
  if (!record || !now || stale.value || mission.value) return null;
  if (outdated.value) {
    return <p class="hint">The site was saved after this plan was made. Plan again.</p>;
  }
  if (waiting.value !== null) {
    return (
      <div class="hint">
        <Busy text="The robot looks for its place, then it starts." />
        {now.reason}
      </div>
    );
  }
  if (now.site_id !== record.site_id) {
    return <p class="hint">The robot works on another site; starting loads this one.</p>;
  }
  if (now.state === "fixing" || now.state === "lost")
    return <p class="hint">{now.reason || "The robot looks for its place."}</p>;
  return null;
}

export function Check() {
  if (!saved.value || site.value.boundary.length === 0) {
    return (
      <Empty text="There is no drawing to check yet.">
        <Button kind="primary" onClick={() => go({ place: "draw", id: saved.value?.id ?? null })}>
          Draw a site
        </Button>
      </Empty>
    );
  }
  return (
    <>
      <Ask />
      {planning.value && (
        <Busy text={planning.value}>
          <Button onClick={stopPlanning}>Stop planning</Button>
        </Busy>
      )}
      {refusal.value && (
        <div class="refusal" role="alert">
          {refusal.value}
          {elsewhere.value && plan.value && (
            <div class="buttons">
              <Button onClick={() => void planAgain()}>Plan again from here</Button>
            </div>
          )}
        </div>
      )}
      {plan.value && <Hindrance />}
      {plan.value ? (
        <Predicted record={plan.value} />
      ) : (
        !planning.value && (
          <p class="quiet">The plan is shown here and on the map before anything moves.</p>
        )
      )}
    </>
  );
}
