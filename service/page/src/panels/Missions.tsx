// The missions that the service keeps, and the versions of the one on the screen.
import { signal } from "@preact/signals";
import { getMission, listMissions, listVersions, nameVersion, removeMission, type Summary, type Version } from "../api/missions";
import { begin, kept, saved, show, who } from "../mission/keeping";
import { missionOf, NEW_MISSION } from "../mission/mission";
import { attempt, change, mission, notice } from "../state";
import { words } from "../words";
import { Group, TextField } from "./fields";

const { ui } = words;
const known = signal<readonly Summary[]>([]);
const versions = signal<readonly Version[]>([]);
const leaving = signal<string | null>(null);

const moment = (iso: string): string => new Date(iso).toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" });
const attempted = (work: () => Promise<void>) => () => void attempt("brief", work);

async function refresh(): Promise<void> {
  known.value = await listMissions();
}

async function remove(id: string): Promise<void> {
  if (leaving.peek() !== id) {
    leaving.value = id;
    return;
  }
  await removeMission(id);
  leaving.value = null;
  if (id === kept.peek()?.id) await begin({ ...NEW_MISSION, ground: mission.peek().ground });
  await refresh();
}

async function duplicate(id: string): Promise<void> {
  const told = await getMission(id);
  await show(told);
  await begin({ ...mission.peek(), name: words.copyOf(told.name) });
  await saved();
  await refresh();
}

export function Missions() {
  return (
    <Group title={ui.missions}>
      <TextField label={ui.yourName} value={who.value} onValue={(name) => (who.value = name.trim().slice(0, 80))} />
      <details id="missions" onToggle={(event) => event.currentTarget.open && void attempt("brief", refresh)}>
        <summary>{ui.missionsKept}</summary>
        <ul class="list">
          {known.value.map((one) => (
            <li key={one.id}>
              <button type="button" aria-pressed={one.id === kept.value?.id} onClick={attempted(async () => show(await getMission(one.id)))}>
                <strong>{one.name}</strong> {words.savedAt(moment(one.saved_at), one.saved_by)}, {words.onGround(one.ground)}
              </button>
              <button type="button" class="small" onClick={attempted(() => duplicate(one.id))}>
                {ui.duplicate}
              </button>
              <button type="button" class="small" onClick={attempted(() => remove(one.id))}>
                {leaving.value === one.id ? ui.deleteForGood : ui.delete}
              </button>
            </li>
          ))}
        </ul>
      </details>
      <Versions />
    </Group>
  );
}

function Versions() {
  const here = kept.value;
  if (!here) return null;
  const { id } = here;
  const refreshVersions = async (): Promise<void> => {
    versions.value = await listVersions(id);
  };
  const name = async (text: string): Promise<void> => {
    await saved();
    await nameVersion(id, kept.peek()?.version ?? here.version, text.trim() || null);
    await refreshVersions();
  };
  const openVersion = async (version: number): Promise<void> => {
    await saved();
    const told = await getMission(id, version);
    const { ground } = mission.peek();
    // the ground of then, where the service has it under another id now
    const same = told.mission.ground?.sha256 === ground?.sha256;
    change(missionOf(same ? { ...told.mission, ground } : told.mission));
    notice.value = words.openedVersion(version);
  };
  return (
    <details id="versions" onToggle={(event) => event.currentTarget.open && void attempt("brief", refreshVersions)}>
      <summary>{ui.versions(here.version)}</summary>
      <TextField label={ui.nameVersion} value="" onValue={(text) => void attempt("brief", () => name(text))} />
      <ul class="list">
        {versions.value.map((one) => (
          <li key={one.version}>
            <button type="button" onClick={attempted(() => openVersion(one.version))}>
              <strong>{one.name ?? ui.version(one.version)}</strong> {words.savedAt(moment(one.saved_at), one.saved_by)}
            </button>
          </li>
        ))}
      </ul>
    </details>
  );
}
