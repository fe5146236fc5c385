// What stands on the ground: footprints of buildings out of a file, and how high those are that do not say it.
import { dropBuildings, heights, outlines, pending, setHeights, takeBuildings } from "../products/buildings";
import { attempt, mission } from "../state";
import { words } from "../words";
import { Group, LengthField } from "./fields";

const { ui } = words;

export function BuildingsPanel() {
  const built = mission.value.buildings;
  const waits = pending.value;
  const set = (next: Parameters<typeof setHeights>[0]): void => void attempt("ground", () => setHeights(next));
  return (
    <Group title={ui.buildings}>
      <p class="hint">{built ? ui.buildingsAre(built.name, outlines.value.length) : ui.buildingsHint}</p>
      {waits && <p class="stale-note">{ui.buildingsWait(waits.name)}</p>}
      <div class="row">
        <label class="button">
          {ui.takeBuildings}
          <input
            id="buildings-file"
            type="file"
            accept=".geojson,.json"
            onChange={(event) => {
              const input = event.currentTarget;
              const [file] = input.files ?? [];
              if (file) void attempt("ground", () => takeBuildings(file)).then(() => (input.value = ""));
            }}
          />
        </label>
        <button type="button" id="drop-buildings" disabled={built === null && waits === null} onClick={dropBuildings}>
          {ui.dropBuildings}
        </button>
      </div>
      <div class="pair">
        <LengthField where="ground" optional label={ui.levelHeight} min={0.1} value={heights.value.level_m} onValue={(level_m) => set({ level_m })} />
        <LengthField where="ground" optional label={ui.defaultHeight} min={0.1} value={heights.value.default_height_m} onValue={(default_height_m) => set({ default_height_m })} />
      </div>
    </Group>
  );
}
