const n=/^(.*)\/page\/[^/]+\.js$/.exec(new URL(import.meta.url).pathname),e=n?.[1]??"";function o(t){return e===""||t.startsWith(`${e}/`)?t:`${e}${t}`}export{o as a};
