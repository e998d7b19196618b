/** Draw: the sites, what is selected, and what has to be mended. */

import { area, count, length } from "../core/format";
import { distance, edges, pathLength, ringArea } from "../core/geometry";
import {
  fewest,
  isRing,
  landmarkCode,
  nextLandmarkId,
  removed,
  type Selection,
  type Site,
  shapes,
  title,
  vertices,
  withVertices,
} from "../core/site";
import { change, check, removeSelected, saved, select, selection, site } from "../state/draft";
import { take } from "../state/editor";
import {
  Button,
  Empty,
  Fact,
  Facts,
  IconButton,
  NumberField,
  Section,
  TextField,
} from "../ui/controls";
import { Precision } from "./precision";
import { SiteList } from "./sitelist";

/** More corners than this are edited on the map. */
const LONGEST_LIST = 40;

function Corners({ drawn, at }: { drawn: Site; at: Selection }) {
  const points = vertices(drawn, at);
  const set = (i: number, axis: 0 | 1, value: number | null) => {
    if (value === null) return;
    change(
      withVertices(
        drawn,
        at,
        points.map((p, j) => (j !== i ? p : axis === 0 ? [value, p[1]] : [p[0], value])),
      ),
    );
  };
  if (points.length > LONGEST_LIST)
    return <p class="quiet">{points.length} corners: move them on the map.</p>;
  return (
    <ol class="corners">
      {points.map((p, i) => (
        <li
          key={i}
          class={at.vertex === i ? "picked" : ""}
          onFocusIn={() => at.vertex !== i && select({ ...at, vertex: i })}
        >
          <NumberField label={`${i + 1}: x`} value={p[0]} onCommit={(value) => set(i, 0, value)} />
          <NumberField label="y" value={p[1]} onCommit={(value) => set(i, 1, value)} />
          <IconButton
            icon="close"
            label={`Remove corner ${i + 1}`}
            disabled={points.length <= fewest(at.kind)}
            onClick={() => {
              change(removed(drawn, { ...at, vertex: i }));
              select({ kind: at.kind, index: at.index });
            }}
          />
        </li>
      ))}
    </ol>
  );
}

function EdgeLength({ drawn, at }: { drawn: Site; at: Selection }) {
  const points = vertices(drawn, at);
  const vertex = at.vertex;
  if (vertex === undefined || points.length < 2) return null;
  const next = isRing(at.kind) ? (vertex + 1) % points.length : vertex + 1;
  if (next >= points.length) return null;
  const [a, b] = [points[vertex], points[next]];
  const apart = distance(a, b);
  return (
    <NumberField
      label={`From ${vertex + 1} to ${next + 1}`}
      value={apart}
      lowest={0.001}
      onCommit={(value) => {
        if (value === null || apart === 0) return;
        const scale = value / apart;
        const moved: [number, number] = [
          a[0] + (b[0] - a[0]) * scale,
          a[1] + (b[1] - a[1]) * scale,
        ];
        change(
          withVertices(
            drawn,
            at,
            points.map((p, i) => (i === next ? moved : p)),
          ),
        );
      }}
    />
  );
}

function LandmarkFields({ drawn, index }: { drawn: Site; index: number }) {
  const mark = drawn.landmarks[index];
  const set = (more: Partial<typeof mark>) =>
    change({
      ...drawn,
      landmarks: drawn.landmarks.map((old, i) => (i === index ? { ...old, ...more } : old)),
    });
  const code = landmarkCode(mark.id, mark.bits ?? 4);
  return (
    <>
      <div class="pair">
        <NumberField
          label="Number"
          unit="count"
          lowest={1}
          value={mark.id}
          onCommit={(id) => id !== null && set({ id })}
        />
        <NumberField label="x" value={mark.x} onCommit={(x) => x !== null && set({ x })} />
        <NumberField label="y" value={mark.y} onCommit={(y) => y !== null && set({ y })} />
      </div>
      <div class="code" role="img" aria-label={`Stripes from the top: ${code}`}>
        {[...code].map((bit, i) => (
          <span key={i} class={bit === "1" ? "bright" : "dark"} />
        ))}
      </div>
      <p class="quiet">
        {drawn.landmarks.filter((other) => other.id === mark.id).length > 1
          ? `Number ${mark.id} stands twice. Free is ${nextLandmarkId(drawn)}.`
          : "Stripes from the top, on the left."}
      </p>
    </>
  );
}

function StartFields({ drawn }: { drawn: Site }) {
  const start = drawn.start;
  if (!start) return null;
  const [x, y, heading] = start;
  const set = (nx: number, ny: number, nh: number | null | undefined) =>
    change({ ...drawn, start: nh === null || nh === undefined ? [nx, ny] : [nx, ny, nh] });
  return (
    <div class="pair">
      <NumberField label="x" value={x} onCommit={(v) => v !== null && set(v, y, heading)} />
      <NumberField label="y" value={y} onCommit={(v) => v !== null && set(x, v, heading)} />
      <NumberField
        label="Heading"
        unit="angle"
        optional
        value={heading ?? null}
        onCommit={(v) => set(x, y, v)}
      />
    </div>
  );
}

