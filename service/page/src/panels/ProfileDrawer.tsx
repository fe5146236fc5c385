// The drawer under the map: moving along the profile moves a mark on the map, and moving over the map one in the profile.
import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { alongOf, markedPlace, profile, type Profile } from "../products/profile";
import { cursor } from "../state";
import { theme } from "../theme";
import { fromMetres, unit } from "../units";
import { words } from "../words";

const HEIGHT_PX = 150;
const AWAY = { left: -10, top: -10 };
const COLOURS = ["#0072b2", "#cc79a7"];
const FILLED = {
  ground: { stroke: "#8a6d3b", fill: "rgba(138,109,59,0.25)" },
  roofs: { stroke: "#6b6b6b", fill: "rgba(107,107,107,0.45)" },
  crowns: { stroke: "#1b7837" },
  bases: { stroke: "#1b7837", dash: [4, 3] },
};

export function ProfileDrawer() {
  const now = profile.value;
  return now && <Drawer now={now} key={now.title + now.note} />;
}

function Drawer({ now }: { now: Profile }) {
  const at = useRef<HTMLDivElement>(null);
  const looks = `${unit.value} ${theme.value}`;
  useEffect(() => {
    const target = at.current;
    if (!target) return;
    const plot = new uPlot(optionsOf(now, target.clientWidth), dataOf(now), target);
    const watch = new ResizeObserver(() => plot.setSize({ width: target.clientWidth, height: HEIGHT_PX }));
    watch.observe(target);
    const unfollow = effect(() => {
      const metres = cursor.value && alongOf(now, cursor.value);
      if (plot.status === 0) return; // before it is drawn it has no scales, and the pointer is on the button that asked for it
      plot.setCursor(metres === null ? AWAY : { left: plot.valToPos(fromMetres(metres), "x"), top: HEIGHT_PX / 2 });
    });
    return () => {
      unfollow();
      watch.disconnect();
      plot.destroy();
      markedPlace.value = null;
    };
  }, [now, looks]);
  return (
    <section class="drawer" aria-label={words.ui.profile}>
      <div class="row">
        <strong>{now.title}</strong>
        <span role="status">{now.note}</span>
        <button type="button" class="small" onClick={() => (profile.value = null)}>
          {words.ui.close}
        </button>
      </div>
      <div ref={at} />
    </section>
  );
}

function dataOf(now: Profile): uPlot.AlignedData {
  const curves = now.curves.map(({ heightM }) => heightM.map((metres) => (metres === null ? null : fromMetres(metres))));
  return [now.distanceM.map(fromMetres), ...curves];
}

/** Green between the tops and the bases of crowns. */
function crownsOf({ curves }: Profile): uPlot.Band[] {
  const [top, base] = [curves.findIndex(({ what }) => what === "crowns"), curves.findIndex(({ what }) => what === "bases")];
  return top < 0 || base < 0 ? [] : [{ series: [top + 1, base + 1], fill: "rgba(27,120,55,0.3)" }];
}

function optionsOf(now: Profile, width: number): uPlot.Options {
  const ink = getComputedStyle(document.documentElement).getPropertyValue("--ink").trim();
  const grid = { stroke: "rgba(128,128,128,0.25)" };
  return {
    width,
    height: HEIGHT_PX,
    scales: { x: { time: false } },
    axes: [
      { stroke: ink, grid, size: 30, values: (_, splits) => splits.map((value) => value.toLocaleString("en")) },
      { stroke: ink, grid, size: 56 },
    ],
    series: [
      { label: `${words.ui.distance}, ${unit.value}`, value: (_, value) => (value as number | null)?.toFixed(0) ?? "–" },
      ...now.curves.map(({ name, what }, number) => ({
        label: `${name}, ${unit.value}`,
        width: 2,
        ...(what ? FILLED[what] : { stroke: COLOURS[number - now.curves.filter((one) => one.what).length] ?? "#000000" }),
        value: (_: uPlot, value: number | null) => value?.toFixed(1) ?? "–",
      })),
    ],
    bands: crownsOf(now),
    hooks: {
      setCursor: [
        (plot) => {
          const index = plot.cursor.idx;
          markedPlace.value = index === null || index === undefined ? null : (now.places[index] ?? null);
        },
      ],
    },
  };
}
