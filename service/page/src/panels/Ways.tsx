// The path beside other ways, and times to leave: each with what it is worth, one of them looked at, one of them taken.
import { useId } from "preact/hooks";
import type { PathAnswer } from "../api/types";
import { flies } from "../products/frames";
import { leaveAt, otherWays, shownWay, takeWay, wayShown } from "../products/ways";
import { change, mission } from "../state";
import { distance, duration, percent } from "../units";
import { words } from "../words";
import { Facts, NumberField } from "./fields";

const { ui } = words;
const minutes = (seconds: number | null): number | null => (seconds === null ? null : seconds / 60);
const seconds = (minutesGiven: number | null): number | null => (minutesGiven === null ? null : minutesGiven * 60);

/** When the rover may leave, and by when it has to be there: where an anchor flies, for else that is the same at any time. */
export function Leaving() {
  const { anchors, route } = mission.value;
  if (!anchors.some(flies)) return null;
  const set = (fields: Partial<typeof route>): void => change({ route: { ...route, ...fields } });
  const leaveBy = (leave_by_s: number | null): void => set(leave_by_s === null ? { leave_by_s, arrive_by_s: null } : { leave_by_s });
  return (
    <fieldset id="leaving">
      <legend>{ui.leaving}</legend>
      <p class="hint">{ui.leavingHint}</p>
      <div class="pair">
        <NumberField where="path" label={ui.leaves} min={0} value={minutes(route.departure_s)} onValue={(value) => set({ departure_s: seconds(value) ?? 0 })} />
        <NumberField where="path" label={ui.leaveBy} optional min={0} value={minutes(route.leave_by_s)} onValue={(value) => leaveBy(seconds(value))} />
        {route.leave_by_s !== null && (
          <NumberField where="path" label={ui.arriveBy} optional min={0} value={minutes(route.arrive_by_s)} onValue={(value) => set({ arrive_by_s: seconds(value) })} />
        )}
      </div>
    </fieldset>
  );
}

/** The times to leave that were tried. */
export function Departures({ answer, plan }: { answer: PathAnswer; plan: () => void }) {
  if (answer.departures.length === 0) return null;
  return (
    <>
      <p class="hint">{answer.departures_sentence}</p>
      <table id="departures">
        <caption>{ui.leaving}</caption>
        <thead>
          <tr>
            {ui.departureColumns.map((name) => (
              <th key={name} scope="col">
                {name}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {answer.departures.map(({ departure_s, arrival_s, in_time, taken, sentence }) => (
            <tr key={departure_s} title={sentence} class={taken ? "taken" : ""}>
              <th scope="row">{duration(departure_s)}</th>
              <td>{arrival_s === null ? ui.noWayThen : duration(arrival_s)}</td>
              <td>
                {ui.departs(taken, in_time || arrival_s === null)}{" "}
                {arrival_s !== null && (
                  <button
                    type="button"
                    class="small"
                    aria-label={ui.leaveThenAt(duration(departure_s))}
                    onClick={() => {
                      leaveAt(departure_s);
                      plan();
                    }}
                  >
                    {ui.leaveThen}
                  </button>
                )}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </>
  );
}

/** The path and the other ways, of which one is looked at, here or by a click on its line. */
export function Ways({ answer, plan }: { answer: PathAnswer; plan: () => void }) {
  const name = useId();
  const { totals } = answer;
  if (!totals || answer.alternatives_sentence === "") return null;
  const all = [{ number: 0, what: ui.thePath, totals }, ...otherWays.value.map((way) => ({ ...way, what: ui.wayIs[way.what] }))];
  const shown = shownWay.value;
  return (
    <fieldset id="ways">
      <legend>{ui.ways}</legend>
      {all.map((way) => (
        <label key={way.number} class="check">
          <input type="radio" name={name} value={way.number} checked={wayShown.value === way.number} onChange={() => (wayShown.value = way.number)} />
          {way.number > 0 && `${way.number} `}
          {ui.wayTold(way.what, distance(way.totals.length_m), duration(way.totals.time_s))}
        </label>
      ))}
      <p class="hint">{answer.alternatives_sentence}</p>
      {shown && (
        <>
          <Facts rows={[[ui.apart, percent(shown.apart_share)]]} />
          <button
            type="button"
            id="take-way"
            onClick={() => {
              takeWay(shown);
              plan();
            }}
          >
            {ui.takeWay}
          </button>
          <p class="hint">{ui.takenHint}</p>
        </>
      )}
    </fieldset>
  );
}
