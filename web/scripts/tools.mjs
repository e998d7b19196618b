// The page is built without the tools that check and test it; fetches them where they are missing.
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";

if (!existsSync(new URL("../node_modules/typescript", import.meta.url))) {
  console.error("fetching the tools that check the page (npm ci) ...");
  // The npm that runs this script: there may be none on the PATH.
  execFileSync(
    process.execPath,
    [process.env.npm_execpath, "ci", "--include=dev", "--no-audit", "--no-fund"],
    { stdio: ["ignore", "ignore", "inherit"], cwd: new URL("..", import.meta.url) },
  );
}
