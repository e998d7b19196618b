import { expect, it } from "vitest";
import { SILENT_AFTER, type Socket, Stream, streamAddress } from "../src/api/stream";
import type { Snapshot } from "../src/api/types";

/** A world with a clock of its own, sockets that do what the test says, and no waiting. */
function world() {
  const sockets: (Socket & { closed: boolean })[] = [];
  const waits: number[] = [];
  let pending: (() => void)[] = [];
  const taken: Snapshot[] = [];
  const state = { now: 0 };
  const stream = new Stream({
    open: () => {
      const socket = {
        onmessage: null,
        onclose: null,
        closed: false,
        close() {
          this.closed = true;
        },
      } as Socket & { closed: boolean };
      sockets.push(socket);
      return socket;
    },
    onSnapshot: (snapshot) => taken.push(snapshot),
    now: () => state.now,
    later: (action, milliseconds) => {
      waits.push(milliseconds);
      pending.push(action);
    },
  });
  const wake = () => {
    const due = pending;
    pending = [];
    for (const action of due) action();
  };
  const say = (text: string) => sockets[sockets.length - 1].onmessage?.({ data: text });
  return { stream, sockets, waits, taken, state, wake, say };
}

const SNAPSHOT = JSON.stringify({ type: "snapshot", seq: 1 });

it("takes snapshots, leaves other messages, and knows the age of the newest", () => {
  const { stream, taken, state, say } = world();
  expect(stream.age()).toBeNull();
  say(JSON.stringify({ type: "hello" }));
  expect(taken).toHaveLength(0);
  say(SNAPSHOT);
  state.now = 4;
  expect(taken).toHaveLength(1);
  expect(stream.age()).toBe(4);
});

it("tries again with growing pauses, short ones again after news", () => {
  const { sockets, waits, wake, say } = world();
  for (let i = 0; i < 6; i++) {
    sockets[sockets.length - 1].onclose?.();
    wake();
  }
  expect(waits).toEqual([250, 500, 1000, 2000, 4000, 4000]);
  say(SNAPSHOT);
  sockets[sockets.length - 1].onclose?.();
  expect(waits[waits.length - 1]).toBe(250);
});

it("gives up a socket that fell silent, and listens to it no more", () => {
  const { stream, sockets, taken, state, wake, say } = world();
  say(SNAPSHOT);
  state.now = SILENT_AFTER - 0.1;
  stream.watch();
  expect(sockets[0].closed).toBe(false);
  state.now = SILENT_AFTER + 0.1;
  stream.watch();
  expect(sockets[0].closed).toBe(true);
  sockets[0].onmessage?.({ data: SNAPSHOT });
  expect(taken).toHaveLength(1);
  wake();
  expect(sockets).toHaveLength(2);
});

it("opens nothing more once it is closed", () => {
  const { stream, sockets, wake } = world();
  stream.close();
  sockets[0].onclose?.();
  wake();
  expect(sockets).toHaveLength(1);
});

it("finds the stream beside the page", () => {
  expect(streamAddress({ protocol: "http:", host: "localhost:8000" })).toBe(
    "ws://localhost:8000/api/v1/stream",
  );
  expect(streamAddress({ protocol: "https:", host: "robot" })).toMatch(/^wss:/);
});
