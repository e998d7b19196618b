/** Numbers and times as the page says them. Unknown is a dash, never 0. */

export const UNKNOWN = "–";

type Maybe = number | null | undefined;

const known = (value: Maybe): value is number =>
  typeof value === "number" && Number.isFinite(value);

/** Metres as cm under 10 m, else m with one decimal. */
export function length(metres: Maybe): string {
  if (!known(metres)) return UNKNOWN;
  const centimetres = Math.round(metres * 100);
  if (Math.abs(centimetres) < 1000) return `${sign(centimetres)} cm`;
  return `${metres.toFixed(1).replace("-", "−")} m`;
}

/** An error or a sigma: cm with one decimal, so that "0 cm" never hides 4 mm. */
export function fine(metres: Maybe): string {
  return known(metres) ? `${sign(Number((metres * 100).toFixed(1)))} cm` : UNKNOWN;
}

export function area(squareMetres: Maybe): string {
  if (!known(squareMetres)) return UNKNOWN;
  return `${squareMetres.toFixed(squareMetres < 0.1 && squareMetres > 0 ? 2 : 1)} m²`;
}

/** Radians as whole degrees. */
export function degrees(radians: Maybe, digits = 0): string {
  if (!known(radians)) return UNKNOWN;
  return `${sign(Number(((radians * 180) / Math.PI).toFixed(digits)))}°`;
}

export function percent(share: Maybe): string {
  return known(share) ? `${Math.floor(share * 100 + 1e-9)} %` : UNKNOWN;
}

export function duration(seconds: Maybe): string {
  if (!known(seconds)) return UNKNOWN;
  const whole = Math.max(0, Math.round(seconds));
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  if (hours > 0) return `${hours} h ${minutes} min`;
  if (minutes > 0) return `${minutes} min ${whole % 60} s`;
  return `${whole} s`;
}

/** Minutes and seconds of a recording: 3:07. */
export function counter(seconds: Maybe): string {
  if (!known(seconds)) return UNKNOWN;
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/** The age of a value, or nothing while it is fresh (a second or less). */
export function age(seconds: Maybe): string {
  if (!known(seconds) || seconds <= 1) return "";
  return seconds < 120 ? `${Math.floor(seconds)} s old` : `${Math.floor(seconds / 60)} min old`;
}

export function speed(metresPerSecond: Maybe): string {
  return known(metresPerSecond) ? `${sign(Math.round(metresPerSecond * 100))} cm/s` : UNKNOWN;
}

export function volts(value: Maybe): string {
  return known(value) ? `${value.toFixed(1)} V` : UNKNOWN;
}

export function milliseconds(seconds: Maybe): string {
  return known(seconds) ? `${(seconds * 1000).toFixed(seconds < 0.01 ? 1 : 0)} ms` : UNKNOWN;
}

/** A count with its noun: "1 wall", "3 walls". */
export function count(n: number, noun: string): string {
  return `${n} ${noun}${n === 1 ? "" : "s"}`;
}

/** 24 h clock; with the day where that is not today. Takes ISO text or seconds since 1970. */
export function clock(when: string | number | null | undefined, today = new Date()): string {
  if (when === null || when === undefined) return UNKNOWN;
  const date = new Date(typeof when === "number" ? when * 1000 : when);
  if (Number.isNaN(date.getTime())) return UNKNOWN;
  const two = (value: number) => String(value).padStart(2, "0");
  const time = `${two(date.getHours())}:${two(date.getMinutes())}`;
  if (date.toDateString() === today.toDateString()) return time;
  return `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())} ${time}`;
}

/** What somebody typed into a number field: "1.5", "1,5 m", "150 cm", "90°"; null where no number. */
export function parseNumber(text: string): { value: number; unit: "m" | "cm" | "" } | null {
  const match = /^\s*([-−+]?\d*[.,]?\d+|\d+[.,])\s*(cm|m|°|%|c)?\s*$/i.exec(text);
  if (!match) return null;
  const value = Number(match[1].replace("−", "-").replace(",", "."));
  if (!Number.isFinite(value)) return null;
  const unit = (match[2] ?? "").toLowerCase();
  return { value, unit: unit === "m" ? "m" : unit === "cm" || unit === "c" ? "cm" : "" };
}

function sign(value: number): string {
  return String(value === 0 ? 0 : value).replace("-", "−");
}
