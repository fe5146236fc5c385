// More anchors: how many, by which rules, what each place would see, and those that were found, to be taken one by one.
import type { PlacedAnchor, PlacementAnswer } from "../api/types";
import { isHeard } from "../mission/hearing";
import { acceptGhost, dismissGhosts, enoughOf, findMore, ghosts, placement, spacingOf } from "../products/placement";
import { areSitesCurrent, askForSites, sites } from "../products/sites";
import { attempt, busy, change, ground, mission, overlay, tool } from "../state";
import { length, percent } from "../units";
import { words } from "../words";
import { Arriving, Check, Group, LengthField, NumberField, Select, Stop } from "./fields";

const { ui } = words;
const TOOLS = ["no-fly", "stand-off"] as const;
const FIRST_SITES = 40;

export function FindMore() {
  const { placing, positioning } = mission.value;
  const set = (fields: Partial<typeof placing>) => change({ placing: { ...placing, ...fields } });
  const here = ground.value;
  const found = placement.value;
  const heard = isHeard(mission.value);
  const radio = heard ? mission.value.anchors.at(-1)?.radio : null;
  return (
    <Group title={ui.findMore}>
      <div class="pair">
        <NumberField where="coverage" label={ui.howMany} min={1} max={16} step={1} value={placing.count} onValue={(value) => set({ count: value ?? 1 })} />
        <LengthField where="coverage" label={ui.atHeight} min={0} value={placing.above_ground_m} onValue={(value) => set({ above_ground_m: value ?? 0 })} />
        <NumberField where="coverage" label={ui.enough} optional min={1} step={1} value={enoughOf(placing, positioning)} onValue={(min_anchors) => set({ min_anchors })} />
        {placing.best_sites === null ? (
          <LengthField where="coverage" label={ui.spacing} optional min={1} value={here && Math.round(spacingOf(here, mission.value))} onValue={(value) => set({ spacing_m: value })} />
        ) : (
          <NumberField where="coverage" label={ui.howManySites} min={1} step={1} value={placing.best_sites} onValue={(best_sites) => set({ best_sites: best_sites ?? FIRST_SITES })} />
        )}
      </div>
      <Select
        label={ui.tried}
        value={placing.best_sites === null ? "lattice" : "sites"}
        options={ui.triedAre}
        onValue={(tried) => set({ best_sites: tried === "sites" ? FIRST_SITES : null })}
      />
      <Select label={ui.objective} value={placing.objective} options={ui.objectives(heard)} onValue={(objective) => set({ objective })} />
      {placing.objective === "dop" && (
        <Check label={ui.onSurface} value={positioning.on_surface} onValue={(on_surface) => change({ positioning: { ...positioning, on_surface } })} />
      )}
      <Select label={ui.where} value={placing.where} options={ui.wheres} onValue={(where) => set({ where })} />
      {radio && <p class="hint">{ui.placedRadio(ui.radios[radio])}</p>}
      <Rules />
      <div class="row">
        <button type="button" id="find-sites" disabled={!here || "sites" in busy.value} onClick={() => void attempt("coverage", askForSites)}>
          {ui.seeSites}
        </button>
        <button type="button" id="find-more" class="primary" disabled={!here || "placement" in busy.value} onClick={() => void attempt("coverage", findMore)}>
          {ui.find}
        </button>
        <Stop of={["sites", "placement"]} />
      </div>
      {sites.value && !areSitesCurrent() && <p class="stale-note">{words.airStale}</p>}
      {found && (
        <Arriving id="found" of={found}>
          <p>
            <strong>{ui.placed(found.placed.length)}:</strong> {found.goal}. {worth(found)}
          </p>
          <p class="hint">{ui.chosenOf(found.candidates.left, found.proposed, Object.values(found.candidates.removed).reduce((all, one) => all + one, 0))}</p>
          <div class="row" role="group" aria-label={ui.beforeAfter}>
            {(["count", "after"] as const).map((name) => (
              <button key={name} type="button" class="small" id={`map-${name}`} aria-pressed={overlay.value === name} onClick={() => (overlay.value = name)}>
                {ui.mapOf[name]}
              </button>
            ))}
          </div>
          <ul class="list">
            {ghosts.value.map((ghost) => (
              <li key={ghost.id}>
                <span>
                  <strong>{ghost.id}</strong> {gain(ghost)}
                </span>
                <button type="button" class="small" aria-label={`${ui.take} ${ghost.id}`} onClick={() => acceptGhost(ghost.id)}>
                  {ui.take}
                </button>
              </li>
            ))}
          </ul>
          <div class="row">
            <button type="button" disabled={ghosts.value.length === 0} onClick={() => ghosts.peek().forEach(({ id }) => acceptGhost(id))}>
              {ui.takeAll}
            </button>
            <button type="button" onClick={dismissGhosts}>
              {ui.dismiss}
            </button>
          </div>
        </Arriving>
      )}
    </Group>
  );
}

