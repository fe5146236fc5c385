// Anchors: a list, the chosen one in full, and texts in and out.
import { signal } from "@preact/signals";
import { useId } from "preact/hooks";
import { highestNear } from "../geo/grid";
import { anchorsOf, placeOf } from "../mission/anchorTexts";
import { type Anchor, newAnchor, nextId } from "../mission/mission";
import { accept, attempt, change, frame, ground, mission, refuse, selected, tool, withAnchor } from "../state";
import { fromMetres, unit } from "../units";
import { words } from "../words";
import { Exports, Found, Import } from "./Exchange";
import { Group, LengthField, NumberField, Select, TextField } from "./fields";

const { ui } = words;
const NEAR_M = 500;
const typed = signal("");

function around() {
  if (!ground.value || !frame.value) throw new Error(words.chooseGround);
  return { extent: ground.value.extent, frame: frame.value };
}

function addTexts(text: string): Promise<void> {
  return attempt("anchors", () => {
    const added = anchorsOf(text, mission.peek().anchors, around());
    change({ anchors: [...mission.peek().anchors, ...added] });
    selected.value = added.at(-1)?.id ?? null;
    typed.value = "";
    return Promise.resolve();
  });
}

function addMiddle(): void {
  void attempt("anchors", () => {
    const { west, east, south, north } = around().extent;
    const anchor = newAnchor(mission.peek().anchors, { east_m: Math.round((west + east) / 2), north_m: Math.round((south + north) / 2) });
    change({ anchors: [...mission.peek().anchors, anchor] });
    selected.value = anchor.id;
    return Promise.resolve();
  });
}

export function remove(id: string): void {
  change({ anchors: mission.peek().anchors.filter((one) => one.id !== id) });
  accept("anchors");
}

export function AnchorsPanel() {
  const { anchors } = mission.value;
  const placing = tool.value === "anchor";
  const chosen = anchors.find((anchor) => anchor.id === selected.value);
  return (
    <>
      <Group title={words.mode.anchors}>
        <div class="row">
          <button type="button" id="place-anchors" aria-pressed={placing} disabled={!ground.value} onClick={() => (tool.value = placing ? "look" : "anchor")}>
            {ui.addByClick}
          </button>
          <button type="button" disabled={!ground.value} onClick={addMiddle}>
            {ui.addMiddle}
          </button>
        </div>
        {placing && <p class="hint">{ui.placing}</p>}
        {anchors.length === 0 && <p class="hint">{ui.noAnchors}</p>}
        <ul class="list" id="anchor-list">
          {anchors.map((anchor) => (
            <li key={anchor.id}>
              <button type="button" aria-pressed={anchor.id === selected.value} onClick={() => (selected.value = anchor.id)}>
                <strong>{anchor.id}</strong> {ui.kinds[anchor.kind]}, {fromMetres(anchor.height_m).toFixed(0)} {unit.value}{" "}
                {anchor.height_from === "above_ground_m" ? "AGL" : ""}
              </button>
              <button type="button" class="small" aria-label={`${ui.remove} ${anchor.id}`} onClick={() => remove(anchor.id)}>
                ×
              </button>
            </li>
          ))}
        </ul>
      </Group>
      {chosen && <Chosen key={chosen.id} anchor={chosen} />}
      <Texts />
      <Found />
    </>
  );
}

