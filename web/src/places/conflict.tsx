/** Somebody else saved the same site meanwhile: nothing is lost, one has to choose. */

import { clock } from "../core/format";
import { conflict, keepMineAsCopy, saved, takeTheirs } from "../state/draft";
import { Button, Dialog } from "../ui/controls";

export function Conflict() {
  const theirs = conflict.value;
  if (!theirs) return null;
  const close = () => {
    conflict.value = null;
  };
  return (
    <Dialog title="This site was changed meanwhile" onClose={close}>
      <p>
        You began from version {saved.value?.version}. Version {theirs.version} was saved at{" "}
        {clock(theirs.updated_at)}. Yours is not saved yet and stays in this browser.
      </p>
      <div class="buttons">
        <Button kind="primary" onClick={() => void keepMineAsCopy()}>
          Keep mine as a copy
        </Button>
        <Button onClick={takeTheirs}>Take theirs</Button>
        <Button kind="subtle" onClick={close}>
          Decide later
        </Button>
      </div>
    </Dialog>
  );
}
