// Brief: the mission as a file, and what a crew takes along on paper.
import { at } from "../api/here";
import { begin, kept, openFile, saved } from "../mission/keeping";
import { NEW_MISSION } from "../mission/mission";
import { prepareSheet } from "../products/brief";
import { planned } from "../products/path";
import { attempt, change, frame, ground, mission, notice } from "../state";
import { words } from "../words";
import { CheckTable } from "./Checks";
import { Group, TextField } from "./fields";
import { Exports, saveFile } from "./Exchange";
import { Missions } from "./Missions";
import { Downloads } from "./PathPanel";

const { ui } = words;

async function copyLink(): Promise<void> {
  await saved();
  const here = kept.peek();
  if (!here) throw new Error(words.nothingToSave);
  const link = `${location.origin}${at("/")}?mission=${here.id}`;
  // over plain HTTP from another machine there is no clipboard
  await (navigator as Partial<Navigator>).clipboard?.writeText(link).catch(() => undefined);
  notice.value = words.linkIs(link);
}

async function print(): Promise<void> {
  await prepareSheet();
  // the picture has to be on the sheet before the paper is looked at
  await new Promise((resume) => requestAnimationFrame(() => requestAnimationFrame(resume)));
  await document.querySelector<HTMLImageElement>("#sheet img")?.decode();
  window.print();
}

export function BriefPanel() {
  const now = mission.value;
  return (
    <>
      <Group title={words.mode.brief}>
        <TextField label={ui.missionName} value={now.name} onValue={(name) => change({ name })} />
        <p class="hint">{ui.saved}</p>
        <div class="row no-print">
          <button type="button" id="save-file" onClick={() => void attempt("brief", () => saveFile("mission.json"))}>
            {ui.saveFile}
          </button>
          <button type="button" id="save-zip" onClick={() => void attempt("brief", () => saveFile("mission.zip"))}>
            {ui.saveZip}
          </button>
          <label class="button">
            {ui.openFile}
            <input
              id="mission-file"
              type="file"
              accept=".json,.zip"
              onChange={(event) => {
                const input = event.currentTarget;
                const [file] = input.files ?? [];
                if (file) void attempt("brief", () => openFile(file)).then(() => (input.value = ""));
              }}
            />
          </label>
          <button type="button" id="copy-link" onClick={() => void attempt("brief", copyLink)}>
            {ui.copyLink}
          </button>
          <button type="button" id="print" onClick={() => void attempt("brief", print)}>
            {ui.print}
          </button>
          <button type="button" onClick={() => void attempt("brief", () => begin({ ...NEW_MISSION, ground: now.ground }))}>
            {ui.newMission}
          </button>
        </div>
        <Exports where="brief" />
      </Group>
      <Missions />
      <Group title={ui.goNoGo}>
        <CheckTable id="go-no-go" />
      </Group>
      <AnchorTable />
      {planned.value && (
        <Group title={words.mode.path}>
          <p>{planned.value.answer.sentence}</p>
          <Downloads layers={planned.value.downloads} />
        </Group>
      )}
    </>
  );
}

function AnchorTable() {
  const { anchors } = mission.value;
  const crs = ground.value?.dem.crs_name ?? words.localMetres;
  return (
    <Group title={`${ui.anchorsTable} (${crs})`}>
      <table>
        <thead>
          <tr>
            <th scope="col">{ui.id}</th>
            <th scope="col">{ui.east}</th>
            <th scope="col">{ui.north}</th>
            <th scope="col">{words.latLon}</th>
            <th scope="col">{ui.height}, m</th>
          </tr>
        </thead>
        <tbody>
          {anchors.map((anchor) => {
            const degrees = frame.value?.toDegrees(anchor);
            return (
              <tr key={anchor.id}>
                <th scope="row">{anchor.id}</th>
                <td>{anchor.east_m.toFixed(1)}</td>
                <td>{anchor.north_m.toFixed(1)}</td>
                <td>{degrees ? `${degrees.lat_deg.toFixed(6)}, ${degrees.lon_deg.toFixed(6)}` : "–"}</td>
                <td>
                  {anchor.height_m} {anchor.height_from === "above_ground_m" ? "AGL" : words.datumShort}
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </Group>
  );
}
