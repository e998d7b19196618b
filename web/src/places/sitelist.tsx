/** Sites: new, open, duplicate, delete, import and export. */

import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import type { SiteSummary } from "../api/types";
import { clock } from "../core/format";
import {
  dirty,
  discardChanges,
  dropUnsaved,
  newSite,
  openSite,
  openUnsaved,
  saved,
  site,
  unsavedSites,
} from "../state/draft";
import { go } from "../state/location";
import { deleteSite, download, duplicateSite, readFile, sites } from "../state/sites";
import { Button, Dialog, Empty, IconButton, Section } from "../ui/controls";

async function open(id: number): Promise<void> {
  await openSite(id);
  go({ place: "draw", id, detail: null });
}

function Row({ summary, onDelete }: { summary: SiteSummary; onDelete: () => void }) {
  const here = saved.value?.id === summary.id;
  return (
    <li class={here ? "here" : ""}>
      <button type="button" class="link" aria-current={here} onClick={() => void open(summary.id)}>
        {summary.name || "Unnamed"}
      </button>
      <span class="quiet number">{clock(summary.updated_at)}</span>
      <IconButton
        icon="copy"
        label={`Duplicate ${summary.name}`}
        onClick={() =>
          void duplicateSite(summary.id).then((id) => (id === null ? undefined : open(id)))
        }
      />
      <IconButton icon="trash" label={`Delete ${summary.name}`} onClick={onDelete} />
    </li>
  );
}

function UnsavedRow({ name, kept }: { name: string; kept: string }) {
  const here = saved.value?.key === kept;
  return (
    <li class={here ? "here" : ""}>
      <button type="button" class="link" aria-current={here} onClick={() => openUnsaved(kept)}>
        {name}
      </button>
      <span class="unsaved">not saved</span>
      <IconButton icon="trash" label={`Drop ${name}`} onClick={() => dropUnsaved(kept)} />
    </li>
  );
}

export function SiteList() {
  const doomed = useSignal<SiteSummary | null>(null);
  const input = useRef<HTMLInputElement>(null);
  const list = sites.value;
  const take = async (file: File | undefined) => {
    const read = file && (await readFile(file));
    if (read) newSite(read);
  };
  return (
    <Section title="Sites">
      {list?.length === 0 && <Empty text="No site is kept yet. Draw one, or import a file." />}
      {list === null && <p class="quiet">The list of sites has not come yet.</p>}
      <ul class="sites">
        {list?.map((summary) => (
          <Row
            key={summary.id}
            summary={summary}
            onDelete={() => {
              doomed.value = summary;
            }}
          />
        ))}
        {unsavedSites().map(({ key, name }) => (
          <UnsavedRow key={key} kept={key} name={name} />
        ))}
      </ul>
      <div class="buttons">
        <Button icon="plus" onClick={() => newSite()}>
          New site
        </Button>
        <Button onClick={() => input.current?.click()}>Import a file</Button>
        {saved.value && (
          <>
            <Button onClick={() => download(site.value, "json")}>Export JSON</Button>
            <Button onClick={() => download(site.value, "geojson")}>Export GeoJSON</Button>
          </>
        )}
        {dirty.value && saved.value?.id !== null && (
          <Button onClick={discardChanges}>Discard changes</Button>
        )}
      </div>
      <input
        ref={input}
        type="file"
        accept=".json,.geojson,application/json"
        hidden
        aria-label="Site file"
        onChange={(event) => {
          void take(event.currentTarget.files?.[0]);
          event.currentTarget.value = "";
        }}
      />
      {doomed.value && (
        <Dialog
          title={`Delete “${doomed.value.name}”?`}
          onClose={() => {
            doomed.value = null;
          }}
        >
          <p>The drawing and all its versions go. Runs that were made on it stay.</p>
          <div class="buttons">
            <Button
              onClick={() => {
                doomed.value = null;
              }}
            >
              Keep it
            </Button>
            <Button
              kind="primary"
              onClick={() => {
                const summary = doomed.value;
                doomed.value = null;
                if (!summary) return;
                void deleteSite(summary).then((gone) => {
                  if (!gone || saved.value?.id !== summary.id) return;
                  const next = sites.value?.[0];
                  if (next) void open(next.id);
                  else newSite();
                });
              }}
            >
              Delete this site
            </Button>
          </div>
        </Dialog>
      )}
    </Section>
  );
}
