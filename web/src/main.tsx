/** Starts the page. */

import { render } from "preact";
import "./tokens.css";
import "./layout.css";
import "./controls.css";
import { App } from "./app";
import type { Point } from "./core/geometry";
import { pixelOf } from "./map/view";
import { listen } from "./state/keys";
import { connect, snapshot } from "./state/robot";
import "./state/theme";

declare global {
  interface Window {
    /** For tests and curious people; reads only. */
    readonly polepilot: {
      pixelOf(at: Point): Point | null;
      snapshot(): unknown;
    };
  }
}

Object.defineProperty(window, "polepilot", {
  value: Object.freeze({ pixelOf, snapshot: () => snapshot.value }),
});

listen();
connect();
const page = document.getElementById("page");
if (page) render(<App />, page);
