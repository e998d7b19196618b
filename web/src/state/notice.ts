/** The one line that says what happened and what to do. */

import { effect, signal } from "@preact/signals";
import { ApiError } from "../api/client";
import { location } from "./location";

export interface Notice {
  text: string;
  level: "info" | "warning" | "fault";
}

export const notice = signal<Notice | null>(null);

/** What is being done right now, shown once it takes longer than 300 ms. */
export const work = signal<string | null>(null);

let timer: ReturnType<typeof setTimeout> | undefined;

export function say(text: string, level: Notice["level"] = "info"): void {
  clearTimeout(timer);
  notice.value = { text, level };
  if (level === "info") timer = setTimeout(hush, 8_000);
}

export function hush(): void {
  notice.value = null;
}

export function sentenceOf(error: unknown): string {
  if (error instanceof ApiError) return error.sentence;
  return error instanceof Error ? error.message : String(error);
}

/** Does something, says what while it lasts, and says why where it failed (then null). */
export async function doing<T>(what: string, action: () => Promise<T>): Promise<T | null> {
  const shown = setTimeout(() => {
    work.value = what;
  }, 300);
  try {
    return await action();
  } catch (error) {
    say(sentenceOf(error), "fault");
    return null;
  } finally {
    clearTimeout(shown);
    if (work.value === what) work.value = null;
  }
}

// News of one place is no news in the next; a fault stays until it is read.
let place = location.value.place;
effect(() => {
  if (location.value.place === place) return;
  place = location.value.place;
  if (notice.peek()?.level === "info") notice.value = null;
});
