// Ground: take one, see what was read of it, choose the mission's area.
import { signal } from "@preact/signals";
import { getDem, listDems, type ReadingOptions, SAMPLES, takeSample, upload, uploadTiles } from "../api/dems";
import type { Dem } from "../api/types";
import { takeGround } from "../ground";
import { attempt, change, ground, mission, notice, refusals, tool } from "../state";
import { distance, length, percent } from "../units";
import { words } from "../words";
import { Facts, Group, TextField } from "./fields";
import { BuildingsPanel } from "./BuildingsPanel";
import { Library } from "./Library";
import { TreesPanel } from "./TreesPanel";

const known = signal<readonly Dem[]>([]);
const lastFile = signal<File | null>(null);
/** Files that were let go together and may be tiles of one ground. */
const joinable = signal<readonly File[]>([]);
const options = signal<ReadingOptions>({});
const { ui } = words;

export async function refreshDems(): Promise<void> {
  known.value = await listDems();
}

function take(request: () => Promise<Dem>): void {
  void attempt("ground", async () => {
    await takeGround(request());
    await refreshDems();
  });
}

/** Read files one after the other, and stand on the first that is a DEM; what was refused is told by its name. */
export function takeFiles(files: readonly File[]): Promise<void> {
  return attempt("ground", async () => {
    const refused: string[] = [];
    const taken: File[] = [];
    joinable.value = [];
    for (const file of files) {
      if (lastFile.value !== file) options.value = {};
      lastFile.value = file;
      try {
        const request = upload(file, options.peek());
        if (taken.length === 0) await takeGround(request);
        else await request;
        taken.push(file);
      } catch (error) {
        const why = error instanceof Error ? error.message : String(error);
        refused.push(files.length === 1 ? why : words.refusedFile(file.name, why));
      }
    }
    await refreshDems();
    if (taken.length > 1) {
      joinable.value = taken;
      notice.value = words.filesRead(taken.length, ground.peek()?.dem.name ?? "");
    }
    if (refused.length > 0) throw new Error(refused.join(" "));
  });
}

/** The files that were read one by one, as one ground. */
function join(): void {
  take(async () => {
    const dem = await uploadTiles(joinable.peek());
    [joinable.value, lastFile.value] = [[], null];
    return dem;
  });
}

function choose(value: string): void {
  const [kind, name] = value.split(":");
  if (kind === "sample" && name) take(() => takeSample(name));
  if (kind === "dem" && name) take(() => getDem(name));
}

export function GroundPanel() {
  const dem = ground.value?.dem;
  return (
    <>
      <Group title={words.mode.ground}>
        <label class="field" for="ground-choice">
          <span>{ui.bundled}</span>
          <select id="ground-choice" value={dem ? `dem:${dem.id}` : ""} onChange={(event) => choose(event.currentTarget.value)}>
            <option value="">{ui.choose}</option>
            <optgroup label={ui.bundled}>
              {SAMPLES.map((name) => (
                <option key={name} value={`sample:${name}`}>
                  {words.sample[name]}
                </option>
              ))}
            </optgroup>
            <optgroup label={ui.here}>
              {known.value.map((one) => (
                <option key={one.id} value={`dem:${one.id}`}>
                  {one.name}
                </option>
              ))}
            </optgroup>
          </select>
        </label>
        <label class="drop">
          <strong>{ui.drop}</strong>
          <span>{ui.dropHint}</span>
          <input
            id="ground-file"
            type="file"
            multiple
            onChange={(event) => void takeFiles([...(event.currentTarget.files ?? [])])}
          />
        </label>
        {joinable.value.length > 1 && (
          <div id="join" class="offer">
            <p>{ui.joinHint(joinable.value.length)}</p>
            <button type="button" id="join-tiles" class="primary" onClick={join}>
              {ui.join}
            </button>
          </div>
        )}
        {lastFile.value && <Reading file={lastFile.value} />}
      </Group>
      <Library />
      {dem && <Read dem={dem} />}
      {dem && <Area />}
      {dem && <BuildingsPanel />}
      {dem && <TreesPanel />}
    </>
  );
}

/** What the file does not say, asked for where its warning or refusal stands. */
function Reading({ file }: { file: File }) {
  const set = (name: keyof ReadingOptions) => (value: string) => {
    options.value = { ...options.value, [name]: value.trim() };
  };
  const now = options.value;
  return (
    <details open={refusals.value.ground !== undefined || (ground.value?.dem.warnings.length ?? 0) > 0}>
      <summary>{ui.readAgain(file.name)}</summary>
      <TextField label={ui.crs} value={now.crs ?? ""} onValue={set("crs")} />
      <TextField label={ui.heightUnit} value={now.height_unit ?? ""} onValue={set("height_unit")} />
      <TextField label={ui.datum} value={now.vertical_datum ?? ""} onValue={set("vertical_datum")} />
      <TextField label={ui.nodata} value={now.nodata ?? ""} onValue={set("nodata")} />
      <TextField label={ui.cell} value={now.cell_m ?? ""} onValue={set("cell_m")} />
      <button type="button" onClick={() => void takeFiles([file])}>
        {ui.readWithThese}
      </button>
    </details>
  );
}

function Read({ dem }: { dem: Dem }) {
  const heights = dem.lowest_m === null ? "–" : `${length(dem.lowest_m, 0)} – ${length(dem.highest_m, 0)}`;
  const rows: [string, string][] = [
    [ui.size, `${distance(dem.cols * dem.cell_east_m)} × ${distance(dem.rows * dem.cell_north_m)}`],
    [ui.cells, `${dem.cols} × ${dem.rows}, ${dem.cell_east_m.toPrecision(3)} × ${dem.cell_north_m.toPrecision(3)} m`],
    [ui.heights, heights],
    [ui.heightsFrom, dem.vertical_datum ?? dem.heights_count_from ?? "–"],
    [ui.crsName, dem.crs_name ?? "local metres"],
    [ui.voids, percent(dem.unknown_posts / (dem.rows * dem.cols))],
  ];
  return (
    <Group title={dem.name}>
      <Facts rows={rows} />
      {dem.warnings.length > 0 && <Sentences title={ui.warnings} sentences={dem.warnings} open />}
      {dem.conversions.length > 0 && <Sentences title={ui.conversions} sentences={dem.conversions} />}
    </Group>
  );
}

export function Sentences({ title, sentences, open }: { title: string; sentences: readonly string[]; open?: boolean }) {
  return (
    <details open={open ?? false}>
      <summary>{title}</summary>
      <ul>
        {sentences.map((sentence) => (
          <li key={sentence}>{sentence}</li>
        ))}
      </ul>
    </details>
  );
}

function Area() {
  const drawing = tool.value === "area";
  return (
    <Group title={ui.area}>
      <div class="row">
        <button type="button" aria-pressed={drawing} onClick={() => (tool.value = drawing ? "look" : "area")}>
          {ui.drawArea}
        </button>
        <button type="button" disabled={mission.value.area === null} onClick={() => change({ area: null })}>
          {ui.dropArea}
        </button>
      </div>
      {drawing && <p class="hint">{ui.areaHint}</p>}
    </Group>
  );
}
