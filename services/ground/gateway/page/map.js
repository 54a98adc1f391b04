// The map, in metres, north up: calls each drawing once for every change.

import { attribute, fit, h, text, theme } from "./dom.js";
import { renew, store } from "./store.js";
import { number } from "./words.js";
import { STEP, follow, openView, settleView, showAll, vehicle, zoom } from "./map-view.js";
import { listen, pointed } from "./map-input.js";
import { grid, mark, scaleBar, wind } from "./map-ground.js";
import { area } from "./map-areas.js";
import { route, sites } from "./map-route.js";
import { alternates } from "./map-sites.js";
import { aircraft, traffic } from "./map-aircraft.js";
import { fleet } from "./map-fleet.js";
import { draft } from "./map-draft.js";

export function mountMap() {
  const panel = document.getElementById("map");
  const canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": "Map. Arrow keys pan, plus and minus zoom, F follows, 0 shows all." });
  const following = h("button", { "aria-pressed": "false", id: "map-follow", title: "Keep the vehicle in the middle (F)", click: () => follow() }, "Follow");
  const tools = h("div", { class: "map-tools" },
    h("button", { "aria-label": "Zoom in", title: "Zoom in (+)", click: () => zoom(STEP) }, "+"),
    h("button", { "aria-label": "Zoom out", title: "Zoom out (−)", click: () => zoom(1 / STEP) }, "−"),
    h("button", { title: "Show everything (0)", id: "map-all", click: showAll }, "All"),
    following,
  );
  const readout = h("div", { class: "map-readout figure" });
  panel.append(canvas, tools, readout, legend());
  openView(canvas, (on) => attribute(following, "aria-pressed", String(on)));
  listen(canvas);
  // A canvas of a new size is drawn again before it is shown.
  new ResizeObserver(renew).observe(canvas);
  return () => {
    draw(canvas);
    const hover = pointed.hover();
    text(readout, hover ? `N ${number(hover.north)}  E ${number(hover.east)}` : "");
  };
}

function legend() {
  const item = (kind, words) => h("span", { class: `key ${kind}` }, words);
  return h("div", { class: "map-legend", "aria-hidden": "true" },
    item("none", "not requested"), item("warn", "requested"), item("good", "granted"), item("bad", "denied, revoked"), item("keep", "keep out"));
}

function draw(canvas) {
  settleView();
  const doc = store.doc;
  const pen = { ...fit(canvas), colour: theme(), font: getComputedStyle(canvas).fontFamily };
  grid(pen);
  if (doc) {
    doc.areas?.forEach((it) => area(pen, it));
    route(pen);
    sites(pen);
    alternates(pen);
    doc.traffic?.forEach((it) => traffic(pen, it));
    fleet(pen);
    const here = vehicle();
    if (here?.position) aircraft(pen, here);
    wind(pen, doc.wind);
    draft(pen);
  }
  const chosen = pointed.mark();
  if (chosen) mark(pen, chosen);
  scaleBar(pen);
}