/** What a choice of places is worth: a share that grows, or an error that gets less. */
function worth({ before_share, value_share, bound_share, before_m, value_m, bound_m }: PlacementAnswer): string {
  if (value_m === undefined) return ui.worth(percent(before_share), percent(value_share), percent(bound_share));
  return ui.worthM(length(before_m, 2), length(value_m, 2), length(bound_m, 2));
}

function gain({ marginal_share, marginal_m }: PlacedAnchor): string {
  return marginal_m === undefined ? ui.adds(percent(marginal_share)) : ui.lessens(length(marginal_m, 2));
}

/** What is drawn on the map, and the ceilings. */
function Rules() {
  const { rules } = mission.value;
  const set = (fields: Partial<typeof rules>) => change({ rules: { ...rules, ...fields } });
  const drawing = TOOLS.find((name) => name === tool.value);
  const drawn = rules.no_fly.length + rules.stand_off.length;
  return (
    <details open={drawn > 0 || drawing !== undefined}>
      <summary id="rules">{ui.rules}</summary>
      <div class="row" role="group" aria-label={ui.rules}>
        {TOOLS.map((name) => (
          <button key={name} type="button" id={`tool-${name}`} disabled={!ground.value} aria-pressed={tool.value === name} onClick={() => (tool.value = tool.value === name ? "look" : name)}>
            {ui.ruleTools[name]}
          </button>
        ))}
      </div>
      {drawing && <p class="hint">{ui.ruleHints[drawing]}</p>}
      <ul class="list" id="rule-list">
        {rules.no_fly.map((_, at) => (
          <li key={`no-fly ${at}`}>
            <span>{ui.noFly(at + 1)}</span>
            <Remove what={ui.noFly(at + 1)} onClick={() => set({ no_fly: rules.no_fly.filter((_, index) => index !== at) })} />
          </li>
        ))}
        {rules.stand_off.map((one, at) => (
          <li key={`stand-off ${at}`}>
            <LengthField
              where="coverage"
              label={ui.standOff(at + 1)}
              min={0}
              value={one.distance_m}
              onValue={(value) => set({ stand_off: rules.stand_off.map((other, index) => (index === at ? { ...one, distance_m: value ?? 0 } : other)) })}
            />
            <Remove what={ui.standOff(at + 1)} onClick={() => set({ stand_off: rules.stand_off.filter((_, index) => index !== at) })} />
          </li>
        ))}
      </ul>
      <div class="pair">
        <LengthField where="coverage" optional label={ui.ceilingGround} min={1} value={rules.max_above_ground_m} onValue={(max_above_ground_m) => set({ max_above_ground_m })} />
        <LengthField where="coverage" optional label={ui.ceilingDatum} value={rules.max_altitude_m} onValue={(max_altitude_m) => set({ max_altitude_m })} />
        <LengthField where="coverage" label={ui.separation} min={0} value={rules.min_separation_m} onValue={(value) => set({ min_separation_m: value ?? 0 })} />
        <LengthField where="coverage" optional label={ui.reach} min={1} value={rules.max_range_m} onValue={(max_range_m) => set({ max_range_m })} />
      </div>
    </details>
  );
}

function Remove({ what, onClick }: { what: string; onClick: () => void }) {
  return (
    <button type="button" class="small" aria-label={`${ui.remove} ${what}`} onClick={onClick}>
      ×
    </button>
  );
}
