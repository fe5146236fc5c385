// A drone's flight: its ends on the map, what it keeps, and the way that was found.
import { flight, isFlightCurrent, planFlight, profileOfFlight, type PlannedFlight } from "../products/flight";
import { attempt, busy, change, ground, mission, tool } from "../state";
import { distance, duration, length } from "../units";
import { words } from "../words";
import { Arriving, Facts, Group, LengthField, NumberField, Stop } from "./fields";
import { Sentences } from "./GroundPanel";
import { Downloads } from "./PathPanel";

const { ui } = words;
const TOOLS = ["take-off", "landing"] as const;

export function FlightPanel() {
  const now = mission.value.flight;
  const set = (fields: Partial<typeof now>): void => change({ flight: { ...now, ...fields } });
  const inHand = TOOLS.find((name) => name === tool.value);
  return (
    <>
      <Group title={ui.flight}>
        <p class="hint">{ui.flightHint}</p>
        <div class="row" role="group" aria-label={ui.flight}>
          {TOOLS.map((name) => (
            <button key={name} type="button" id={`tool-${name}`} disabled={!ground.value} aria-pressed={inHand === name} onClick={() => (tool.value = inHand === name ? "look" : name)}>
              {ui.flightTools[name]}
            </button>
          ))}
        </div>
        <p class="hint reserved" role="status">
          {inHand && ui.flightHints[inHand]}
        </p>
        <div class="pair">
          <LengthField where="air" label={ui.flightHeight} min={0} value={now.above_ground_m} onValue={(value) => set({ above_ground_m: value ?? 0 })} />
          <LengthField where="air" label={ui.keepsAway} min={0} value={now.bubble_m} onValue={(value) => set({ bubble_m: value ?? 0 })} />
          <NumberField where="air" label={ui.flightSpeed} min={0.1} value={now.speed_m_per_s} onValue={(value) => set({ speed_m_per_s: value ?? 12 })} />
        </div>
        <div class="row">
          <button type="button" id="plan-flight" class="primary" disabled={"flight" in busy.value} onClick={() => void attempt("air", planFlight)}>
            {ui.planFlight}
          </button>
          <Stop of={["flight"]} />
        </div>
      </Group>
      {flight.value && <Answer planned={flight.value} />}
    </>
  );
}

function Answer({ planned }: { planned: PlannedFlight }) {
  const { totals, validation, sentence, warnings } = planned.answer;
  return (
    <Arriving id="flight-answer" of={planned.answer}>
      <h3>{totals ? words.flightFound : words.noFlight}</h3>
      <p class="stale-note reserved">{isFlightCurrent() ? "" : words.airStale}</p>
      <p>{sentence}</p>
      {totals && (
        <>
          <Facts
            rows={[
              [ui.totals.length, distance(totals.length_m)],
              [ui.totals.time, duration(totals.time_s)],
              [ui.totals.climb, length(totals.climb_m, 0)],
              [ui.flightTotals.highest, length(totals.highest_m, 0)],
              [ui.flightTotals.clearance, length(totals.clearance_m)],
              [ui.flightTotals.margin, length(totals.margin_m)],
            ]}
          />
          {validation && <p class="hint">{validation.sentence}</p>}
          <button type="button" class="small" onClick={() => profileOfFlight(planned)}>
            {ui.flightProfile}
          </button>
        </>
      )}
      {warnings.length > 0 && <Sentences title={ui.warnings} sentences={warnings} />}
      <Downloads layers={planned.downloads} />
    </Arriving>
  );
}
