/** The REST interface: one function per request; every refusal becomes an ApiError. */

import type { Site } from "../core/site";
import type {
  About,
  Disc,
  PlanRecord,
  PlanRequest,
  PrecisionRecord,
  RunDetail,
  RunRecord,
  SiteCheck,
  SiteRecord,
  SiteSummary,
  SiteVersion,
  Snapshot,
  Track,
} from "./types";

export const BASE = "/api/v1";

/** What the server refused, in its own words; status 0 where it could not be reached. */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    readonly code: string,
    detail: string,
    readonly remedy = "",
    readonly where: [number, number] | null = null,
  ) {
    super(detail);
  }

  /** What happened and what to do. */
  get sentence(): string {
    return this.remedy ? `${this.message} ${this.remedy}` : this.message;
  }
}

interface Options {
  method?: string;
  body?: unknown;
  headers?: Record<string, string>;
  timeout?: number;
  /** Ends the request before its answer. */
  signal?: AbortSignal;
}

/** Any request of this interface. Kept replaceable for the tests. */
export async function request<T>(path: string, options: Options = {}, fetcher = fetch): Promise<T> {
  const { method = "GET", body, headers = {}, timeout = 15_000, signal } = options;
  const patience = AbortSignal.timeout(timeout);
  let response: Response;
  try {
    response = await fetcher(`${BASE}${path}`, {
      method,
      headers: body === undefined ? headers : { "Content-Type": "application/json", ...headers },
      body: body === undefined ? undefined : JSON.stringify(body),
      signal: signal ? AbortSignal.any([signal, patience]) : patience,
      cache: "no-store",
    });
  } catch (cause) {
    const slow = cause instanceof DOMException && cause.name === "TimeoutError";
    throw slow
      ? new ApiError(0, "timeout", "The robot did not answer in time.", "Try again.")
      : new ApiError(
          0,
          "unreachable",
          "The robot cannot be reached.",
          "Look whether its service runs.",
        );
  }
  if (!response.ok) throw await refusal(response);
  if (response.status === 204) return undefined as T;
  return (await response.json()) as T;
}

async function refusal(response: Response): Promise<ApiError> {
  const problem = await response.json().catch(() => ({}));
  const detail =
    typeof problem.detail === "string" && problem.detail ? problem.detail : problem.title;
  return new ApiError(
    response.status,
    problem.code ?? `http_${response.status}`,
    detail ?? "The robot refused this and gave no reason.",
    problem.remedy ?? "",
    problem.where ?? null,
  );
}

const post = <T>(path: string, body?: unknown, more: Options = {}) =>
  request<T>(path, { method: "POST", body, ...more });

const put = <T>(path: string, body: unknown, more: Options = {}) =>
  request<T>(path, { method: "PUT", body, ...more });

const ifMatch = (version: number) => ({ headers: { "If-Match": `"v${version}"` } });

export const about = () => request<About>("/about");

export const listSites = () => request<SiteSummary[]>("/sites");
export const readSite = (id: number) => request<SiteRecord>(`/sites/${id}`);
export const createSite = (site: Site) => post<SiteRecord>("/sites", site);
export const saveSite = (id: number, version: number, site: Site) =>
  put<SiteRecord>(`/sites/${id}`, site, ifMatch(version));
export const deleteSite = (id: number, version: number) =>
  request<void>(`/sites/${id}`, { method: "DELETE", ...ifMatch(version) });
export const checkSite = (site: Site) => post<SiteCheck>("/sites/check", site);
export const siteVersions = (id: number) => request<SiteVersion[]>(`/sites/${id}/versions`);
export const readSiteVersion = (id: number, version: number) =>
  request<SiteRecord>(`/sites/${id}/versions/${version}`);

/** The precision map of a drawing, kept or not; with places for so many more landmarks. */
export const drawnPrecision = (site: Site, suggest = 0) =>
  post<PrecisionRecord>("/sites/precision", { site, suggest }, { timeout: 65_000 });

/** Planning a large site takes its time; so may the answer. */
export const makePlan = (body: PlanRequest, signal?: AbortSignal) =>
  post<PlanRecord>("/plans", body, { timeout: 150_000, signal });
export const readPlan = (id: number) => request<PlanRecord>(`/plans/${id}`);

/** One press is one mission, however often the network repeats the request. */
export const startMission = (planId: number) =>
  post<RunRecord>(
    "/missions",
    { plan_id: planId },
    { headers: { "Idempotency-Key": crypto.randomUUID() } },
  );
export const pauseMission = () => post<unknown>("/mission/pause");
export const resumeMission = () => post<unknown>("/mission/resume");
export const endMission = () => post<unknown>("/mission/end");

export const robotSnapshot = () => request<Snapshot>("/robot");
export const loadRobotSite = (siteId: number) => put<Snapshot>("/robot/site", { site_id: siteId });
export const stopRobot = () => post<unknown>("/robot/stop", undefined, { timeout: 2_000 });
export const clearStop = () => post<Snapshot>("/robot/clear");

export const listRuns = () => request<RunRecord[]>("/runs");
export const readRun = (id: number) => request<RunDetail>(`/runs/${id}`);
export const readTrack = (id: number) => request<Track>(`/runs/${id}/track`);
export const runLogAddress = (id: number) => `${BASE}/runs/${id}/log`;

export const setObstacles = (obstacles: Disc[]) => put<unknown>("/simulation", { obstacles });
export const placeRobot = (x: number, y: number, heading: number) =>
  post<unknown>("/simulation/place", { x, y, heading });

/** The newest camera picture, or the reason why there is none. */
export async function cameraPicture(): Promise<Blob> {
  let response: Response;
  try {
    response = await fetch(`${BASE}/camera.jpg`, {
      cache: "no-store",
      signal: AbortSignal.timeout(3_000),
    });
  } catch {
    throw new ApiError(0, "unreachable", "The robot cannot be reached.");
  }
  if (!response.ok) throw await refusal(response);
  return response.blob();
}
