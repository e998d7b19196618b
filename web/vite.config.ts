import { defineConfig } from "vite";

const robot = "http://127.0.0.1:8000";

export default defineConfig({
  base: "/",
  build: {
    outDir: "../polepilot/server/static",
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 800,
  },
  server: {
    proxy: {
      // The server refuses a foreign Host or Origin, so the development page borrows its own.
      "/api": { target: robot, changeOrigin: true, ws: true, headers: { origin: robot } },
      "/viser": { target: robot, changeOrigin: true, ws: true, headers: { origin: robot } },
    },
  },
});
