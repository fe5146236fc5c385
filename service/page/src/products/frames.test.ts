import { expect, test } from "vitest";
import { newAnchor } from "../mission/mission";
import { placeAt } from "./frames";

const place = (east_m: number, north_m: number) => ({ east_m, north_m });

test("an anchor flies its legs evenly, and waits at the last place", () => {
  const anchor = { ...newAnchor([], place(0, 0)), flies_to: [place(100, 0), place(100, 0), place(100, 50)], flies_m_per_s: 10 };
  expect(placeAt(anchor, 0)).toMatchObject(place(0, 0));
  expect(placeAt(anchor, 2.5)).toMatchObject(place(25, 0));
  expect(placeAt(anchor, 12)).toMatchObject(place(100, 20));
  expect(placeAt(anchor, 99)).toMatchObject(place(100, 50));
});

test("an anchor without places to fly to stands", () => {
  expect(placeAt(newAnchor([], place(3, 4)), 60)).toMatchObject(place(3, 4));
});
