// After a build: the packed reference viewer, the licences of all that is in the built files, and their digests.
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const root = new URL("..", import.meta.url).pathname;
const dist = join(root, "dist");
const viewer = join(root, "node_modules", "swagger-ui-dist");
const SOURCES = ["src", "tools", "index.html", "docs.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"];

const packed = gzipSync(readFileSync(join(viewer, "swagger-ui-bundle.js")), { level: 9 });
packed[9] = 255; // the system that packed it is no one's concern, and would change the bytes
writeFileSync(join(dist, "swagger-ui-bundle.js.gz"), packed);

// what the stories look at the page with; it is no part of what users get
mkdirSync(join(root, "testing"), { recursive: true });
writeFileSync(join(root, "testing", "axe.min.js"), readFileSync(join(root, "node_modules", "axe-core", "axe.min.js")));

const locked = JSON.parse(readFileSync(join(root, "package-lock.json"), "utf8"));
const shipped = Object.entries(locked.packages).filter(([path, entry]) => path !== "" && !entry.dev).map(([path]) => path);
const texts = [...shipped, "node_modules/swagger-ui-dist"].sort().map((path) => {
  const folder = join(root, path);
  const { name, version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const files = readdirSync(folder).filter((file) => /^(licen[cs]e|copying|notice)/i.test(file)).sort();
  const words = files.map((file) => readFileSync(join(folder, file), "utf8").trim()).join("\n\n");
  return `## ${name} ${version} (${license})\n\n${words || "The package carries no text of its licence."}\n`;
});
texts.push(`## what Swagger UI holds\n\n${readFileSync(join(viewer, "swagger-ui-bundle.js.LICENSE.txt"), "utf8").trim()}\n`);
writeFileSync(join(dist, "LICENSES.txt"), `Licences of the libraries in the planner's built files\n\n${texts.join("\n")}`);

function filesIn(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).flatMap((name) => filesIn(join(path, name)));
}
const sha = (bytes) => createHash("sha256").update(bytes).digest("hex");
function digestOf(paths) {
  const lines = paths.map((path) => `${sha(readFileSync(path))}  ${path.slice(root.length)}`).sort();
  return sha(lines.join("\n"));
}
const sources = digestOf(SOURCES.flatMap((name) => filesIn(join(root, name))));
const built = digestOf(filesIn(dist).filter((path) => !path.endsWith("digest.json")));
writeFileSync(join(dist, "digest.json"), `${JSON.stringify({ sources, built }, null, 1)}\n`);
