import { render } from "preact";
import { App } from "./App";
import { followGround } from "./ground";
import { beginKeeping } from "./mission/keeping";
import { refreshDems } from "./panels/GroundPanel";
import { refreshLibrary } from "./products/library";
import { watchAhead } from "./products/ahead";
import { watchDilution } from "./products/dilution";
import { watchPath } from "./products/path";
import { watchProbes } from "./products/probe";
import { watchSurfaces } from "./products/surfaces";
import { attempt } from "./state";
import { words } from "./words";

const app = document.getElementById("app");
if (!app) throw new Error("The page has no place for the planner.");
document.title = words.title;
render(<App />, app);
followGround();
watchSurfaces();
watchDilution();
watchPath();
watchProbes();
watchAhead();
void attempt("ground", beginKeeping);
void attempt("ground", async () => {
  await refreshDems();
  await refreshLibrary();
});
