/** The error over time of a run: one line, its marks, and where the slider stands. */

import { counter, fine } from "../core/format";
import { moment, span } from "../state/runs";

interface ChartProps {
  times: readonly number[];
  values: readonly (number | null)[];
  name: string;
}

const WIDTH = 312;
const HEIGHT = 112;
const LEFT = 40;
const BOTTOM = 18;

/** A round number of metres at or above the largest value. */
function ceiling(largest: number): number {
  const steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
  return steps.find((step) => step >= largest) ?? largest;
}

export function ErrorChart({ times, values, name }: ChartProps) {
  const range = span.value;
  const known = values.filter((value): value is number => value !== null);
  if (!range || known.length === 0) return <p class="quiet">Nothing was recorded to draw.</p>;
  const top = ceiling(known.reduce((a, b) => Math.max(a, b), 0));
  const x = (t: number) => LEFT + ((t - range[0]) / (range[1] - range[0])) * (WIDTH - LEFT - 4);
  const y = (value: number) => 6 + (1 - value / top) * (HEIGHT - BOTTOM - 6);
  let path = "";
  let pen = false;
  values.forEach((value, i) => {
    if (value === null) {
      pen = false;
      return;
    }
    path += `${pen ? "L" : "M"}${x(times[i]).toFixed(1)} ${y(value).toFixed(1)}`;
    pen = true;
  });
  const pick = (event: PointerEvent) => {
    if (event.buttons !== 1) return;
    const box = (event.currentTarget as SVGElement).getBoundingClientRect();
    const share = ((event.clientX - box.left) * (WIDTH / box.width) - LEFT) / (WIDTH - LEFT - 4);
    moment.value = range[0] + Math.min(1, Math.max(0, share)) * (range[1] - range[0]);
  };
  return (
    <figure class="chart">
      <svg
        viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
        role="img"
        aria-label={`${name} over time`}
        onPointerDown={pick}
        onPointerMove={pick}
      >
        {[0, top / 2, top].map((level) => (
          <g key={level}>
            <line class="chart-grid" x1={LEFT} x2={WIDTH - 4} y1={y(level)} y2={y(level)} />
            <text x={LEFT - 4} y={y(level) + 4} text-anchor="end">
              {fine(level)}
            </text>
          </g>
        ))}
        <text x={LEFT} y={HEIGHT - 4}>
          0:00
        </text>
        <text x={WIDTH - 4} y={HEIGHT - 4} text-anchor="end">
          {counter(range[1] - range[0])}
        </text>
        <path class="chart-line" d={path} />
        {moment.value !== null && (
          <line
            class="chart-now"
            x1={x(moment.value)}
            x2={x(moment.value)}
            y1={4}
            y2={HEIGHT - BOTTOM}
          />
        )}
      </svg>
      <figcaption class="quiet">{name}</figcaption>
    </figure>
  );
}
