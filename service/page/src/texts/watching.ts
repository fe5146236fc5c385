// The page's words for the air, for what changes with time, and for sessions that are watched.

import type { Obstacle } from "../api/detectors";

export const watching = {
  // air
  flown: "Height above ground",
  ceiling: "Ceiling above ground",
  calculateAir: "Calculate the air",
  airHint: "Above which height positioning is good enough, for drones. The slider asks nothing anew.",
  states: { nowhere: "flyable nowhere", everywhere: "from the ground up", above: "from some height up", closed_at_ceiling: "closed at the ceiling", outside: "ground above the ceiling", unknown: "unknown" },
  // time
  overTime: "Over time",
  timeHint: "Satellites and anchors that fly, frame by frame. An anchor flies when it is given places in Anchors.",
  begins: "Begins, UTC",
  lasts: "Lasts, min",
  everyMin: "A frame every, min",
  orbits: "Satellites: take an almanac or RINEX file",
  noOrbits: "without satellites",
  dropOrbits: "Without satellites",
  calculateFrames: "Calculate the frames",
  availability: { always: "Rover: always good enough", never: "Rover: never" },
  timeOfFrame: "Frame",
  play: "Play",
  pause: "Pause",
  frameFacts: (anchors: number, satellites: number, share: string) => `${anchors} anchors, ${satellites} satellites, flyable ${share}`,
  // live
  liveHint: "A rover's ranges judged as they come: the session has this mission's anchors and looks at its ground.",
  openSession: "Open a session",
  replayLog: "Play a log back",
  sessions: "Sessions of the service",
  watch: "Watch",
  sendHere: "The rover sends its epochs to",
  timeBar: "Time",
  atEpoch: (number: number, all: number, time_s: number | null) => `${number} of ${all}${time_s === null ? "" : `, ${time_s.toFixed(1)} s`}`,
  followLive: "Follow the newest",
  leaveSession: "Leave",
  noEpoch: "No epoch has come yet.",
  rover: "The rover now",
  sigmaEastNorth: "σ east, north",
  forPlanning: "For the planner",
  ahead: "Ahead on the planned path",
  nothingAhead: "Enough anchors all along.",
  stretchesAhead: (count: number) => (count === 1 ? "Too few anchors on one stretch:" : `Too few anchors on ${count} stretches:`),
  stretch: (from: string, inTime: string, forTime: string, fewest: number, hidden: readonly string[]) =>
    `in ${from} (${inTime}), for ${forTime}: ${fewest} usable${hidden.length === 0 ? "" : `, not ${hidden.join(", ")}`}`,
  obstructedAhead: "The path leads where no rover is; no anchor counts there:",
  obstructed: (what: Obstacle, from: string, long: string) =>
    `${{ building: "through a building", "unknown ground": "over unknown ground", "outside the map": "off the map" }[what]} in ${from}, for ${long}`,
  doubts: "Ranges against the map",
  doubtsHint: "There the map lacks something, or has what is gone. The session asks it no more about these anchors; maps and later sessions take the file as doubts.",
  doubt: (id: string, expected: "in sight" | "hidden", ranges: number, fromS: number, toS: number, excess: string | null, bearingDeg: number, distance: string, sure: string) =>
    `${id}: the map has it ${expected}, ${ranges} ranges from ${fromS.toFixed(0)} to ${toS.toFixed(0)} s say ${expected === "hidden" ? "in sight" : "hidden"}${excess === null || expected === "hidden" ? "" : `, up to ${excess} too long`}. Look at ${bearingDeg.toFixed(0)}° over ${distance}; the map is wrong there with ${sure}.`,
  saveDoubts: "map_doubts.geojson",
  bubbleAhead: (radius: string) => `Largest safety bubble ahead: ${radius}.`,
  verdicts: "Sight of each anchor",
  measured: "ranges say",
  foretold: "map foretold",
  excess: "too long by",
  against: "(against the map)",
} as const;
