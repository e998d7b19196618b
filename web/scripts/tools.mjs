// The page is built without the tools that check and test it; fetches them where they are missing.
import { execSync } from "node:child_process";
import { existsSync } from "node:fs";

if (!existsSync(new URL("../node_modules/typescript", import.meta.url))) {
  console.error("fetching the tools that check the page (npm ci) ...");
  execSync("npm ci --include=dev --no-audit --no-fund", {
    stdio: ["ignore", "ignore", "inherit"],
    cwd: new URL("..", import.meta.url),
  });
}
