// Brief: the mission as a file, and what a crew takes along on paper.
import { begin, kept, openFile, saved } from "../mission/keeping";
import { NEW_MISSION } from "../mission/mission";
import { dilution, isDilutionCurrent } from "../products/dilution";
import { isPathCurrent, planned } from "../products/path";
import { attempt, change, frame, ground, mission, notice } from "../state";
import { distance, duration, figure, percent } from "../units";
import { words } from "../words";
import { Group, TextField } from "./fields";
import { Exports, saveFile } from "./Exchange";
import { Missions } from "./Missions";
import { Downloads } from "./PathPanel";

const { ui } = words;

async function copyLink(): Promise<void> {
  await saved();
  const here = kept.peek();
  if (!here) throw new Error(words.nothingToSave);
  const link = `${location.origin}/?mission=${here.id}`;
  // over plain HTTP from another machine there is no clipboard
  await (navigator as Partial<Navigator>).clipboard?.writeText(link).catch(() => undefined);
  notice.value = words.linkIs(link);
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
          <button type="button" onClick={() => window.print()}>
            {ui.print}
          </button>
          <button type="button" onClick={() => void attempt("brief", () => begin({ ...NEW_MISSION, ground: now.ground }))}>
            {ui.newMission}
          </button>
        </div>
        <Exports where="brief" />
      </Group>
      <Missions />
      <Checks />
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

/** Each check: what, the finding, and whether it is a go; null where it was not calculated for the mission as it is. */
function Checks() {
  const { positioning, anchors, route } = mission.value;
  const now = dilution.value;
  const path = planned.value;
  const totals = path && isPathCurrent() ? path.answer.totals : null;
  const blocked = path !== null && isPathCurrent() && totals === null;
  const checks: [string, string, boolean | null][] = [
    [words.checkAnchors, String(anchors.length), anchors.length >= 3],
    [words.checkPath, totals ? `${distance(totals.length_m)}, ${duration(totals.time_s)}` : words.notPlanned, totals ? true : blocked ? false : null],
    [words.checkSight(route.min_anchors), totals ? words.fewest(totals.fewest_anchors) : words.notPlanned, totals && totals.fewest_anchors >= Math.max(route.min_anchors, 1)],
    [words.checkDop(figure(positioning.dop_limit, 1)), totals ? figure(totals.worst_dop ?? Infinity) : words.notPlanned, totals && (totals.worst_dop ?? Infinity) < positioning.dop_limit],
    [words.checkDark, totals ? duration(totals.longest_out_of_sight_s) : words.notPlanned, totals && totals.longest_out_of_sight_s === 0],
    [words.checkGround, now && isDilutionCurrent() ? percent(now.answer.share_unknown) : words.notCalculated, now && isDilutionCurrent() ? (now.answer.share_unknown ?? 1) < 0.05 : null],
  ];
  return (
    <Group title={ui.goNoGo}>
      <table id="go-no-go">
        <tbody>
          {checks.map(([what, found, go]) => (
            <tr key={what}>
              <th scope="row">{what}</th>
              <td>{found}</td>
              <td class={go === null ? "open" : go ? "go" : "no-go"}>{go === null ? words.openCheck : go ? words.go : words.noGo}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </Group>
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
