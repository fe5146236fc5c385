// What the map shows, and what its colours mean.
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { contourM, type Legend, legendOf, opacity, painted } from "../map/looks";
import type { Painting } from "../map/painters";
import { css } from "../map/palettes";
import { isHeard } from "../mission/hearing";
import { frames } from "../products/frames";
import { after } from "../products/placement";
import { sites } from "../products/sites";
import { ground, mission, mode, type Overlay, overlay, OVERLAYS } from "../state";
import { percent } from "../units";
import { words } from "../words";
import { Check, Slider } from "./fields";

const { ui } = words;
const legend = signal<{ readonly of: Painting | null; readonly told: Legend | null }>({ of: null, told: null });
const SETTLE_MS = 120;

/** Whether there is anything to show, or it is asked for in the mode one is in. */
function isOffered(name: Overlay): boolean {
  const { max_above_ground_m, max_altitude_m } = mission.value.rules;
  const there: Partial<Record<Overlay, boolean>> = {
    sites: sites.value !== null,
    after: after.value !== null,
    ceiling: max_above_ground_m !== null || max_altitude_m !== null,
    air: mode.value === "air",
    signal: isHeard(mission.value),
    frame: frames.value !== null,
    available: frames.value !== null,
  };
  return (there[name] ?? true) || overlay.value === name;
}

/** Whether the legend's shares are still those of what the map showed before. */
export function awaitsLegend(): boolean {
  return painted.peek() !== legend.peek().of;
}

/** A round height between contour lines that gives about a dozen of them. */
function roundContourM(): number {
  const dem = ground.peek()?.dem;
  const span = dem && dem.lowest_m !== null && dem.highest_m !== null ? dem.highest_m - dem.lowest_m : 100;
  const power = 10 ** Math.floor(Math.log10(Math.max(span, 1) / 12));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => span / step <= 20) ?? 10 * power;
}

export function Layers() {
  const now = painted.value;
  useEffect(() => {
    const tell = (): void => {
      legend.value = { of: painted.peek(), told: legendOf() };
    };
    const later = setTimeout(tell, legend.peek().told === null ? 0 : SETTLE_MS);
    return () => clearTimeout(later);
  }, [now]);
  const shown = OVERLAYS.filter(isOffered);
  return (
    <section class="panel layers" aria-label={ui.layers}>
      <h2>{ui.layers}</h2>
      <div role="radiogroup" aria-label={ui.layers}>
        {shown.map((name) => (
          <label key={name} class="check">
            <input type="radio" name="overlay" value={name} checked={overlay.value === name} onChange={() => (overlay.value = name)} /> {words.shows(name, isHeard(mission.value))}
          </label>
        ))}
      </div>
      <Check label={ui.contours} value={contourM.value > 0} onValue={(on) => (contourM.value = on ? roundContourM() : 0)} />
      <Slider label={ui.opacity} told={`${Math.round(100 * opacity.value)} %`} value={opacity.value} min={0} max={1} step={0.05} onMove={(value) => (opacity.value = value)} />
      {now && legend.value.told && <LegendTable now={legend.value.told} />}
    </section>
  );
}

export function LegendTable({ now, id = "legend" }: { now: Legend; id?: string }) {
  return (
    <table id={id}>
      <caption>
        {now.title} <span class="hint">{ui.legend}</span>
      </caption>
      <tbody>
        {now.rows.map(({ colour, label, share }) => (
          <tr key={label}>
            <th scope="row">
              <svg class="swatch" width="14" height="14" aria-hidden="true">
                <rect width="14" height="14" fill={css(colour)} />
              </svg>
              {label}
            </th>
            <td>{percent(share)}</td>
          </tr>
        ))}
        <tr>
          <th scope="row">
            <span class="swatch hatched" aria-hidden="true" />
            {words.unknown}
          </th>
          <td>{percent(now.unknown)}</td>
        </tr>
      </tbody>
    </table>
  );
}
