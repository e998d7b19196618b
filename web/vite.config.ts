import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";

const robot = "http://127.0.0.1:8000";
const target = "../polepilot/server/static";

/** Packs what is worth it beside the files, so that the small computer need not do it per request. */
const packed: Plugin = {
  name: "packed",
  apply: "build",
  closeBundle() {
    const folder = join(import.meta.dirname, target);
    for (const name of readdirSync(folder, { recursive: true, encoding: "utf-8" })) {
      if (!/\.(js|css|html|svg)$/.test(name)) continue;
      writeFileSync(
        join(folder, `${name}.gz`),
        gzipSync(readFileSync(join(folder, name)), { level: 9 }),
      );
    }
  },
};

export default defineConfig({
  base: "/",
  plugins: [packed],
  build: { outDir: target, emptyOutDir: true, target: "es2022", chunkSizeWarningLimit: 800 },
  server: {
    proxy: {
      // The server refuses a foreign Host or Origin, so the development page borrows its own.
      "/api": { target: robot, changeOrigin: true, ws: true, headers: { origin: robot } },
      "/viser": { target: robot, changeOrigin: true, ws: true, headers: { origin: robot } },
    },
  },
});
