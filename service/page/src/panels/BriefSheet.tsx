// The brief on paper, two to four pages: seen in print alone.
import { dilution, isDilutionCurrent } from "../products/dilution";
import { sheet, type AnchorRow, type Sheet } from "../products/brief";
import { darkStretches, fixNeeds } from "../products/dark";
import { isPathCurrent, planned } from "../products/path";
import { isHeard } from "../mission/hearing";
import { ground, mission } from "../state";
import { distance, duration, figure } from "../units";
import { words } from "../words";
import { CheckTable } from "./Checks";
import { LegendTable } from "./Layers";

const { paper } = words;
const metres = (value: number | null, digits = 1): string => (value === null ? "–" : value.toFixed(digits));

export function BriefSheet() {
  const now = sheet.value;
  if (!now) return null;
  return (
    <article class="sheet" id="sheet">
      <Front now={now} />
      <section>
        <h2>{paper.anchors}</h2>
        <p>{paper.frames(ground.value?.dem.crs_name ?? words.localMetres, now.datum)}</p>
        <AnchorFrames rows={now.rows} />
      </section>
      <section>
        <h2>{paper.decision}</h2>
        <CheckTable id="sheet-checks" />
        <DarkTable />
        <Warnings />
      </section>
    </article>
  );
}

function Front({ now }: { now: Sheet }) {
  const dem = ground.value?.dem;
  const { name, route, rover } = mission.value;
  const path = planned.value;
  return (
    <section>
      <h1>{name}</h1>
      <p>{paper.made(now.made.toLocaleString(), dem?.name ?? "–", dem?.sha256.slice(0, 12) ?? "–")}</p>
      {now.picture && <img src={now.picture} alt={paper.map} />}
      {now.legend && <LegendTable now={now.legend} id="sheet-legend" />}
      <p>{paper.rover(rover.receiver_above_ground_m, rover.max_slope_deg, rover.speed_m_per_s)}</p>
      {path && <p>{isPathCurrent() ? path.answer.sentence : paper.pathStale}</p>}
      {route.start && <Way />}
    </section>
  );
}

function Way() {
  const { route } = mission.value;
  return (
    <table>
      <thead>
        <tr>
          <th scope="col">{paper.place}</th>
          <th scope="col">{words.ui.east}</th>
          <th scope="col">{words.ui.north}</th>
        </tr>
      </thead>
      <tbody>
        {[route.start, ...route.way_points, route.goal].map((one, at, all) => one && (
          <tr key={at}>
            <th scope="row">{at === 0 ? words.place("start") : at === all.length - 1 ? words.place("goal") : words.ui.wayPoint(at)}</th>
            <td>{one.east_m.toFixed(1)}</td>
            <td>{one.north_m.toFixed(1)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function AnchorFrames({ rows }: { rows: readonly AnchorRow[] }) {
  return (
    <table id="sheet-anchors">
      <thead>
        <tr>
          {paper.columns.map((name) => (
            <th key={name} scope="col">
              {name}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {rows.map((row) => (
          <tr key={row.id}>
            <th scope="row">
              {row.id}, {row.kind}
              {row.radio && `, ${words.ui.radios[row.radio]}`}
            </th>
            <td>{row.east_m.toFixed(1)}</td>
            <td>{row.north_m.toFixed(1)}</td>
            <td>{row.lat_deg === null ? "–" : row.lat_deg.toFixed(6)}</td>
            <td>{row.lon_deg === null ? "–" : row.lon_deg.toFixed(6)}</td>
            <td>{metres(row.above_ground_m)}</td>
            <td>{metres(row.altitude_m)}</td>
            <td>{metres(row.msl_m)}</td>
            <td>{metres(row.ellipsoid_m)}</td>
            <td>{metres(row.max_range_m, 0)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function DarkTable() {
  const path = planned.value;
  const least = fixNeeds(mission.value.positioning);
  if (!path || !isPathCurrent() || path.vertices.length === 0) return <p>{paper.noPath}</p>;
  const dark = darkStretches(path.vertices, least);
  const heard = isHeard(mission.value);
  return (
    <>
      <h3>{paper.dark(least, heard)}</h3>
      {dark.length === 0 ? (
        <p>{paper.noDark}</p>
      ) : (
        <table id="sheet-dark">
          <thead>
            <tr>
              {paper.darkColumns(heard).map((name) => (
                <th key={name} scope="col">
                  {name}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {dark.map(({ from, to, fewest }) => (
              <tr key={from.distance_m}>
                <th scope="row">{distance(from.distance_m)}</th>
                <td>{distance(to.distance_m)}</td>
                <td>{duration(to.time_s - from.time_s)}</td>
                <td>{fewest}</td>
                <td>
                  {figure(from.east_m, 0)}, {figure(from.north_m, 0)}
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </>
  );
}

function Warnings() {
  const now = dilution.value && isDilutionCurrent() ? dilution.value.answer : null;
  const path = planned.value && isPathCurrent() ? planned.value.answer : null;
  const told = [...(ground.value?.dem.warnings ?? []), ...(now?.warnings ?? []), ...(path?.warnings ?? [])];
  const trust = now ?? path;
  const { trees } = mission.value;
  const buildings = mission.value.buildings?.name ?? null;
  return (
    <>
      <h3>{words.ui.warnings}</h3>
      <ul>
        {[...new Set(told)].map((one) => (
          <li key={one}>{one}</li>
        ))}
        {trust && <li>{words.ui.trust(trust.mode, trust.error_statement, trust.curvature)}</li>}
        <li>{isHeard(mission.value) ? paper.heard(buildings, trees !== null) : paper.alone(buildings)}</li>
      </ul>
    </>
  );
}
