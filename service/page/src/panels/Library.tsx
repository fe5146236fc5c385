// Ground for any place that the operator's library covers: a circle round a place in degrees.
import { signal } from "@preact/signals";
import { fromLibrary, libraryTiles } from "../api/dems";
import { takeGround } from "../ground";
import { degreesOf } from "../mission/anchorTexts";
import { attempt } from "../state";
import { words } from "../words";
import { Group, NumberField, TextField } from "./fields";

const { ui } = words;
const tiles = signal(0);
const place = signal("");
const radiusKm = signal(5);

export async function refreshLibrary(): Promise<void> {
  tiles.value = await libraryTiles();
}

export function Library() {
  if (tiles.value === 0) return null;
  const make = (): void =>
    void attempt("ground", async () => {
      const { lon_deg, lat_deg } = degreesOf(place.peek());
      await takeGround(fromLibrary({ lon_deg, lat_deg, radius_m: 1000 * radiusKm.peek() }));
    });
  return (
    <Group title={ui.library}>
      <p class="hint">{ui.libraryHint(tiles.value)}</p>
      <TextField label={ui.libraryPlace} value={place.value} onValue={(value) => (place.value = value)} />
      <NumberField where="ground" label={ui.libraryRadius} min={0.1} value={radiusKm.value} onValue={(value) => (radiusKm.value = value ?? 5)} />
      <button type="button" id="from-library" onClick={make}>
        {ui.libraryMake}
      </button>
    </Group>
  );
}
