// Over time: which times are looked at and with which satellites; the frames themselves are on the time bar.
import { isHeard } from "../mission/hearing";
import { areFramesCurrent, askForFrames, frames, takeOrbits } from "../products/frames";
import { attempt, busy, change, ground, mission } from "../state";
import { percent } from "../units";
import { words } from "../words";
import { Arriving, Facts, Group, NumberField, Stop } from "./fields";
import { Sentences } from "./GroundPanel";
import { Downloads } from "./PathPanel";

const { ui } = words;

export function TimePanel() {
  const { times } = mission.value;
  const set = (fields: Partial<typeof times>): void => change({ times: { ...times, ...fields } });
  return (
    <>
      <Group title={ui.overTime}>
        <p class="hint">{ui.timeHint}</p>
        {isHeard(mission.value) && times.orbits && <p class="stale-note">{ui.framesSeen}</p>}
        <label class="button">
          {ui.orbits}
          <input
            id="orbits-file"
            type="file"
            onChange={(event) => {
              const input = event.currentTarget;
              const [file] = input.files ?? [];
              if (file) void attempt("air", () => takeOrbits(file)).then(() => (input.value = ""));
            }}
          />
        </label>
        <div class="row">
          <span>{times.orbits?.name ?? ui.noOrbits}</span>
          {times.orbits && (
            <button type="button" class="small" onClick={() => set({ orbits: null })}>
              {ui.dropOrbits}
            </button>
          )}
        </div>
        <Begins at={times.begins_at} onValue={(begins_at) => set({ begins_at })} />
        <div class="pair">
          <NumberField where="air" label={ui.lasts} min={0} value={times.lasts_s / 60} onValue={(value) => set({ lasts_s: 60 * (value ?? 0) })} />
          <NumberField where="air" label={ui.everyMin} min={0.01} value={times.step_s / 60} onValue={(value) => set({ step_s: 60 * (value ?? 10) })} />
        </div>
        <div class="row">
          <button type="button" id="calculate-frames" class="primary" disabled={!ground.value || "frames" in busy.value} onClick={() => void attempt("air", askForFrames)}>
            {ui.calculateFrames}
          </button>
          <Stop of={["frames"]} />
        </div>
      </Group>
      <Answer />
    </>
  );
}

/** An instant in UTC, to the minute. */
function Begins({ at, onValue }: { at: string | null; onValue: (at: string | null) => void }) {
  return (
    <label class="field">
      <span>{ui.begins}</span>
      <input
        id="begins"
        type="datetime-local"
        value={at?.slice(0, 16) ?? ""}
        onChange={(event) => onValue(event.currentTarget.value === "" ? null : `${event.currentTarget.value.slice(0, 16)}:00Z`)}
      />
    </label>
  );
}

function Answer() {
  const now = frames.value;
  if (!now) return null;
  const { over_time: time, warnings } = now.answer;
  return (
    <Arriving id="frames-answer" of={now}>
      <p class="stale-note reserved">{areFramesCurrent() ? "" : words.airStale}</p>
      <Facts
        rows={[
          [ui.availability.always, percent(time.share_always_available)],
          [ui.availability.never, percent(time.share_never_available)],
        ]}
      />
      {warnings.length > 0 && <Sentences title={ui.warnings} sentences={warnings} />}
      <Downloads layers={now.downloads} />
    </Arriving>
  );
}
