// Live: a detector session on the map as it judges, or a log played back on a time bar.
import { useEffect } from "preact/hooks";
import { doubtFile, doubts, readDoubts } from "../products/doubts";
import { epoch, epochs, leave, lookedAt, openLinks, openSession, refreshSessions, replay, type Sighted, sighted, sessions, watch, watched } from "../products/live";
import { attempt, busy, ground } from "../state";
import { distance, length, percent, probability } from "../units";
import { words } from "../words";
import { Ahead } from "./Ahead";
import { Facts, Group, Slider, Stop } from "./fields";

const { ui } = words;

export function LivePanel() {
  useEffect(() => void attempt("live", refreshSessions), []);
  return (
    <>
      {watched.value ? <Watched name={watched.value.name} /> : <Choose />}
      {watched.value && <Now />}
      {watched.value && <Ahead />}
      {watched.value && <Doubted />}
    </>
  );
}

function Choose() {
  return (
    <Group title={words.mode.live}>
      <p class="hint">{ui.liveHint}</p>
      <div class="row">
        <button type="button" id="open-session" class="primary" disabled={!ground.value} onClick={() => void attempt("live", openSession)}>
          {ui.openSession}
        </button>
        <label class="button">
          {ui.replayLog}
          <input
            id="log-file"
            type="file"
            disabled={!ground.value || "replay" in busy.value}
            onChange={(event) => {
              const input = event.currentTarget;
              const [file] = input.files ?? [];
              if (file) void attempt("live", () => replay(file, readDoubts)).then(() => (input.value = ""));
            }}
          />
        </label>
        <Stop of={["replay"]} />
      </div>
      {sessions.value.length > 0 && <h4>{ui.sessions}</h4>}
      <ul class="list" id="sessions">
        {sessions.value.map((one) => (
          <li key={one.id}>
            <span>{one.name ?? one.id}</span>
            <button type="button" class="small" aria-label={`${ui.watch} ${one.name ?? one.id}`} onClick={() => watch(one)}>
              {ui.watch}
            </button>
          </li>
        ))}
      </ul>
    </Group>
  );
}

function Watched({ name }: { name: string }) {
  const detector = watched.value?.detector;
  const all = epochs.value;
  const last = Math.max(all.length - 1, 0);
  const shown = lookedAt.value ?? last;
  return (
    <Group title={name}>
      {detector && (
        <p class="hint">
          {ui.sendHere} <code>{detector.links.stream}</code>
        </p>
      )}
      <Slider
        label={ui.timeBar}
        told={ui.atEpoch(all.length === 0 ? 0 : shown + 1, all.length, all[shown]?.time_s ?? null)}
        value={shown}
        min={0}
        max={last}
        step={1}
        onMove={(value) => (lookedAt.value = detector && value === last ? null : value)}
      />
      <div class="row">
        {detector && (
          <button type="button" disabled={lookedAt.value === null} onClick={() => (lookedAt.value = null)}>
            {ui.followLive}
          </button>
        )}
        <button type="button" id="leave-session" onClick={leave}>
          {ui.leaveSession}
        </button>
      </div>
    </Group>
  );
}

function Now() {
  const now = epoch.value;
  if (!now) return openLinks.value ? <p class="hint" id="listening">{ui.noEpoch}</p> : null;
  const { position } = now;
  const sigma = (axis: number): string => {
    const variance = position?.covariance_m2[axis]?.[axis];
    return typeof variance === "number" ? length(Math.sqrt(variance), 2) : "–";
  };
  return (
    <Group title={ui.rover}>
      <div id="live-answer">
        <p>{now.summary}</p>
        {now.needed !== "" && <p class="hint">{now.needed}</p>}
        <Facts
          rows={[
            [ui.east, position?.east_m?.toFixed(1) ?? "–"],
            [ui.north, position?.north_m?.toFixed(1) ?? "–"],
            [ui.sigmaEastNorth, `${sigma(0)}, ${sigma(1)}`],
            [ui.forPlanning, now.planning],
          ]}
        />
        <table id="verdicts">
          <caption>{ui.verdicts}</caption>
          <thead>
            <tr>
              <th scope="col">{ui.id}</th>
              <th scope="col">{ui.measured}</th>
              <th scope="col">{ui.foretold}</th>
              <th scope="col">{ui.excess}</th>
            </tr>
          </thead>
          <tbody>
            {sighted.value.map((one) => (
              <Row key={one.anchor.id} one={one} />
            ))}
          </tbody>
        </table>
      </div>
    </Group>
  );
}

/** Where the ranges contradict the map, in words; the lines are on the map. */
function Doubted() {
  if (doubts.value.length === 0) return null;
  return (
    <Group title={ui.doubts}>
      <p class="hint">{ui.doubtsHint}</p>
      <ul class="list" id="doubts">
        {doubts.value.map(({ told }) => (
          <li key={`${told.anchor_id} ${told.from_s}`}>
            {ui.doubt(told.anchor_id, told.expected, told.ranges, told.from_s, told.to_s, told.excess_m === null ? null : length(told.excess_m), told.bearing_deg, distance(told.distance_m), probability(told.probability))}
          </li>
        ))}
      </ul>
      <a href={`data:application/geo+json,${encodeURIComponent(JSON.stringify(doubtFile.value))}`} download={ui.saveDoubts}>
        {ui.saveDoubts}
      </a>
    </Group>
  );
}

function Row({ one }: { one: Sighted }) {
  const against = one.foretold !== null && ((one.sight === "occluded" && one.foretold > 0.5) || (one.sight === "clear" && one.foretold < 0.5));
  return (
    <tr title={one.reason}>
      <th scope="row">{one.anchor.id}</th>
      <td class={one.sight === "clear" ? "go" : one.sight === "unknown" ? "open" : "no-go"}>{words.measuredSight[one.sight]}</td>
      <td>
        {one.foretold === null ? "–" : percent(one.foretold)}
        {one.usable !== null && `, ${ui.usableForetold(percent(one.usable))}`}
        {against && ` ${ui.against}`}
      </td>
      <td>{one.excessM === null ? "–" : length(one.excessM, 2)}</td>
    </tr>
  );
}