function RouteFields({ drawn, index }: { drawn: Site; index: number }) {
  const route = drawn.routes[index];
  const set = (next: typeof route) =>
    change({ ...drawn, routes: drawn.routes.map((old, i) => (i === index ? next : old)) });
  const { heading, ...rest } = route;
  return (
    <>
      <TextField label="Name" value={route.name} onCommit={(name) => set({ ...route, name })} />
      <NumberField
        label="Heading at the end"
        unit="angle"
        optional
        value={heading ?? null}
        onCommit={(value) => set(value === null ? rest : { ...rest, heading: value })}
      />
    </>
  );
}

function Selected({ drawn, at }: { drawn: Site; at: Selection }) {
  const points = vertices(drawn, at);
  return (
    <>
      <div class="row">
        <h3>{title(drawn, at)}</h3>
        <IconButton icon="close" label="Deselect" onClick={() => select(null)} />
      </div>
      {at.kind === "route" && <RouteFields drawn={drawn} index={at.index} />}
      {at.kind === "landmark" && <LandmarkFields drawn={drawn} index={at.index} />}
      {at.kind === "start" && <StartFields drawn={drawn} />}
      {points.length > 1 && (
        <>
          <Facts>
            <Fact name="Length">{length(pathLength(points, isRing(at.kind)))}</Fact>
            {isRing(at.kind) && <Fact name="Area">{area(ringArea(points))}</Fact>}
            <Fact name="Corners">{points.length}</Fact>
          </Facts>
          <EdgeLength drawn={drawn} at={at} />
          <Corners drawn={drawn} at={at} />
        </>
      )}
      <Button icon="trash" onClick={removeSelected}>
        {at.vertex === undefined
          ? `Delete ${title(drawn, at).toLowerCase()}`
          : `Delete corner ${at.vertex + 1}`}
      </Button>
    </>
  );
}

function Problems() {
  const answer = check.value;
  if (!answer || (answer.problems.length === 0 && answer.repairs.length === 0)) return null;
  return (
    <ul class="problems" aria-label="What to mend">
      {answer.problems.map((problem) => (
        <li key={problem.message} class="fault">
          {problem.message}
        </li>
      ))}
      {answer.repairs.map((repair) => (
        <li key={repair}>{repair}</li>
      ))}
    </ul>
  );
}

/** The next thing that this site lacks. */
function NextStep({ drawn }: { drawn: Site }) {
  if (drawn.boundary.length === 0) {
    return (
      <Empty text="Nothing is drawn yet. Begin with the line that the robot must not cross.">
        <Button onClick={() => take("boundary")}>Begin the boundary</Button>
      </Empty>
    );
  }
  if (drawn.landmarks.length < 2) {
    return (
      <Empty text="The robot needs at least two landmarks to find its place; four and more make it exact.">
        <Button onClick={() => take("landmark")}>Add landmarks</Button>
      </Empty>
    );
  }
  return null;
}

function Overview({ drawn }: { drawn: Site }) {
  const floor =
    ringArea(drawn.boundary) - drawn.islands.reduce((sum, ring) => sum + ringArea(ring), 0);
  return (
    <>
      <TextField
        label="Name of the site"
        value={drawn.name}
        onCommit={(name) => change({ ...drawn, name })}
      />
      {drawn.boundary.length > 0 && (
        <Facts>
          <Fact name="Floor">{area(floor)}</Fact>
          <Fact name="Longest edge">
            {length(Math.max(...edges(drawn.boundary, true).map(([a, b]) => distance(a, b))))}
          </Fact>
          <Fact name="Drawn">
            {count(drawn.islands.length, "island")}, {count(drawn.walls.length, "wall")}
            {drawn.no_go.length > 0 && `, ${count(drawn.no_go.length, "no-go area")}`}
          </Fact>
          <Fact name="Landmarks">{drawn.landmarks.length}</Fact>
        </Facts>
      )}
      <NextStep drawn={drawn} />
      {drawn.boundary.length > 0 && (
        <Section title="Things" open={false}>
          <ul class="things">
            {shapes(drawn).map((at) => (
              <li key={`${at.kind}${at.index}`}>
                <button type="button" class="link" onClick={() => select(at)}>
                  {title(drawn, at)}
                </button>
              </li>
            ))}
          </ul>
        </Section>
      )}
    </>
  );
}

export function Draw() {
  const at = selection.value;
  const drawn = site.value;
  if (!saved.value) return <SiteList />;
  return (
    <>
      <Problems />
      {at && <Selected drawn={drawn} at={at} />}
      <Precision />
      {!at && <Overview drawn={drawn} />}
      {!at && <SiteList />}
    </>
  );
}
