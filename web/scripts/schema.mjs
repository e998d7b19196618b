// Writes src/api/schema.ts from the server's OpenAPI document, or (--check) says that it is stale.
import { readFile, writeFile } from "node:fs/promises";
import openapi, { astToString } from "openapi-typescript";

const document = new URL("../openapi.json", import.meta.url);
const target = new URL("../src/api/schema.ts", import.meta.url);

const header = "// Generated from web/openapi.json by `npm run schema`. Do not edit.\n\n";
const text = header + astToString(await openapi(document, { alphabetize: true }));
if (process.argv.includes("--check")) {
  if ((await readFile(target, "utf8").catch(() => "")) !== text) {
    console.error("web/src/api/schema.ts does not fit web/openapi.json: run `npm run schema`.");
    process.exit(1);
  }
} else {
  await writeFile(target, text);
  console.log("wrote web/src/api/schema.ts");
}
