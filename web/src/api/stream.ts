/** The live stream: keeps one WebSocket open, tries again with growing pauses, knows its age. */

import type { Snapshot } from "./types";

export interface Socket {
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: (() => void) | null;
  close(): void;
}

export interface StreamOptions {
  open: () => Socket;
  onSnapshot: (snapshot: Snapshot) => void;
  /** Seconds of a monotonic clock. */
  now?: () => number;
  later?: (action: () => void, milliseconds: number) => unknown;
}

const FIRST_PAUSE = 250;
const LONGEST_PAUSE = 4_000;
/** A socket that says nothing for so long is given up: a pulled cable closes nothing by itself. */
export const SILENT_AFTER = 3;

export class Stream {
  /** When the newest snapshot came, or null before the first. */
  received: number | null = null;
  private socket: Socket | null = null;
  private pause = FIRST_PAUSE;
  private opened = 0;
  private ended = false;
  private readonly now: () => number;
  private readonly later: (action: () => void, milliseconds: number) => unknown;

  constructor(private readonly options: StreamOptions) {
    this.now = options.now ?? (() => performance.now() / 1000);
    this.later = options.later ?? ((action, milliseconds) => setTimeout(action, milliseconds));
    this.connect();
  }

  /** Seconds since the newest snapshot; null before the first. */
  age(): number | null {
    return this.received === null ? null : this.now() - this.received;
  }

  /** To be called now and then: gives a silent socket up. */
  watch(): void {
    const since = Math.max(this.opened, this.received ?? 0);
    if (this.socket && this.now() - since > SILENT_AFTER) this.drop(this.socket);
  }

  close(): void {
    this.ended = true;
    this.socket?.close();
  }

  private connect(): void {
    if (this.ended) return;
    let socket: Socket;
    try {
      socket = this.options.open();
    } catch {
      this.retry();
      return;
    }
    this.socket = socket;
    this.opened = this.now();
    socket.onmessage = (event) => {
      if (this.socket !== socket || typeof event.data !== "string") return;
      const message = JSON.parse(event.data);
      if (message.type !== "snapshot") return;
      this.received = this.now();
      this.pause = FIRST_PAUSE;
      this.options.onSnapshot(message as Snapshot);
    };
    socket.onclose = () => this.drop(socket);
  }

  private drop(socket: Socket): void {
    if (this.socket !== socket) return;
    this.socket = null;
    socket.onclose = null;
    socket.onmessage = null;
    socket.close();
    this.retry();
  }

  private retry(): void {
    if (this.ended) return;
    this.later(() => this.connect(), this.pause);
    this.pause = Math.min(LONGEST_PAUSE, this.pause * 2);
  }
}

/** The address of the stream beside the page. */
export function streamAddress(page: { protocol: string; host: string }): string {
  return `${page.protocol === "https:" ? "wss" : "ws"}://${page.host}/api/v1/stream`;
}