function Chosen({ anchor }: { anchor: Anchor }) {
  const set = (fields: Partial<Anchor>): void => {
    accept("anchors");
    change(withAnchor(anchor.id, fields));
  };
  const rename = (id: string): void => {
    const free = id !== "" && !mission.peek().anchors.some((one) => one.id === id);
    if (!free) {
      refuse("anchors", words.idTaken(id));
      return;
    }
    set({ id });
    selected.value = id;
  };
  const retype = (text: string): void => {
    void attempt("anchors", () => {
      set(placeOf(text, around()));
      return Promise.resolve();
    });
  };
  const degrees = frame.value?.toDegrees(anchor);
  return (
    <Group title={ui.anchor(anchor.id)}>
      <div class="pair">
        <TextField label={ui.id} value={anchor.id} onValue={rename} />
        <Select label={ui.kind} value={anchor.kind} options={ui.kinds} onValue={(kind) => set({ kind })} />
        <NumberField where="anchors" label={ui.east} value={anchor.east_m} onValue={(value) => set({ east_m: value ?? 0 })} />
        <NumberField where="anchors" label={ui.north} value={anchor.north_m} onValue={(value) => set({ north_m: value ?? 0 })} />
      </div>
      {degrees && <TextField label={ui.place} value={`${degrees.lat_deg.toFixed(6)}, ${degrees.lon_deg.toFixed(6)}`} onValue={retype} />}
      <div class="pair">
        <LengthField where="anchors" label={ui.height} value={anchor.height_m} onValue={(value) => set({ height_m: value ?? 0 })} />
        <Select
          label={ui.above}
          value={anchor.height_from}
          options={{ above_ground_m: ui.aboveGround, altitude_m: ui.altitude }}
          onValue={(height_from) => set({ height_from })}
        />
        <LengthField where="anchors" optional label={ui.range} value={anchor.max_range_m} onValue={(max_range_m) => set({ max_range_m })} />
        <LengthField where="anchors" label={ui.sigma} value={anchor.ranging_sigma_m} onValue={(value) => set({ ranging_sigma_m: value ?? 0.1 })} />
        <NumberField where="anchors" optional label={ui.sectorFrom} value={anchor.azimuth_from_deg} onValue={(value) => set({ azimuth_from_deg: value, azimuth_to_deg: value === null ? null : (anchor.azimuth_to_deg ?? (value + 90) % 360) })} />
        <NumberField where="anchors" optional label={ui.sectorTo} value={anchor.azimuth_to_deg} onValue={(value) => set({ azimuth_to_deg: value, azimuth_from_deg: value === null ? null : (anchor.azimuth_from_deg ?? 0) })} />
        <Select label={ui.radio} value={anchor.radio ?? "none"} options={ui.radios} onValue={(radio) => set({ radio: radio === "none" ? null : radio })} />
      </div>
      {anchor.radio === "gnss-l1" && <p class="stale-note">{ui.satelliteRadio([anchor.id])}</p>}
      {anchor.radio !== null && <p class="hint">{ui.radioHint}</p>}
      <Flight anchor={anchor} set={set} />
      <div class="row">
        <button type="button" onClick={() => toSummit(anchor, set)}>
          {ui.toSummit}
        </button>
        <button type="button" onClick={() => duplicate(anchor)}>
          {ui.duplicate}
        </button>
      </div>
    </Group>
  );
}

/** Where it flies, for what is looked at over time. */
function Flight({ anchor, set }: { anchor: Anchor; set: (fields: Partial<Anchor>) => void }) {
  const drawing = tool.value === "flight";
  return (
    <>
      <div class="row">
        <button type="button" id="flies-to" aria-pressed={drawing} onClick={() => (tool.value = drawing ? "look" : "flight")}>
          {ui.fliesTo}
        </button>
        <span>{ui.fliesPlaces(anchor.flies_to.length)}</span>
        {anchor.flies_to.length > 0 && (
          <button type="button" class="small" onClick={() => set({ flies_to: [] })}>
            {ui.fliesStop}
          </button>
        )}
      </div>
      {drawing && <p class="hint">{ui.fliesHint}</p>}
      {anchor.flies_to.length > 0 && <NumberField where="anchors" label={ui.fliesSpeed} min={0.1} value={anchor.flies_m_per_s} onValue={(value) => set({ flies_m_per_s: value ?? 5 })} />}
    </>
  );
}

function toSummit(anchor: Anchor, set: (fields: Partial<Anchor>) => void): void {
  const place = ground.peek() && highestNear(ground.value as NonNullable<typeof ground.value>, anchor, NEAR_M);
  if (place) set({ east_m: Math.round(place.east_m * 10) / 10, north_m: Math.round(place.north_m * 10) / 10 });
}

function duplicate(anchor: Anchor): void {
  const { anchors } = mission.peek();
  const dem = ground.peek()?.dem;
  const aside = 5 * (dem?.cell_east_m ?? 1);
  const copy = { ...anchor, id: nextId(anchors), east_m: anchor.east_m + aside };
  change({ anchors: [...anchors, copy] });
  selected.value = copy.id;
}

function Texts() {
  const id = useId();
  return (
    <Group title={ui.paste}>
      <label for={id} class="hint">
        {ui.pasteHint}
      </label>
      <textarea id={id} rows={3} value={typed.value} onInput={(event) => (typed.value = event.currentTarget.value)} />
      <div class="row">
        <button type="button" id="add-typed" disabled={typed.value.trim() === ""} onClick={() => void addTexts(typed.value)}>
          {ui.addThese}
        </button>
        <Import where="anchors" />
      </div>
      <Exports where="anchors" />
    </Group>
  );
}
