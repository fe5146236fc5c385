// The page's words for keeping a mission and for the brief.

export const briefing = {
  // brief
  missionName: "Name of the mission",
  saved: "Kept by the service after every change, with its versions.",
  saveFile: "Save as a file",
  saveZip: "Save with its ground",
  copyLink: "Link",
  missions: "Missions",
  missionsKept: "All missions",
  yourName: "Your name, for those who save against you",
  versions: (number: number) => `Versions of this mission, now ${number}`,
  version: (number: number) => `Version ${number}`,
  nameVersion: "Name this version, and keep it for good",
  delete: "Delete",
  deleteForGood: "Delete for good?",
  keepingHint: "How the mission is kept",
  keepBoth: "Keep both: mine becomes a mission of its own",
  takeTheirs: "Take theirs; undo brings mine back",
  keepMine: "Save mine over it",
  openFile: "Open a file",
  print: "Print the brief",
  newMission: "New mission",
  goNoGo: "Go or no-go",
  anchorsTable: "Anchors",
} as const;
