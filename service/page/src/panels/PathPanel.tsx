// Path: what it has to keep, where it goes, and what blocks it.
import { useMemo } from "preact/hooks";
import { isHeard } from "../mission/hearing";
import { isPathCurrent, planned, STRIPS, type Strip, stripShown, type PlannedPath } from "../products/path";
import { planAndHelp } from "../products/remedies";
import { shownTotals, shownWay } from "../products/ways";
import { attempt, busy, change, ground, mission, tool, type Tool } from "../state";
import { distance, duration, figure, length } from "../units";
import { words } from "../words";
import { Arriving, Check, Facts, Group, LengthField, NumberField, Select, Stop } from "./fields";
import { Sentences } from "./GroundPanel";
import { Remedies } from "./Remedies";
import { Departures, Leaving, Ways } from "./Ways";

const { ui } = words;
const TOOLS = ["start", "goal", "way-point", "no-go", "keep-in"] as const;

const plan = (): void => void attempt("path", planAndHelp);

export function PathPanel() {
  const { route, rover } = mission.value;
  const setRoute = (fields: Partial<typeof route>) => change({ route: { ...route, ...fields } });
  const setRover = (fields: Partial<typeof rover>) => change({ rover: { ...rover, ...fields } });
  return (
    <>
      <Group title={words.mode.path}>
        <div class="row" role="group" aria-label={ui.shapes}>
          {TOOLS.map((name) => (
            <button key={name} type="button" id={`tool-${name}`} disabled={!ground.value} aria-pressed={tool.value === name} onClick={() => (tool.value = tool.value === name ? "look" : name)}>
              {ui.tools[name]}
            </button>
          ))}
        </div>
        <p class="hint reserved" role="status">
          {hintOf(tool.value)}
        </p>
        <Drawn />
        <div class="pair">
          <NumberField where="path" label={ui.maxSlope} min={1} max={90} value={rover.max_slope_deg} onValue={(value) => setRover({ max_slope_deg: value ?? 25 })} />
          <NumberField where="path" label={ui.minAnchors(isHeard(mission.value))} min={0} step={1} value={route.min_anchors} onValue={(value) => setRoute({ min_anchors: value ?? 0 })} />
          <LengthField where="path" label={ui.footprint} min={0} value={rover.footprint_radius_m} onValue={(value) => setRover({ footprint_radius_m: value ?? 0 })} />
          <NumberField where="path" label={ui.speed} min={0} value={rover.speed_m_per_s} onValue={(value) => setRover({ speed_m_per_s: value ?? 1 })} />
          <NumberField where="path" label={ui.bubble} min={0} value={route.bubble_epsilon} onValue={(value) => setRoute({ bubble_epsilon: value ?? 0 })} />
          <NumberField where="path" label={ui.otherWays} min={0} max={8} step={1} value={route.alternatives} onValue={(value) => setRoute({ alternatives: value ?? 0 })} />
        </div>
        <Check label={ui.keepDop} value={route.keep_dop} onValue={(keep_dop) => setRoute({ keep_dop })} />
        <Leaving />
        <div class="row">
          <button type="button" id="plan-path" class="primary" disabled={"path" in busy.value} onClick={plan}>
            {ui.plan}
          </button>
          <Stop of={["path", "remedies"]} />
        </div>
      </Group>
      {planned.value && <Answer path={planned.value} />}
      <Remedies plan={plan} />
    </>
  );
}

function hintOf(now: Tool): string {
  if (now === "start" || now === "goal" || now === "way-point") return ui.setHint[now];
  return now === "no-go" || now === "keep-in" ? ui.setHint.area : "";
}

function Drawn() {
  const { route } = mission.value;
  const rows = useMemo(() => {
    const without = <T,>(all: readonly T[], number: number): T[] => all.filter((_, index) => index !== number);
    return [
      ...route.way_points.map((_, at) => [ui.wayPoint(at + 1), { way_points: without(route.way_points, at) }] as const),
      ...route.no_go.map((_, at) => [ui.noGo(at + 1), { no_go: without(route.no_go, at) }] as const),
      ...route.keep_in.map((_, at) => [ui.keepIn(at + 1), { keep_in: without(route.keep_in, at) }] as const),
    ];
  }, [route]);
  return (
    <ul class="list">
      {rows.map(([name, without]) => (
        <li key={name}>
          <span>{name}</span>
          <button type="button" class="small" aria-label={`${ui.remove} ${name}`} onClick={() => change({ route: { ...route, ...without } })}>
            ×
          </button>
        </li>
      ))}
    </ul>
  );
}

function Answer({ path }: { path: PlannedPath }) {
  const { answer, heard } = path;
  const { validation } = answer;
  const totals = shownTotals.value;
  const names = Object.fromEntries(STRIPS.map((name) => [name, words.strip(name, heard)])) as Record<Strip, string>;
  return (
    <Arriving id="path-answer" of={answer}>
      <h3>{answer.status === "found" ? words.pathFound : words.noPath}</h3>
      <p class="stale-note reserved">{isPathCurrent() ? "" : ui.stale}</p>
      <p>{shownWay.value?.sentence ?? answer.sentence}</p>
      <Departures answer={answer} plan={plan} />
      <Ways answer={answer} plan={plan} />
      {totals && (
        <>
          <Select label={ui.stripBy} value={stripShown.value} options={names} onValue={(value) => (stripShown.value = value)} />
          <Facts
            rows={[
              [ui.totals.length, distance(totals.length_m)],
              [ui.totals.time, duration(totals.time_s)],
              [ui.totals.climb, length(totals.climb_m, 0)],
              [ui.totals.steepest, `${totals.steepest_deg.toFixed(1)}°`],
              [ui.fewestOf(heard), String(totals.fewest_anchors)],
              [ui.totals.worst, figure(totals.worst_dop)],
              [ui.without(heard), duration(totals.out_of_sight_s)],
            ]}
          />
          {validation && !shownWay.value && <p class="hint">{validation.sentence}</p>}
        </>
      )}
      {answer.warnings.length > 0 && <Sentences title={ui.warnings} sentences={answer.warnings} />}
      <Downloads layers={path.downloads} />
    </Arriving>
  );
}

export function Downloads({ layers }: { layers: readonly { readonly name: string; readonly href: string; readonly description: string }[] }) {
  return (
    <details>
      <summary>{ui.downloads}</summary>
      <ul>
        {layers.map(({ name, href, description }) => (
          <li key={name}>
            <a href={href} download={name} title={description}>
              {name}
            </a>
          </li>
        ))}
      </ul>
    </details>
  );
}
