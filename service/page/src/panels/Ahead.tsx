// Advice: what lies ahead of the rover on the planned path, and what would help.
import { advice, move } from "../products/ahead";
import { distance, duration, length } from "../units";
import { words } from "../words";
import { Group } from "./fields";

const { ui } = words;

export function Ahead() {
  const now = advice.value;
  if (!now) return null;
  const bubbleM = Math.max(0, ...now.bubble_m);
  return (
    <Group title={ui.ahead}>
      <div id="ahead" aria-live="polite">
        {now.obstructed.length > 0 && (
          <>
            <p class="stale-note">{ui.obstructedAhead}</p>
            <ul class="list" id="obstructed">
              {now.obstructed.map((one) => (
                <li key={one.to_m}>{ui.obstructed(one.what, distance(Math.max(0, one.from_m - now.at_m)), length(one.to_m - one.from_m, 0))}</li>
              ))}
            </ul>
          </>
        )}
        <p>{now.stretches.length === 0 ? ui.nothingAhead : ui.stretchesAhead(now.stretches.length)}</p>
        <ul class="list">
          {now.stretches.map((one) => (
            <li key={one.to_m}>{ui.stretch(distance(one.from_m - now.at_m), duration(one.in_s), duration(one.for_s), one.fewest, one.hidden)}</li>
          ))}
        </ul>
        <p>{ui.bubbleAhead(length(bubbleM, 2))}</p>
        {now.speed && <p>{now.speed.sentence}</p>}
        {move.value !== null && <p>{move.value}</p>}
      </div>
    </Group>
  );
}
