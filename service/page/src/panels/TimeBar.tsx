// The time bar under the map: a frame for each bar, as high as the share of the ground that may be flown over then.
import { useEffect, useState } from "preact/hooks";
import { frame, frames, frameShown } from "../products/frames";
import { mode, overlay } from "../state";
import { duration, percent } from "../units";
import { words } from "../words";

const { ui } = words;
const A_FRAME_MS = 600;

export function TimeBar() {
  const all = frames.value?.all ?? [];
  const now = frame.value;
  const [plays, setPlays] = useState(false);
  const shown = mode.value === "air" && now !== null;
  useEffect(() => {
    if (!plays || !shown) return;
    const timer = setInterval(() => show((frameShown.peek() + 1) % all.length), A_FRAME_MS);
    return () => clearInterval(timer);
  }, [plays, shown, all]);
  if (!shown) return null;
  const { facts } = now;
  const told = facts.time === null ? duration(facts.time_s) : `${facts.time.slice(0, 16).replace("T", " ")} UTC`;
  return (
    <section class="time-bar" aria-label={ui.overTime}>
      <div class="row">
        <button type="button" id="play" aria-pressed={plays} onClick={() => setPlays(!plays)}>
          {plays ? ui.pause : ui.play}
        </button>
        <strong id="frame-time">{told}</strong>
        <span>{ui.frameFacts(facts.anchors, facts.satellites, percent(facts.share_flyable))}</span>
      </div>
      <svg class="frame-bars" viewBox={`0 0 ${all.length} 1`} preserveAspectRatio="none" aria-hidden="true">
        {all.map(({ facts: { share_flyable, time_s } }, number) => (
          <rect key={time_s} x={number + 0.05} width={0.9} y={1 - (share_flyable ?? 0)} height={share_flyable ?? 0} class={number === frameShown.value ? "now" : ""} />
        ))}
      </svg>
      <input
        id="frame"
        type="range"
        aria-label={ui.timeOfFrame}
        aria-valuetext={told}
        min={0}
        max={all.length - 1}
        step={1}
        value={frameShown.value}
        onInput={(event) => show(event.currentTarget.valueAsNumber)}
      />
    </section>
  );
}

function show(number: number): void {
  frameShown.value = number;
  if (overlay.peek() !== "frame") overlay.value = "frame";
}
