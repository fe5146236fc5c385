import{B as o}from"./index.js";import"./map.js";class s extends o{decodeBlock(e){return e}}export{s as default};
