// Trees over the ground: one height or a raster file, where crowns begin, how dense they are.
import { dropTrees, heldByRaster, setHeight, setTrees, takeTrees } from "../products/trees";
import { attempt, mission } from "../state";
import { words } from "../words";
import { Group, LengthField, NumberField, Select } from "./fields";

const { ui } = words;

export function TreesPanel() {
  const { trees } = mission.value;
  const run = (work: () => Promise<void>): void => void attempt("ground", work);
  return (
    <Group id="trees" title={ui.trees}>
      <p class="hint">{trees?.name ? ui.treesAre(trees.name) : ui.treesHint}</p>
      <LengthField where="ground" optional label={ui.treesHeight} min={0} value={trees?.top_m ?? null} onValue={(top_m) => run(() => setHeight(top_m))} />
      <Select label={ui.treesHold} value={heldByRaster.value} options={ui.treesHolds} onValue={(what) => (heldByRaster.value = what)} />
      <div class="row">
        <label class="button">
          {ui.takeTrees}
          <input
            id="trees-file"
            type="file"
            accept=".tif,.tiff,.asc,.npz,.hgt"
            onChange={(event) => {
              const input = event.currentTarget;
              const [file] = input.files ?? [];
              if (file) void attempt("ground", () => takeTrees(file, heldByRaster.peek())).then(() => (input.value = ""));
            }}
          />
        </label>
        <button type="button" id="drop-trees" disabled={trees === null} onClick={dropTrees}>
          {ui.dropTrees}
        </button>
      </div>
      {trees && (
        <div class="pair">
          <LengthField where="ground" label={ui.treesBase} min={0} value={trees.base_m} onValue={(base_m) => run(() => setTrees({ base_m: base_m ?? 0 }))} />
          <NumberField where="ground" optional label={ui.treesDensity} min={0} value={trees.depth_per_m} onValue={(depth_per_m) => run(() => setTrees({ depth_per_m }))} />
        </div>
      )}
    </Group>
  );
}
