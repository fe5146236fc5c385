// Coverage: sliders that recolour without a request, what positioning is worth.
import { useMemo } from "preact/hooks";
import { errorLimitM } from "../map/looks";
import { levelsFor } from "../api/previews";
import { isHeard, silent } from "../mission/hearing";
import type { RadioName } from "../mission/mission";
import { marginWantedDb } from "../products/margins";
import { dilution, isDilutionCurrent, shareBelow } from "../products/dilution";
import { surfaces } from "../products/surfaces";
import { change, follow, ground, mission, overlay } from "../state";
import { figure, length, percent } from "../units";
import { words } from "../words";
import { Check, Exactness, Facts, Group, Select, Slider } from "./fields";
import { FindMore } from "./FindMore";
import { Sentences } from "./GroundPanel";

const { ui } = words;

export function CoveragePanel() {
  const { rover, positioning } = mission.value;
  const height = (value: number) => ({ rover: { ...rover, receiver_above_ground_m: value } });
  const limit = (value: number) => ({ positioning: { ...positioning, dop_limit: value } });
  return (
    <>
      <Group title={words.mode.coverage}>
        <SightChoice />
        <Slider
          label={ui.receiver}
          told={length(rover.receiver_above_ground_m)}
          value={rover.receiver_above_ground_m}
          min={0}
          max={30}
          step={0.1}
          onMove={(value) => follow(height(value))}
          onRest={(value) => change(height(value))}
        />
        <Slider
          label={ui.dopLimit}
          told={figure(positioning.dop_limit, 1)}
          value={positioning.dop_limit}
          min={0.5}
          max={20}
          step={0.1}
          onMove={(value) => follow(limit(value))}
          onRest={(value) => change(limit(value))}
        />
        {overlay.value === "signal" && (
          <Slider
            label={ui.marginWanted}
            told={`${marginWantedDb.value} dB`}
            value={marginWantedDb.value}
            min={0}
            max={40}
            step={1}
            onMove={(value) => (marginWantedDb.value = value)}
          />
        )}
        {overlay.value === "error" && (
          <Slider
            label={ui.errorLimit}
            told={length(errorLimitM.value, 2)}
            value={errorLimitM.value}
            min={0.05}
            max={10}
            step={0.05}
            onMove={(value) => (errorLimitM.value = value)}
          />
        )}
        <Select
          label={ui.rangingKind}
          value={positioning.kind}
          options={ui.rangingKinds}
          onValue={(kind) => change({ positioning: { ...positioning, kind } })}
        />
        <Select
          label={ui.measure}
          value={positioning.measure}
          options={ui.measures}
          onValue={(measure) => change({ positioning: { ...positioning, measure } })}
        />
        <Check
          label={ui.onSurface}
          value={positioning.on_surface}
          onValue={(on_surface) => change({ positioning: { ...positioning, on_surface } })}
        />
      </Group>
      <Worth />
      <FindMore />
      <Trust />
    </>
  );
}

/** Whether maps are of what is in sight or of usable signals, and what is missing for these. */
function SightChoice() {
  const { positioning, anchors } = mission.value;
  const without = silent(mission.value);
  return (
    <>
      <Select label={ui.sight} value={positioning.sight} options={ui.sights} onValue={(sight) => change({ positioning: { ...positioning, sight } })} />
      {positioning.sight === "usable" && anchors.length === 0 && <p class="hint">{ui.noneToHear}</p>}
      {positioning.sight === "usable" && without.length > 0 && (
        <>
          <p class="stale-note" id="silent">{ui.silent(without)}</p>
          <Select<RadioName | "none">
            label={ui.radioOfAll}
            value="none"
            options={ui.radios}
            onValue={(radio) => change({ anchors: anchors.map((one) => ({ ...one, radio: one.radio ?? (radio === "none" ? null : radio) })) })}
          />
        </>
      )}
      {isHeard(mission.value) && <Heard />}
    </>
  );
}

function Heard() {
  const here = ground.value;
  const level = here ? levelsFor(here.dem, here.heights.level, true).full : 0;
  const satellites = mission.value.anchors.filter(({ radio }) => radio === "gnss-l1").map(({ id }) => id);
  return (
    <>
      <p class="hint">
        {ui.heardHint} {here && level > here.heights.level && ui.heardCoarse(length(here.dem.cell_east_m * 2 ** level, 0))}
      </p>
      {satellites.length > 0 && <p class="stale-note">{ui.satelliteRadio(satellites)}</p>}
    </>
  );
}

function Worth() {
  const [now, here] = [dilution.value, ground.value];
  const { dop_limit: limit, measure, on_surface } = mission.value.positioning;
  const within = useMemo(() => (now && here ? percent(shareBelow(here, now.dop, limit)) : "–"), [now, here, limit]);
  return (
    <Group title={words.dilutionOf(measure, on_surface)}>
      <div class={!now || isDilutionCurrent() ? "" : "stale"} id="dilution-facts">
        <Facts
          rows={[
            [`${ui.within} (${figure(limit, 1)})`, within],
            ["median", now ? figure(now.answer.dop_quantiles.p50) : "–"],
            ["p95", now ? figure(now.answer.dop_quantiles.p95) : "–"],
            [words.unknown, now ? percent(now.answer.share_unknown) : "–"],
          ]}
        />
      </div>
    </Group>
  );
}

/** What to know before trusting the numbers: last, as its length depends on the answer. */
function Trust() {
  const [first] = surfaces.value.values();
  const trust = dilution.value?.answer ?? first?.answer;
  if (!trust) return <p class="hint">{words.placeAnchors}</p>;
  return (
    <section>
      {trust.warnings.length > 0 && <Sentences title={ui.warnings} sentences={trust.warnings} />}
      <Exactness of={trust} />
    </section>
  );
}
