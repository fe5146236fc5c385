// The one screen: modes on top, the map over the whole window, layers left, inspector right, read-out and profile below.
import { useEffect, useRef } from "preact/hooks";
import "ol/ol.css";
import "./planner.css";
import { at } from "./api/here";
import { frameTimesMs, makeMap } from "./map/map";
import { remember, shownMap } from "./map/snapshot";
import { useInTheMiddle } from "./map/tools";
import { AirPanel } from "./panels/AirPanel";
import { AnchorsPanel, remove } from "./panels/AnchorsPanel";
import { BriefPanel } from "./panels/BriefPanel";
import { BriefSheet } from "./panels/BriefSheet";
import { CoveragePanel } from "./panels/CoveragePanel";
import { LivePanel } from "./panels/LivePanel";
import { takePlaces } from "./panels/Exchange";
import { GroundPanel, takeFiles } from "./panels/GroundPanel";
import { Conflict, Keeping } from "./panels/Keeping";
import { awaitsLegend, Layers } from "./panels/Layers";
import { PathPanel } from "./panels/PathPanel";
import { ProfileDrawer } from "./panels/ProfileDrawer";
import { TimeBar } from "./panels/TimeBar";
import { ReadoutBar } from "./panels/ReadoutBar";
import {
  accept, attempt, busy, canRedo, canUndo, change, ground, mission, mode, type Mode, MODES, notice, overlay, redo, refusals,
  selected, tool, undo, withAnchor,
} from "./state";
import { awaitsDilution, dilutionTimesMs } from "./products/dilution";
import { awaitsMargins } from "./products/margins";
import { probeTimesMs } from "./products/probe";
import { overview } from "./products/library";
import { awaitsSurfaces, surfaceTimesMs } from "./products/surfaces";
import { heldByRaster, saysTrees, takeTrees } from "./products/trees";
import { awaitsKeeping, conflict, openFile, unsaved } from "./mission/keeping";
import { theme } from "./theme";
import { unit } from "./units";
import { words } from "./words";

const { ui } = words;
const PANELS = { ground: GroundPanel, anchors: AnchorsPanel, coverage: CoveragePanel, path: PathPanel, air: AirPanel, live: LivePanel, brief: BriefPanel };
const MOVES: Readonly<Record<string, readonly [number, number]>> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Whether everything on the page is of the mission as it stands: what a test waits for, and a script. */
const mapAtRest = (): boolean => Object.keys(busy.peek()).length === 0 && !awaitsSurfaces() && !awaitsDilution() && !awaitsMargins() && !awaitsLegend();
const atRest = (): boolean => mapAtRest() && !awaitsKeeping();

function enter(next: Mode): void {
  mode.value = next;
  tool.value = "look";
  if (next === "anchors" && ground.peek() && mission.peek().anchors.length === 0) tool.value = "anchor";
  if ((next === "anchors" || next === "coverage") && overlay.peek() === "none") overlay.value = "count";
}

export function App() {
  const Panel = PANELS[mode.value];
  useKeys();
  useDrop();
  return (
    <>
      <header class="bar">
        <h1>Sightline</h1>
        <nav aria-label={ui.modes}>
          {MODES.map((name) => (
            <button key={name} type="button" id={`mode-${name}`} aria-current={mode.value === name ? "page" : undefined} onClick={() => enter(name)}>
              {words.mode[name]}
            </button>
          ))}
        </nav>
        <Working />
        <Keeping />
        <span class="row tools">
          <button type="button" id="undo" disabled={!canUndo.value} onClick={undo}>{ui.undo}</button>
          <button type="button" id="redo" disabled={!canRedo.value} onClick={redo}>{ui.redo}</button>
          <button type="button" id="unit" onClick={() => (unit.value = unit.value === "m" ? "ft" : "m")}>{unit.value === "m" ? ui.feet : ui.metres}</button>
          <button type="button" id="theme" onClick={() => (theme.value = theme.value === "dark" ? "light" : "dark")} aria-label={ui.theme} title={ui.theme}>{ui.themeSign}</button>
          <a href={at("/docs")}>{ui.reference[0]}<span class="wide">{ui.reference[1]}</span></a>
        </span>
      </header>
      <main>
        <div class="stage">
          <MapArea />
          <Layers />
          <aside class="panel inspector" aria-label={ui.inspector}>
            <Panel />
          </aside>
          <Told />
        </div>
        <div class="below">
          <ReadoutBar />
          <TimeBar />
          <ProfileDrawer />
        </div>
      </main>
      <BriefSheet />
    </>
  );
}

/** What is being worked on: in a place of its own, so that nothing moves away from under a pointer. */
function Working() {
  return (
    <span class="working" role="status">
      {Object.entries(busy.value).map(([what, share]) => <span key={what} class="busy">{ui.working(words.work(what), share)}</span>)}
    </span>
  );
}

