import { render } from "preact";
import { App } from "./App";
import { getDem } from "./api/dems";
import { takeGround } from "./ground";
import { keepSaving, savedMission } from "./mission/files";
import { refreshDems } from "./panels/GroundPanel";
import { watchDilution } from "./products/dilution";
import { watchPath } from "./products/path";
import { watchSurfaces } from "./products/surfaces";
import { attempt, open } from "./state";
import { words } from "./words";

const app = document.getElementById("app");
if (!app) throw new Error("The page has no place for the planner.");
document.title = words.title;
const saved = savedMission();
if (saved) open(saved);
render(<App />, app);
keepSaving();
watchSurfaces();
watchDilution();
watchPath();
void attempt("ground", async () => {
  if (saved?.ground) await takeGround(getDem(saved.ground.dem_id), saved);
  await refreshDems();
});
