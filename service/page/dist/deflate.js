import{i as r}from"./pako.esm.js";import{B as o}from"./index.js";import"./map.js";class d extends o{decodeBlock(e){return r(new Uint8Array(e)).buffer}}export{d as default};