/** What was refused and what happened: on the map beside the inspector, always in view, and nothing makes way for it. */
function Told() {
  const where = refusals.value[mode.value] === undefined ? "anchors" : mode.value;
  const told = refusals.value[where];
  const keeping = conflict.value === null && (told === undefined || unsaved.value?.includes(told)) ? unsaved.value : null;
  // one reason is told once
  const refusal = keeping === null ? told : undefined;
  return (
    <div class="told">
      <div role="alert"><Conflict />{keeping !== null && <p class="refusal" id="unsaved">{keeping}</p>}{refusal !== undefined && <p class="refusal" id="refusal">{refusal} <button type="button" class="small" onClick={() => accept(where)}>{ui.close}</button></p>}</div>
      <div role="status">
        {notice.value !== "" && <p class="notice" id="notice">{notice.value} <button type="button" class="small" onClick={() => (notice.value = "")}>{ui.close}</button></p>}
      </div>
    </div>
  );
}

function MapArea() {
  const target = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (!target.current) return;
    const map = makeMap(target.current);
    remember(map);
    Object.assign(window, { planner: { map, atRest, mapAtRest, mission: () => mission.peek(), times: { frameTimesMs, surfaceTimesMs, dilutionTimesMs, probeTimesMs } } });
    return () => map.setTarget(undefined);
  }, []);
  return (
    <>
      <div id="map" ref={target} tabIndex={0} role="application" aria-label={ui.map} onKeyDownCapture={onMapKey} />
      {tool.value !== "look" && <div class="cross" aria-hidden="true" />}
      {!ground.value && !overview.value && <p class="welcome">{ui.welcome}</p>}
    </>
  );
}

function onMapKey(event: KeyboardEvent): void {
  const map = shownMap();
  if (event.key === "Enter" && map) {
    event.preventDefault();
    useInTheMiddle(map, event.shiftKey);
    return;
  }
  const dem = ground.peek()?.dem;
  const chosen = mission.peek().anchors.find((anchor) => anchor.id === selected.peek());
  if (!dem || !chosen || mode.peek() !== "anchors") return;
  const move = MOVES[event.key];
  if (!move && event.key !== "Delete") return;
  event.preventDefault();
  event.stopPropagation();
  if (!move) {
    remove(chosen.id);
    return;
  }
  const cells = event.shiftKey ? 10 : 1;
  const east_m = chosen.east_m + move[0] * cells * dem.cell_east_m;
  change(withAnchor(chosen.id, { east_m, north_m: chosen.north_m + move[1] * cells * dem.cell_north_m }));
}

function useKeys(): void {
  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (event.key === "Escape") tool.value = "look";
      const typing = event.target instanceof HTMLElement && /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName) && event.target.getAttribute("type") !== "range";
      if (!(event.ctrlKey || event.metaKey) || typing) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) undo();
      else if (key === "y" || (key === "z" && event.shiftKey)) redo();
      else return;
      event.preventDefault();
    };
    document.addEventListener("keydown", onKey);
    return () => document.removeEventListener("keydown", onKey);
  }, []);
}

/** What was let go on the page: missions open, places are imported, rasters on the panel of trees, or called so, are
 * trees, and all else is read as ground. */
async function takeDropped(files: readonly File[], onTrees: boolean): Promise<void> {
  const isMission = ({ name }: File): boolean => /\.(json|zip)$/i.test(name);
  const isPlaces = ({ name }: File): boolean => /\.(kml|kmz|gpx|plan|geojson|csv)$/i.test(name);
  const isTrees = (file: File): boolean => ground.peek() !== null && (onTrees || saysTrees(file.name));
  const rasters = files.filter((file) => !isMission(file) && !isPlaces(file));
  const [grounds, [trees]] = [rasters.filter((file) => !isTrees(file)), rasters.filter(isTrees)];
  if (grounds.length > 0) {
    mode.value = "ground";
    await takeFiles(grounds);
  }
  if (trees) {
    mode.value = "ground";
    await attempt("ground", () => takeTrees(trees, heldByRaster.peek()));
  }
  for (const file of files.filter(isMission)) {
    mode.value = "brief";
    await attempt("brief", () => openFile(file));
  }
  for (const file of files.filter(isPlaces)) {
    mode.value = "anchors";
    await attempt("anchors", () => takePlaces(file));
  }
}

/** Files let go anywhere on the page. */
function useDrop(): void {
  useEffect(() => {
    const over = (event: DragEvent): void => event.preventDefault();
    const drop = (event: DragEvent): void => {
      event.preventDefault();
      const onTrees = event.target instanceof Element && event.target.closest("#trees") !== null;
      void takeDropped([...(event.dataTransfer?.files ?? [])], onTrees);
    };
    document.addEventListener("dragover", over);
    document.addEventListener("drop", drop);
    return () => {
      document.removeEventListener("dragover", over);
      document.removeEventListener("drop", drop);
    };
  }, []);
}
