import { defineConfig } from "vitest/config";

// Names without digests: the service lets a browser ask each time whether a file is still the same.
export default defineConfig({
  base: "/page/",
  build: {
    outDir: "dist",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      input: ["index.html", "docs.html"],
      output: {
        entryFileNames: "[name].js",
        chunkFileNames: "[name].js",
        assetFileNames: "[name][extname]",
        manualChunks: { map: ["ol", "proj4"] },
      },
    },
  },
  test: { environment: "node", include: ["src/**/*.test.ts"], setupFiles: ["src/testing.ts"] },
});
