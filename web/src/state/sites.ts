/** The list of sites that the robot's service keeps. */

import { signal } from "@preact/signals";
import * as api from "../api/client";
import type { SiteSummary } from "../api/types";
import { fromGeoJson, isGeoJson, toGeoJson } from "../core/geojson";
import type { Site } from "../core/site";
import { asSite } from "../core/site";
import { doing, say, sentenceOf } from "./notice";

export const sites = signal<SiteSummary[] | null>(null);

export async function refreshSites(): Promise<void> {
  const list = await api.listSites().catch(() => null);
  if (list) sites.value = list;
}

export async function duplicateSite(id: number): Promise<number | null> {
  const copy = await doing("Duplicating the site", async () => {
    const record = await api.readSite(id);
    return api.createSite({ ...asSite(record.site), name: `${record.name} (copy)` });
  });
  await refreshSites();
  return copy?.id ?? null;
}

export async function deleteSite(summary: SiteSummary): Promise<boolean> {
  const done = await doing("Deleting the site", async () => {
    await api.deleteSite(summary.id, summary.version);
    return true;
  });
  await refreshSites();
  if (done) say(`“${summary.name}” is deleted.`);
  return done === true;
}

/** Reads SITE.json or GeoJSON; says why where it cannot. */
export async function readFile(file: File): Promise<Site | null> {
  try {
    const document: unknown = JSON.parse(await file.text());
    const site = asSite(isGeoJson(document) ? fromGeoJson(document) : document);
    return { ...site, name: site.name || file.name.replace(/\.(geo)?json$/i, "") };
  } catch (error) {
    const why = error instanceof SyntaxError ? "It is not JSON." : sentenceOf(error);
    say(`${file.name} cannot be read. ${why}`, "fault");
    return null;
  }
}

export function download(site: Site, as: "json" | "geojson"): void {
  const document = as === "json" ? site : toGeoJson(site);
  const link = window.document.createElement("a");
  link.href = URL.createObjectURL(
    new Blob([`${JSON.stringify(document, null, 2)}\n`], { type: "application/json" }),
  );
  link.download = `${site.name || "site"}.${as}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
