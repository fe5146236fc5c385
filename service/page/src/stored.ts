// What this browser keeps for the page. A browser may keep nothing, or have no room left: then the page goes on without.

/** The text under a key; null where there is none, or the browser keeps nothing. */
export function stored(key: string, where: "local" | "session" = "local"): string | null {
  try {
    return storageOf(where).getItem(key);
  } catch {
    return null;
  }
}

/** Keep a text, or with null forget it. Whether that was done. */
export function store(key: string, text: string | null, where: "local" | "session" = "local"): boolean {
  try {
    if (text === null) storageOf(where).removeItem(key);
    else storageOf(where).setItem(key, text);
    return true;
  } catch {
    return false;
  }
}

export function storedKeys(): readonly string[] {
  try {
    return Object.keys(localStorage);
  } catch {
    return [];
  }
}

// to name them is refused already where a browser keeps nothing
function storageOf(where: "local" | "session"): Storage {
  return where === "local" ? localStorage : sessionStorage;
}
