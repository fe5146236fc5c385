// How the mission is kept: in one line always, and in full where somebody else saved since.
import { conflict, type Saving, saving, settle, unsaved } from "../mission/keeping";
import { attempt, mission, mode } from "../state";
import { words } from "../words";

const { ui } = words;

export function Keeping() {
  const now: Saving = unsaved.value === null ? saving.value : "unsent";
  return (
    <button type="button" id="keeping" class="keeping" title={unsaved.value ?? ui.keepingHint} onClick={() => (mode.value = "brief")}>
      {mission.value.name}: {words.saving(now, unsaved.value !== null)}
    </button>
  );
}

export function Conflict() {
  if (conflict.value === null) return null;
  const choose = (choice: "mine" | "theirs" | "both") => () => void attempt("brief", () => settle(choice));
  return (
    <div class="refusal" id="conflict">
      <p>{conflict.value}</p>
      <div class="row">
        <button type="button" onClick={choose("both")}>
          {ui.keepBoth}
        </button>
        <button type="button" onClick={choose("theirs")}>
          {ui.takeTheirs}
        </button>
        <button type="button" onClick={choose("mine")}>
          {ui.keepMine}
        </button>
      </div>
    </div>
  );
}
