// Ground for any place that the operator's library or a source covers: a box drawn on the map, or a circle round a place.
import { signal } from "@preact/signals";
import { degreesOf } from "../mission/anchorTexts";
import { borders, cellM, coverage, isThereGround, source, takeBorders, takeOf } from "../products/library";
import { attempt, tool } from "../state";
import { words } from "../words";
import { Group, NumberField, Select, TextField } from "./fields";

const { ui } = words;
const place = signal("");
const radiusKm = signal(5);

function make(): void {
  void attempt("ground", async () => {
    const { lon_deg, lat_deg } = degreesOf(place.peek());
    await takeOf({ lon_deg, lat_deg, radius_m: 1000 * radiusKm.peek() });
  });
}

export function Library() {
  if (!isThereGround.value) return null;
  const { features, sources } = coverage.value;
  const drawing = tool.value === "library";
  const own = features.length > 0 ? { "": ui.libraryOwn } : {};
  const from: Readonly<Record<string, string>> = { ...own, ...Object.fromEntries(sources.map((name) => [name, name])) };
  return (
    <Group title={ui.library}>
      <p class="hint">{ui.libraryHint(features.length)}</p>
      {sources.length > 0 && <Select label={ui.libraryFrom} value={source.value} options={from} onValue={(value) => (source.value = value)} />}
      <NumberField where="ground" optional label={ui.libraryCell} min={0.1} value={cellM.value} onValue={(value) => (cellM.value = value)} />
      <div class="row">
        <button type="button" id="draw-box" aria-pressed={drawing} onClick={() => (tool.value = drawing ? "look" : "library")}>
          {ui.libraryBox}
        </button>
      </div>
      {drawing && <p class="hint">{ui.libraryBoxHint}</p>}
      <TextField label={ui.libraryBorders} value={borders.value} onValue={(value) => (borders.value = value)} />
      <button type="button" id="from-borders" onClick={takeBorders}>
        {ui.libraryMakeBox}
      </button>
      <div class="pair">
        <TextField label={ui.libraryPlace} value={place.value} onValue={(value) => (place.value = value)} />
        <NumberField where="ground" label={ui.libraryRadius} min={0.1} value={radiusKm.value} onValue={(value) => (radiusKm.value = value ?? 5)} />
      </div>
      <button type="button" id="from-library" onClick={make}>
        {ui.libraryMake}
      </button>
    </Group>
  );
}
