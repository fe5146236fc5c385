// Light or dark: as the system says, until somebody chooses.
import { effect, signal } from "@preact/signals";
import { store, stored } from "./stored";

export type Theme = "light" | "dark";
const KEY = "sightline.theme";
const chosen = stored(KEY);

export const theme = signal<Theme>(
  chosen === "light" || chosen === "dark" ? chosen : matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light",
);
effect(() => {
  document.documentElement.dataset["theme"] = theme.value;
  store(KEY, theme.value);
});
