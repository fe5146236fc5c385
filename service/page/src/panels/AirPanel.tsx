// Air: above which height positioning is good enough; the height flown at is a slider over the arrays.
import { air, askForAir, flownAboveGroundM, isAirCurrent } from "../products/air";
import { attempt, busy, change, mission, overlay } from "../state";
import { length, percent } from "../units";
import { words } from "../words";
import { Arriving, Exactness, Facts, Group, LengthField, Slider, Stop } from "./fields";
import { FlightPanel } from "./FlightPanel";
import { Sentences } from "./GroundPanel";
import { Downloads } from "./PathPanel";
import { TimePanel } from "./TimePanel";

const { ui } = words;
const TIMED: ReadonlySet<string> = new Set(["frame", "available"]);

export function AirPanel() {
  const { ceiling_above_ground_m: ceilingM } = mission.value;
  const now = air.value;
  return (
    <>
      <Group title={words.mode.air}>
        <p class="hint">{ui.airHint}</p>
        <LengthField where="air" label={ui.ceiling} min={1} value={ceilingM} onValue={(value) => change({ ceiling_above_ground_m: value ?? 300 })} />
        <div class="row">
          <button type="button" id="calculate-air" class="primary" disabled={"air" in busy.value} onClick={() => void attempt("air", askForAir)}>
            {ui.calculateAir}
          </button>
          <Stop of={["air"]} />
        </div>
        <Slider
          label={ui.flown}
          told={length(flownAboveGroundM.value, 0)}
          value={flownAboveGroundM.value}
          min={0}
          max={ceilingM}
          step={Math.max(1, Math.round(ceilingM / 300))}
          onMove={(value) => {
            flownAboveGroundM.value = value;
            if (air.value && !TIMED.has(overlay.peek())) overlay.value = "air";
          }}
        />
      </Group>
      {now && (
        <Arriving id="air-answer" of={now}>
          <p class="stale-note reserved">{isAirCurrent() ? "" : words.airStale}</p>
          <Facts rows={now.answer.states.filter(({ posts }) => posts > 0).map(({ state, share }) => [nameOf(state), percent(share)])} />
          {now.answer.warnings.length > 0 && <Sentences title={ui.warnings} sentences={now.answer.warnings} />}
          <Exactness of={now.answer} />
          <Downloads layers={now.downloads} />
        </Arriving>
      )}
      <FlightPanel />
      <TimePanel />
    </>
  );
}

function nameOf(state: string): string {
  return state in ui.states ? ui.states[state as keyof typeof ui.states] : state;
}
