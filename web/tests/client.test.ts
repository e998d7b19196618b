import { expect, it, vi } from "vitest";
import { ApiError, request } from "../src/api/client";

const answer = (status: number, body: unknown) =>
  vi.fn(async () => new Response(JSON.stringify(body), { status }));

it("asks below /api/v1 and reads JSON", async () => {
  const fetcher = answer(200, [{ id: 1 }]);
  expect(await request("/sites", {}, fetcher)).toEqual([{ id: 1 }]);
  expect(fetcher).toHaveBeenCalledWith("/api/v1/sites", expect.objectContaining({ method: "GET" }));
});

it("a refusal says what happened and what to do", async () => {
  const problem = {
    detail: "This site has one landmark.",
    code: "no_landmarks",
    remedy: "Place another.",
    where: [1, 2],
  };
  const error = await request<never>("/missions", { method: "POST" }, answer(409, problem)).catch(
    (e) => e,
  );
  expect(error).toBeInstanceOf(ApiError);
  expect(error).toMatchObject({ status: 409, code: "no_landmarks", where: [1, 2] });
  expect(error.sentence).toBe("This site has one landmark. Place another.");
});

it("a refusal without words still is a sentence", async () => {
  const fetcher = vi.fn(async () => new Response("<html>", { status: 502 }));
  const error = await request<never>("/about", {}, fetcher).catch((e: ApiError) => e);
  expect(error.code).toBe("http_502");
  expect(error.sentence).toMatch(/refused/);
});

it("an unreachable server is told apart from a slow one", async () => {
  const gone = vi.fn(async () => Promise.reject(new TypeError("failed to fetch")));
  expect(await request<never>("/about", {}, gone).catch((e: ApiError) => e.code)).toBe(
    "unreachable",
  );
  const slow = vi.fn(async () => Promise.reject(new DOMException("", "TimeoutError")));
  expect(await request<never>("/about", {}, slow).catch((e: ApiError) => e.code)).toBe("timeout");
});

it("204 has no body", async () => {
  const fetcher = vi.fn(async () => new Response(null, { status: 204 }));
  expect(await request("/sites/1", { method: "DELETE" }, fetcher)).toBeUndefined();
});
