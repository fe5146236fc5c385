// Go or no-go: what has to hold, what was found, and what nobody has calculated yet.
import { dilution, isDilutionCurrent } from "../products/dilution";
import { isHeard } from "../mission/hearing";
import { isPathCurrent, planned } from "../products/path";
import { mission } from "../state";
import { distance, duration, figure, percent } from "../units";
import { words } from "../words";

/** Each check: what, the finding, and whether it is a go; null where it was not calculated for the mission as it is. */
export function CheckTable({ id }: { id: string }) {
  const { positioning, anchors, route } = mission.value;
  const now = dilution.value;
  const path = planned.value;
  const totals = path && isPathCurrent() ? path.answer.totals : null;
  const blocked = path !== null && isPathCurrent() && totals === null;
  const checks: [string, string, boolean | null][] = [
    [words.checkAnchors, String(anchors.length), anchors.length >= 3],
    [words.checkPath, totals ? `${distance(totals.length_m)}, ${duration(totals.time_s)}` : words.notPlanned, totals ? true : blocked ? false : null],
    [words.checkSight(route.min_anchors, isHeard(mission.value)), totals ? words.fewest(totals.fewest_anchors) : words.notPlanned, totals && totals.fewest_anchors >= Math.max(route.min_anchors, 1)],
    [words.checkDop(figure(positioning.dop_limit, 1)), totals ? figure(totals.worst_dop ?? Infinity) : words.notPlanned, totals && (totals.worst_dop ?? Infinity) < positioning.dop_limit],
    [words.checkDark, totals ? duration(totals.longest_out_of_sight_s) : words.notPlanned, totals && totals.longest_out_of_sight_s === 0],
    [words.checkGround, now && isDilutionCurrent() ? percent(now.answer.share_unknown) : words.notCalculated, now && isDilutionCurrent() ? (now.answer.share_unknown ?? 1) < 0.05 : null],
  ];
  return (
    <table id={id}>
      <tbody>
        {checks.map(([what, found, go]) => (
          <tr key={what}>
            <th scope="row">{what}</th>
            <td>{found}</td>
            <td class={go === null ? "open" : go ? "go" : "no-go"}>{go === null ? words.openCheck : go ? words.go : words.noGo}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
