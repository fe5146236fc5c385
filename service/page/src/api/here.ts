// Behind a proxy the service may have a path of a name (example.org/sightline); paths of the page's own begin with it.
const own = /^(.*)\/page\/[^/]+\.js$/.exec(new URL(import.meta.url).pathname);
export const root = own?.[1] ?? "";

/** The path as it is asked for; links in answers begin with the root already. */
export function at(path: string): string {
  return root === "" || path.startsWith(`${root}/`) ? path : `${root}${path}`;
}
