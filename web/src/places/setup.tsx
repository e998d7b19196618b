/** Set up: the robot's parts, its link and loop, the site it works on, and the look of this page. */

import { count, degrees, duration, length, milliseconds, percent, volts } from "../core/format";
import { about, age, snapshot, stale, useSite } from "../state/robot";
import { sites } from "../state/sites";
import { THEMES, type Theme, theme } from "../state/theme";
import { Button, Choice, Fact, Facts, Section } from "../ui/controls";

const THEME_WORDS: Record<Theme, string> = {
  auto: "Like this device",
  light: "Light",
  dark: "Dark",
  sun: "Bright sun",
};

const LINK_WORDS: Record<string, string> = {
  closed: "Closed",
  connecting: "Connecting",
  idle: "Idle",
  armed: "Armed",
  link_lost: "Lost",
  estop: "Emergency stop",
};

function RobotSite() {
  const id = snapshot.value?.site_id ?? null;
  const list = sites.value ?? [];
  const name = list.find((summary) => summary.id === id)?.name ?? "–";
  return (
    <Section title="Site of the robot">
      <p>
        The robot works on <strong>{name}</strong>.
      </p>
      <ul class="sites">
        {list
          .filter((summary) => summary.id !== id)
          .map((summary) => (
            <li key={summary.id}>
              <span>{summary.name}</span>
              <Button onClick={() => void useSite(summary.id)} disabled={stale.value}>
                Load
              </Button>
            </li>
          ))}
      </ul>
    </Section>
  );
}

function Link() {
  const now = snapshot.value;
  return (
    <Section title="Link and loop">
      <Facts>
        <Fact name="Page to robot">
          {age.value === null ? "–" : stale.value ? `silent for ${duration(age.value)}` : "live"}
        </Fact>
        <Fact name="Microcontroller">{now ? LINK_WORDS[now.link.state] : "–"}</Fact>
        <Fact name="Telemetry age">{milliseconds(now?.link.age)}</Fact>
        <Fact name="Round trip">{milliseconds(now?.link.round_trip)}</Fact>
        <Fact name="Packets">{now ? `${now.link.sent} sent, ${now.link.lost} lost` : "–"}</Fact>
        <Fact name="Bad checksums">{now?.link.crc_errors ?? "–"}</Fact>
        <Fact name="Loop">
          {now ? `${now.loop.rate.toFixed(1)} per s, ${percent(now.loop.busy)} busy` : "–"}
        </Fact>
        <Fact name="Lateness, 99 %">{milliseconds(now?.loop.lateness_p99)}</Fact>
        <Fact name="Battery">{volts(now?.battery)}</Fact>
      </Facts>
    </Section>
  );
}

function Model() {
  const robot = about.value;
  if (!robot) return null;
  const { vehicle, camera, pan, proximity } = robot.model;
  return (
    <Section title="Robot">
      <Facts>
        <Fact name="Wheelbase, track">
          {length(vehicle.wheelbase)}, {length(vehicle.track)}
        </Fact>
        <Fact name="Tightest turn">{length(vehicle.min_turn_radius)}</Fact>
        <Fact name="Largest speed">{`${Math.round(vehicle.max_speed * 100)} cm/s`}</Fact>
        <Fact name="Tool width">{length(vehicle.tool_width)}</Fact>
        <Fact name="Clearance">{length(vehicle.clearance)}</Fact>
        <Fact name="Camera">
          {camera.width} × {camera.height}, {degrees(2 * camera.half_view)}
        </Fact>
        <Fact name="Pan">
          {degrees(pan.minimum)} to {degrees(pan.maximum)}
        </Fact>
        <Fact name="Proximity">
          {count(proximity.angles.length, "sensor")}, {length(proximity.max_range)}
        </Fact>
      </Facts>
      <p class="quiet">These come from robot.toml.</p>
    </Section>
  );
}

export function SetUp() {
  const robot = about.value;
  return (
    <>
      <Choice
        label="Look"
        value={theme.value}
        options={THEMES.map((value) => ({ value, text: THEME_WORDS[value] }))}
        onChange={(value) => {
          theme.value = value;
        }}
      />
      <RobotSite />
      <Link />
      <Model />
      <Section title="About">
        <Facts>
          <Fact name="Robot">{robot?.name ?? "–"}</Fact>
          <Fact name="Version">{robot?.version ?? "–"}</Fact>
          <Fact name="Board">{robot?.board ?? "–"}</Fact>
        </Facts>
        <p>
          <a href="/viser/" target="_blank" rel="noopener">
            Open the 3D panel
          </a>
        </p>
      </Section>
    </>
  );
}
