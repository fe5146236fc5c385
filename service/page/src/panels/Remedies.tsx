// What would open a blocked path, each with one click: a limit relaxed, an anchor moved, an anchor added.
import { isPathCurrent, planned, remedy } from "../products/path";
import { areRemediesCurrent, remedies } from "../products/remedies";
import { words } from "../words";
import { Arriving } from "./fields";

const { ui } = words;

export function Remedies({ plan }: { plan: () => void }) {
  const relaxations = (isPathCurrent() && planned.value?.answer.unreachable?.relaxations) || [];
  const tried = areRemediesCurrent() ? (remedies.value?.all ?? []) : null;
  if (relaxations.length === 0 && tried === null) return null;
  return (
    <Arriving id="help" of={tried ?? relaxations}>
      <h3>{ui.remedies}</h3>
      <ul class="list" id="remedies">
        {relaxations.map((one) => (
          <li key={one.reason}>
            <span>
              {one.sentence} {!one.shown && ui.notTried}
            </span>
            <Take take={one.shown ? remedy(one) : null} plan={plan} />
          </li>
        ))}
        {(tried ?? []).map(({ sentence, take }) => (
          <li key={sentence}>
            <span>{sentence}</span>
            <Take take={take} plan={plan} />
          </li>
        ))}
      </ul>
      {tried?.length === 0 && <p class="hint">{ui.noAnchorHelps}</p>}
    </Arriving>
  );
}

function Take({ take, plan }: { take: (() => void) | null; plan: () => void }) {
  return (
    take && (
      <button
        type="button"
        class="small"
        onClick={() => {
          take();
          plan();
        }}
      >
        {ui.doIt}
      </button>
    )
  );
}
