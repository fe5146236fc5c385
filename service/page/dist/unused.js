class o{init(){return Promise.reject(new Error("Zstandard is decoded by fzstd here."))}}function e(){throw new Error("LERC is not read here.")}const d={decode:e};export{d as L,o as Z};
