// Anchors, route and areas from files of other programs, and to them. The service reads and writes the files.
import { ask, blobOf, fileNameIn } from "../api/http";
import { signal } from "@preact/signals";
import { importPlaces, type Imported } from "../api/imports";
import { pathOf } from "../api/missions";
import { kept, saved } from "../mission/keeping";
import { type ExportFile, leftBehindTold } from "../mission/exported";
import { anchorsFrom, areaFrom, type AreaUse, routeFrom, useOf } from "../mission/imported";
import { holdsBuildings, takeBuildings } from "../products/buildings";
import { attempt, change, ground, mission, mode, type Mode, notice, selected } from "../state";
import { words } from "../words";
import { Group } from "./fields";

const { ui } = words;
const EXPORTS = {
  CSV: "anchors.csv",
  GeoJSON: "mission.geojson",
  KML: "mission.kml",
  KMZ: "mission.kmz",
  GPX: "mission.gpx",
  ".plan": "anchors.plan",
} as const;
const LINK_LASTS_MS = 60_000;
const found = signal<Imported | null>(null);

/** Whatever is on the screen is saved first, so that the file is of it; the service gives it the mission's name. */
export async function saveFile(name: ExportFile | "mission.json" | "mission.zip"): Promise<void> {
  await saved();
  const here = kept.peek();
  if (!here) throw new Error(words.nothingToSave);
  // fetched and not followed as a link, for a browser says nothing of a download that was refused
  const file = await ask(`${pathOf(here.id)}/files/${name}`);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await blobOf(file));
  link.download = fileNameIn(file.headers.get("Content-Disposition")) ?? name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), LINK_LASTS_MS);
}

async function exportFile(name: ExportFile): Promise<void> {
  await saveFile(name);
  const left = leftBehindTold(name, mission.peek().anchors);
  if (left !== null) notice.value = left;
}

export async function takePlaces(file: File): Promise<void> {
  const dem = ground.peek()?.dem;
  if (!dem) throw new Error(words.chooseGround);
  if (await holdsBuildings(file)) {
    mode.value = "ground";
    await attempt("ground", () => takeBuildings(file));
    return;
  }
  const read = await importPlaces(dem.id, file);
  if (read.points.length > 0) {
    const { anchors } = mission.peek();
    change({ anchors: anchorsFrom(read, anchors) });
    selected.value = mission.peek().anchors.at(-1)?.id ?? null;
  }
  found.value = read;
  notice.value = [words.imported(read.format, read.points.length, read.lines.length, read.areas.length), ...read.told].join(" ");
}

export function Import({ where }: { where: Mode }) {
  return (
    <label class="button">
      {ui.importFile}
      <input
        id="anchor-file"
        type="file"
        accept=".kml,.kmz,.gpx,.plan,.csv,.geojson,.json"
        onChange={(event) => {
          const input = event.currentTarget;
          const [file] = input.files ?? [];
          if (file) void attempt(where, () => takePlaces(file)).then(() => (input.value = ""));
        }}
      />
    </label>
  );
}

/** Lines and areas of the file that was read last: each becomes what the planner says. */
export function Found() {
  const now = found.value;
  if (!now || now.lines.length + now.areas.length === 0) return null;
  const area = (number: number, use: AreaUse): void => {
    const one = now.areas[number];
    if (one) change(areaFrom(one, use, mission.peek()));
    found.value = { ...now, areas: now.areas.filter((_, at) => at !== number) };
  };
  const route = (number: number): void => {
    const one = now.lines[number];
    if (one) change(routeFrom(one, mission.peek()));
    found.value = { ...now, lines: now.lines.filter((_, at) => at !== number) };
  };
  return (
    <Group title={ui.inTheFile}>
      <ul class="list" id="in-the-file">
        {now.lines.map((one, number) => (
          <li key={`line ${one.id} ${number}`}>
            <span>{one.id}</span>
            <button type="button" class="small" onClick={() => route(number)}>
              {ui.asRoute}
            </button>
          </li>
        ))}
        {now.areas.map((one, number) => (
          <li key={`area ${one.id} ${number}`}>
            <span>{one.id}</span>
            {(["no_go", "keep_in", "area"] as const).map((use) => (
              <button key={use} type="button" class="small" aria-pressed={useOf(one) === use} onClick={() => area(number, use)}>
                {ui.areaUses[use]}
              </button>
            ))}
          </li>
        ))}
      </ul>
    </Group>
  );
}

export function Exports({ where }: { where: Mode }) {
  return (
    <div class="row" role="group" aria-label={ui.exports}>
      <span>{ui.exports}</span>
      {Object.entries(EXPORTS).map(([name, file]) => (
        <button key={name} type="button" class="small" disabled={mission.value.ground === null} onClick={() => void attempt(where, () => exportFile(file))}>
          {name}
        </button>
      ))}
    </div>
  );
}
