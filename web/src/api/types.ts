/** Names for the generated types that the page uses. */

import type { components } from "./schema";

type Schemas = components["schemas"];

export type About = Schemas["About"];
export type SiteSummary = Schemas["SiteSummary"];
export type SiteRecord = Schemas["SiteRecord"];
export type SiteVersion = Schemas["SiteVersion"];
export type SiteCheck = Schemas["SiteCheck"];
export type SiteProblem = Schemas["SiteProblem"];
export type PlanRequest = Schemas["PlanRequest"];
export type PlanRecord = Schemas["PlanRecord"];
export type PrecisionRecord = Schemas["PrecisionRecord"];
export type Suggestions = Schemas["SuggestionsModel"];
export type RunRecord = Schemas["RunRecord"];
export type RunDetail = Schemas["RunDetail"];
export type Track = Schemas["Track"];
export type Snapshot = Schemas["Snapshot"];
export type Disc = Schemas["Disc"];
export type EventModel = Schemas["EventModel"];
export type RobotState = Snapshot["state"];
