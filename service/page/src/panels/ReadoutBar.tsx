// What holds under the cursor, or at the pinned place: height, slope, both kinds of coordinates, who is in sight.
import { type Readout, readoutAt, type Sight } from "../products/readout";
import { profileTo, profileOfPath } from "../products/profile";
import { type Probed, probed } from "../products/probe";
import { pathLine } from "../products/path";
import { isHeard } from "../mission/hearing";
import { attempt, cursor, mission, mode, pinned } from "../state";
import { degrees, figure, length } from "../units";
import { words } from "../words";

const { ui } = words;
const SIGNS = { seen: "●", hidden: "○", unknown: "?" } as const;

export function ReadoutBar() {
  const place = pinned.value ?? cursor.value;
  const now = place && readoutAt(place);
  return (
    // buttons before the numbers, which grow when the exact ones arrive: what is about to be pressed stays where it is
    <section class="readout" id="readout" aria-label={words.readout}>
      {pinned.value && now && (
        <span class="row">
          {now.sight.map(({ anchor }) => (
            <button key={anchor.id} type="button" class="small" onClick={() => void attempt(mode.peek(), () => profileTo(now.place, anchor))}>
              {ui.profileOf(anchor.id)}
            </button>
          ))}
          <button type="button" class="small" onClick={() => (pinned.value = null)}>
            {ui.unpin}
          </button>
        </span>
      )}
      {now ? <Told now={now} /> : <span class="hint">{ui.cursorHint}</span>}
      {pathLine.value.length > 1 && (
        <button type="button" class="small" onClick={profileOfPath}>
          {ui.profilePath}
        </button>
      )}
    </section>
  );
}

function Told({ now }: { now: Readout }) {
  const { place, heightM, slopeDeg, dop, sight } = now;
  const exact = probed.value?.place === place ? probed.value.answer : null;
  const { measure } = mission.value.positioning;
  const dilution = exact ? (exact.dilution?.[measure] ?? Infinity) : dop;
  return (
    <>
      <output>
        <b>E</b> {place.east_m.toFixed(0)} <b>N</b> {place.north_m.toFixed(0)} m
      </output>
      {now.degrees && (
        <output>
          {degrees(now.degrees.lat_deg)}, {degrees(now.degrees.lon_deg)}
        </output>
      )}
      <output>
        {ui.heightHere} {Number.isNaN(heightM) ? words.unknown : length(heightM)}
      </output>
      <output>
        {ui.slopeHere} {Number.isNaN(slopeDeg) ? "–" : `${slopeDeg.toFixed(1)}°`}
      </output>
      {dilution !== null && sight.length > 0 && (
        <output>
          {measure.toUpperCase()} {Number.isNaN(dilution) ? words.unknown : figure(dilution)}
        </output>
      )}
      {exact && exact.position_sigma_m !== null && (
        <output>
          σ {length(exact.position_sigma_m, 2)}
        </output>
      )}
      <span class="sight">
        {sight.map((one) => (
          <span key={one.anchor.id} class={one.verdict} title={words.sightWords(one.verdict, isHeard(mission.value))}>
            {SIGNS[one.verdict]} {one.anchor.id} {marginOf(one, exact)}
            {exact && heardOf(one, exact)}
          </span>
        ))}
      </span>
    </>
  );
}

/** What of an anchor's signal is beyond need, and how probably it arrives; nothing without a radio. */
function heardOf({ anchor }: Sight, exact: Probed["answer"]): string {
  const heard = exact.anchors.find(({ id }) => id === anchor.id)?.signal;
  return heard ? ` · ${words.heard(heard.margin_db, heard.probability)}` : "";
}

/** The clearance of the exact line once it is there; before that by how much a hidden anchor is hidden. */
function marginOf({ marginM, verdict, anchor }: Sight, exact: Probed["answer"] | null): string {
  const clearanceM = exact?.anchors.find(({ id }) => id === anchor.id)?.clearance_m;
  if (clearanceM !== undefined && clearanceM !== null) return `${clearanceM >= 0 ? "+" : "−"}${length(Math.abs(clearanceM))}`;
  if (Number.isNaN(marginM) || verdict === "seen") return "";
  if (marginM === -Infinity) return words.atNoHeight;
  return `${marginM >= 0 ? "+" : "−"}${length(Math.abs(marginM))}`;
}
